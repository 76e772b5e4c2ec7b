"""Uncertainty of a case: the spread of its quantities from samples of its numbers, run by a sweep."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from impactlab import derivatives
from impactlab.casefile import Case
from impactlab.casefile.case import expect_case
from impactlab.casefile.text.words import shown
from impactlab.errors import CaseError, ImpactlabError, closest
from impactlab.jobs.files import write_whole
from impactlab.measurement.inputs import in_si, listed
from impactlab.report.facts import joined_in
from impactlab.report.provenance import of_case
from impactlab.sweeps import Sampled, sweep
from impactlab.sweeps.run import kept_in
from impactlab.types import Progress
from impactlab.uncertainties.design import check_samples, design
from impactlab.uncertainties.distributions import read_uncertain
from impactlab.uncertainties.evaluation import COUNTED, evaluated
from impactlab.uncertainties.linear import at_means
from impactlab.uncertainties.page import write_page
from impactlab.uncertainties.result import Uncertainty

DEFAULT = derivatives.DEFAULT
PERCENTS = (5.0, 50.0, 95.0)
STOP, LEAVE_OUT = "stop", "leave_out"  # effect of failed points on the indices


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
    progress: Progress | None = None,
    command: str = "",
    repeat: str = "impactlab run case.yaml",
) -> Uncertainty:
    """Return how quantities of a case with uncertain numbers spread: percentiles, probabilities, Sobol indices.

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
    expect_case(case, "uncertainty")
    check_samples(samples, seed)
    percents = _percents(percentiles)
    if failed not in (STOP, LEAVE_OUT):
        text = f"{shown(failed)} is not a way to treat points without values.{closest(failed, (STOP, LEAVE_OUT))}"
        raise CaseError(text, path="--failed", remedy=f"Give {STOP} or {LEAVE_OUT}.")
    uncertain = read_uncertain(case, vary)
    made = design(uncertain, samples, seed, indices=indices)
    wanted = [*quantities, *([] if COUNTED in quantities else [COUNTED])]
    data = sweep(
        case, points=made.points, quantities=wanted, workers=workers, out=out, shard=shard, cluster=cluster,
        progress=progress, command=command, repeat=repeat,
    )  # fmt: skip
    blocks, sets, size = made.shape
    data = data.assign_coords(block=("point", np.repeat(np.arange(blocks), sets * size)))
    data = data.assign_coords(scrambling=("point", np.tile(np.repeat(np.arange(sets), size), blocks)))
    if shard is not None:
        there = np.count_nonzero(data["status"].values)
        words = f"{there:,} of {data.sizes['point']:,} points are there. A call without the shard gives the estimates."
        return Uncertainty(
            case=case.label,
            uncertain=uncertain,
            samples=samples,
            seed=seed,
            percents=percents,
            spreads=(),
            shares=(),
            indices=(),
            warnings=(words,),
            data=data,
        )
    found = evaluated(case, made, data, list(quantities), percents, leave_out=failed == LEAVE_OUT)
    if out is not None:
        with kept_in(Path(out)):
            _write(Path(out), found, case, command)
    return found


def _percents(given: Sequence[float]) -> tuple[float, ...]:
    path, remedy = "--percentiles", "Give numbers between 0 and 100, such as 5,50,95."
    try:
        percents = tuple(sorted({in_si("a percentile", percent, "1") for percent in listed(given)}))
    except ImpactlabError as error:
        raise CaseError(error.text, path=path, remedy=remedy) from None
    if not percents or not all(0.0 < percent < 100.0 for percent in percents):
        text = f"the percentiles {shown(', '.join(f'{percent:g}' for percent in percents))}"
        raise CaseError(text, path=path, remedy=remedy)
    return percents


def _write(folder: Path, found: Uncertainty, case: Case, command: str) -> None:
    write_whole(folder / "uncertainty.json", json.dumps(found.to_dict(), indent=1) + "\n")
    scene = case.scene()
    with contextlib.suppress(ImpactlabError):
        scene = at_means(case, found.uncertain).scene()
    write_page(folder, found, scene, of_case(case, command), joined_in(*case.simulation()))
