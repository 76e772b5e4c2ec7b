"""Fitted parameters with their intervals, as records, text and files."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from impactlab.casefile import Case
from impactlab.fits.seen import Product
from impactlab.types import Array

JACOBIAN, WIDENED, PROFILE, BOOTSTRAP = KINDS = ("jacobian", "widened", "profile", "bootstrap")
SAID = {
    JACOBIAN: "from the derivatives",
    WIDENED: "widened: correlated residuals",
    PROFILE: "profile likelihood",
    BOOTSTRAP: "bootstrap in blocks",
}


class Fitted(NamedTuple):
    """A fitted parameter in SI, with the ends of its 95 % interval.

    ``lower`` and ``upper`` come from the derivatives, widened where residuals correlate under white noise. All
    intervals that were asked for stand in ``intervals``, by jacobian, widened, profile and bootstrap. An infinite end,
    or zero of a positive parameter, is one that the signals do not determine.
    """

    path: str  # of the case; or ``shift of CHANNEL`` [s]
    value: float
    lower: float
    upper: float
    unit: str
    note: str = ""
    intervals: Mapping[str, tuple[float, float]] = {}


class Curve(NamedTuple):
    """The profile of a parameter: how far the loss rises where it is held and all others are fitted again."""

    path: str
    unit: str
    values: Array  # (points,), SI, increasing
    rise: Array  # (points,), of the sum of squares, over the variance of the residuals
    limit: float  # rise at the ends of the interval
    is_logarithmic: bool


class Shown(NamedTuple):
    """A signal beside the channel of the fitted case, in SI."""

    channel: str
    times: Array  # (n,)
    measured: Array  # (n,)
    fitted: Array  # (n,)


class Resamples(NamedTuple):
    """How the bootstrap was made."""

    resamples: int
    seed: int
    blocks: tuple[int, ...]  # samples of a block, of each signal


@dataclass(frozen=True)
class Fit:
    """A case fitted to signals."""

    case: Case  # with the fitted values
    parameters: tuple[Fitted, ...]
    covariance: Array  # (parameters, parameters), of their logarithms where they are positive
    residuals: tuple[Array, ...]  # of each signal, over its noise
    noise: float  # standard deviation of the residuals, in units of the given noise
    autocorrelation: float  # of neighbouring residuals
    warnings: tuple[str, ...] = ()
    undetermined: tuple[str, ...] = ()  # what the signals do not determine, in words
    cases: tuple[Case, ...] = ()  # of several experiments, with the fitted values; `case` is the first
    determined: tuple[Product, ...] = ()  # products of those parameters that they determine
    signals: tuple[Shown, ...] = ()
    profiles: tuple[Curve, ...] = ()
    bootstrap: Resamples | None = None

    def __getitem__(self, path: str) -> Fitted:
        for each in self.parameters:
            if each.path == path:
                return each
        raise KeyError(path)

    @property
    def correlations(self) -> Array:
        """Correlations of the parameters, shape of the covariance."""
        size = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(size, size))

    def to_dict(self) -> dict[str, Any]:
        """Return plain values: None in place of NaN and infinity."""
        made = {
            "schema_version": 1,
            "case": self.case.label,
            "parameters": [each._asdict() for each in self.parameters],
            "noise": self.noise,
            "autocorrelation": self.autocorrelation,
            "warnings": self.warnings,
            "undetermined": self.undetermined,
            "determined": [each._asdict() for each in self.determined],
            "correlations": self.correlations.tolist(),
            "profiles": [each._asdict() for each in self.profiles],
            "bootstrap": None if self.bootstrap is None else self.bootstrap._asdict(),
        }
        found: dict[str, Any] = _plain(made)
        return found

    def to_csv(self) -> str:
        """Return a table with a row for each interval of each parameter: in SI, ends that do not exist are empty."""
        text = io.StringIO()
        rows = csv.writer(text, lineterminator="\n")
        rows.writerow(("parameter", "unit", "value", "interval", "lower", "upper", "note"))
        for each in self.parameters:
            for kind, ends in each.intervals.items():
                shown = [repr(end) if math.isfinite(end) else "" for end in ends]
                rows.writerow((each.path, each.unit, repr(each.value), kind, *shown, each.note))
        return text.getvalue()

    def write(self, folder: str | Path) -> None:
        """Write the fitted case and its numbers into a folder.

        ``fitted.yaml`` is a case that runs (of more experiments ``fitted-2.yaml`` ...), ``fit.json`` has all numbers,
        ``parameters.csv`` the table.
        """
        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        for number, case in enumerate(self.cases or (self.case,), start=1):
            name = "fitted.yaml" if number == 1 else f"fitted-{number}.yaml"
            (path / name).write_text(case.to_yaml(), encoding="utf-8")
        (path / "fit.json").write_text(json.dumps(self.to_dict(), indent=1), encoding="utf-8")
        (path / "parameters.csv").write_text(self.to_csv(), encoding="utf-8")

    def __str__(self) -> str:
        rows = [("parameter", "value", "95 % interval", "")]
        for each in self.parameters:
            kinds = each.intervals or {JACOBIAN: (each.lower, each.upper)}
            for kind, (lower, upper) in kinds.items():
                named = (each.path, f"{each.value:.6g} {each.unit}".rstrip()) if kind == JACOBIAN else ("", "")
                words = [each.note] if kind == JACOBIAN else []
                words += [SAID[kind]] if len(kinds) > 1 else []
                rows.append((*named, between(lower, upper), "; ".join(filter(None, words))))
        for product in self.determined:
            rows.append((product.text, f"{product.value:.6g}", between(product.lower, product.upper), "in SI units"))
        widths = [max(len(row[k]) for row in rows) for k in range(4)]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
        return "\n".join([*lines, *self.warnings, *self.undetermined])


def between(lower: float, upper: float, size: float = 1.0) -> str:
    """Return an interval in words, its ends divided by a size: ``1.2 to 1.4``, ``above 1.2``, ``infinite``."""
    if math.isinf(upper):
        return f"above {lower / size:.6g}" if lower > 0.0 or -math.inf < lower < 0.0 else "infinite"
    return f"below {upper / size:.6g}" if math.isinf(lower) else f"{lower / size:.6g} to {upper / size:.6g}"


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
