"""Runs a case at samples of its uncertain numbers, through a sweep, and estimates what they do to its quantities."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from impactlab import derivatives
from impactlab.casefile import Case
from impactlab.casefile.words import closest, shown
from impactlab.errors import CaseError, ImpactlabError
from impactlab.report.provenance import of_case
from impactlab.sweeps import Sampled, sweep
from impactlab.sweeps.chunks import DRAFT
from impactlab.sweeps.plots import ENDED
from impactlab.sweeps.run import kept_in
from impactlab.types import Array
from impactlab.uncertainties.design import Design, check_samples, design
from impactlab.uncertainties.distributions import Uncertain, read_uncertain
from impactlab.uncertainties.edges import edges_within
from impactlab.uncertainties.failures import failed_words
from impactlab.uncertainties.linear import Linear, at_means, estimates, linear
from impactlab.uncertainties.page import write_page
from impactlab.uncertainties.records import Index, Share, Spread
from impactlab.uncertainties.result import Uncertainty
from impactlab.uncertainties.statistics import estimate, percentile, probability, sobol_indices

if TYPE_CHECKING:
    import xarray

DEFAULT = derivatives.DEFAULT
PERCENTS = (5.0, 50.0, 95.0)
COUNTED = "contacts"
STOP, LEAVE_OUT = "stop", "leave_out"  # what failed points do to the indices


def uncertainty(
    case: Case,
    vary: Mapping[str, Any],
    quantities: Sequence[str | Sampled] = DEFAULT,
    *,
    samples: int = 4096,
    seed: int = 1,
    percentiles: Sequence[float] = PERCENTS,
    indices: bool = True,
    failed: str = STOP,
    workers: int = 0,
    out: str | Path | None = None,
    shard: str | tuple[int, int] | None = None,
    cluster: str | None = None,
    progress: Callable[[float], None] | None = None,
    command: str = "",
    repeat: str = "impactlab run case.yaml",
) -> Uncertainty:
    """Return what uncertain numbers of a case do to its quantities: percentiles, probabilities and Sobol indices.

    The case is run at scrambled Sobol points by `impactlab.sweep`. The points are 16 sets that are scrambled
    independently; from their scatter come the 95 % intervals of all estimates.

    Parameters
    ----------
    case : Case
        The case, with the method that solves it.
    vary : mapping
        Dotted path of a number to its distribution: a text such as ``normal(2.133 kg, 1 %)``, ``lognormal(MEAN,
        DEVIATION)``, ``uniform(LOW, HIGH)``, ``table(VALUE: WEIGHT, ...)`` or ``table(FILE.csv, COLUMN)``; one of
        `scipy.stats` with its parameters in SI; a sequence of values, or a mapping of values to weights.
    quantities : sequence
        Names of quantities (`impactlab plugins` lists them), and `Sampled` channels.
    samples : int
        Number of samples, a power of two.
    seed : int
        Of the scrambling; the same seed gives the same points.
    percentiles : sequence of float
        Those that are estimated, between 0 and 100.
    indices : bool
        Whether first and total Sobol indices are estimated, where two numbers or more are uncertain: with d of them
        the case is run (d + 2) times as often.
    failed : str
        ``stop``: points without values stop the indices; ``leave_out``: indices are those of the other points.
    workers, out, shard, cluster, progress, command, repeat
        As of `impactlab.sweep`. The folder also gets ``uncertainty.json``, and a page of its own.

    Raises
    ------
    CaseError, PairingError, PluginError
        Before the first run: a path, a distribution, a quantity or the number of samples is wrong.
    SweepError
        If points can no longer be kept or computed.
    """
    check_samples(samples, seed)
    percents = _percents(percentiles)
    if failed not in (STOP, LEAVE_OUT):
        text = f"{shown(failed)} is no way to treat points without values.{closest(failed, (STOP, LEAVE_OUT))}"
        raise CaseError(text, path="--failed", remedy=f"Give {STOP} or {LEAVE_OUT}.")
    uncertain = read_uncertain(case, vary)
    made = design(uncertain, samples, seed, indices=indices)
    wanted = [*quantities, *([] if COUNTED in quantities else [COUNTED])]
    shared: dict[str, Any] = {"workers": workers, "out": out, "progress": progress, "command": command}
    data = sweep(case, points=made.points, quantities=wanted, shard=shard, cluster=cluster, repeat=repeat, **shared)
    blocks, sets, size = made.shape
    data = data.assign_coords(block=("point", np.repeat(np.arange(blocks), sets * size)))
    data = data.assign_coords(scrambling=("point", np.tile(np.repeat(np.arange(sets), size), blocks)))
    if (missing := int(np.count_nonzero(data["status"].values == 0))) > 0:
        words = f"{missing:,} of {data.sizes['point']:,} points are missing. A call without the shard computes them."
        return Uncertainty(case.label, uncertain, samples, seed, percents, (), (), (), (words,), data)
    found = _estimated(case, uncertain, data, made, list(quantities), percents, seed, leave_out=failed == LEAVE_OUT)
    if out is not None:
        with kept_in(Path(out)):
            _write(Path(out), found, case, command)
    return found


def _percents(given: Sequence[float]) -> tuple[float, ...]:
    percents = tuple(sorted({float(percent) for percent in given}))
    if not percents or not all(0.0 < percent < 100.0 for percent in percents):
        text = f"the percentiles {shown(', '.join(f'{percent:g}' for percent in percents))}"
        raise CaseError(text, path="--percentiles", remedy="Give numbers between 0 and 100, such as 5,50,95.")
    return percents


def _estimated(
    case: Case,
    uncertain: tuple[Uncertain, ...],
    data: xarray.Dataset,
    made: Design,
    quantities: Sequence[str | Sampled],
    percents: tuple[float, ...],
    seed: int,
    *,
    leave_out: bool,
) -> Uncertainty:
    """Return the estimates of a sweep that is complete."""
    ended = np.isin(data["status"].values, ENDED)
    warnings = [] if ended.all() else [failed_words(data, ended, uncertain)]
    slopes, lines = linear(case, uncertain, quantities), dict[tuple[str, str], Linear]()
    if isinstance(slopes, ImpactlabError):
        warnings.append(f"No linear estimate: {slopes.text}.")
    else:
        lines = estimates(slopes, uncertain)
        warnings += [edge.words for edge in edges_within(case, uncertain, slopes)]
    shares = _shares(data, made)
    spreads, found, lacking = [], list[Index](), list[str]()
    for name in [each.channel if isinstance(each, Sampled) else each for each in quantities]:
        for label, values in _values(data, name, made):
            line = lines.get((name, label), Linear())
            spread = _spread(name, label, data, values[0], percents, line)
            spreads.append(spread)
            if spread.samples < np.count_nonzero(ended[: made.samples]):
                lacking.append(spread.name)
            if made.shape[0] > 1:
                found += _indices(spread, values, uncertain, line, leave_out=leave_out)
    if lacking:
        warnings.append(f"No value at some samples: {', '.join(lacking)}. Estimates are those of the other samples.")
    if any(math.isnan(each.total.value) for each in found) and (lacking or not ended.all()) and not leave_out:
        text = "Points without values stop the Sobol indices."
        warnings.append(f"{text} To leave them out: failed='leave_out', or --failed leave_out.")
    return Uncertainty(
        case.label, uncertain, made.samples, seed, percents, tuple(spreads), tuple(shares), tuple(found),
        tuple(warnings), data,
    )  # fmt: skip


def _values(data: xarray.Dataset, name: str, made: Design) -> list[tuple[str, Array]]:
    """Return label and values, (blocks, scramblings, points), of each value of a quantity."""
    values = data[name].transpose("point", ...).values.reshape(*made.shape, -1)
    others = [dim for dim in data[name].dims if dim != "point"]
    labels = [str(label) for label in data[others[0]].values.tolist()] if others else [""]
    return [(label, values[..., number]) for number, label in enumerate(labels)]


def _spread(
    name: str, label: str, data: xarray.Dataset, values: Array, percents: tuple[float, ...], line: Linear
) -> Spread:
    sets = [each[np.isfinite(each)] for each in values]
    unit = str(data[name].attrs["units"])
    return Spread(
        name, label, "" if unit == "1" else unit, sum(each.size for each in sets),
        estimate(lambda of: float(np.mean(of)), sets), estimate(lambda of: float(np.std(of)), sets),
        tuple(percentile(percent, sets) for percent in percents), line.mean, line.deviation,
    )  # fmt: skip


def _shares(data: xarray.Dataset, made: Design) -> list[Share]:
    """Return the probability of each number of periods of contact."""
    found = []
    for label, values in _values(data, COUNTED, made):
        sets = [each[np.isfinite(each)] for each in values[0]]
        for number in np.unique(np.concatenate(sets)).tolist():
            found.append(Share(label, int(number), probability([each == number for each in sets])))
    return found


def _indices(
    spread: Spread, values: Array, uncertain: Sequence[Uncertain], line: Linear, *, leave_out: bool
) -> list[Index]:
    """Return the Sobol indices of a value by each number; not known where points are missing, unless left out."""
    known: NDArray[np.bool_] = np.asarray(np.isfinite(values).all(axis=0))
    sets = [values[:, k, known[k]] for k in range(values.shape[1])] if known.all() or leave_out else []
    blocks = sets or [np.full((len(values), 1), np.nan)]
    return [
        Index(spread.quantity, spread.label, each.path, first, total, line.shares.get(each.path, math.nan))
        for each, (first, total) in zip(uncertain, sobol_indices(blocks), strict=True)
    ]


def _write(folder: Path, found: Uncertainty, case: Case, command: str) -> None:
    draft = folder / f"uncertainty.json{DRAFT}"
    draft.write_text(json.dumps(found.to_dict(), indent=1) + "\n", encoding="utf-8")
    draft.replace(folder / "uncertainty.json")
    scene = case.scene()
    with contextlib.suppress(ImpactlabError):
        scene = at_means(case, found.uncertain).scene()
    write_page(folder, found, scene, of_case(case, command))
