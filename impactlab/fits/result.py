"""Fitted parameters with their intervals, as records, text and files."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from impactlab import __version__
from impactlab.casefile import Case
from impactlab.errors import ImpactlabError
from impactlab.fits import draws
from impactlab.fits.identifiable import Product
from impactlab.fits.unknowns import Unknown, is_of_instrument
from impactlab.prefixes import prefixed_range
from impactlab.printing import aligned, counted, plain
from impactlab.startup.lazy import above
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

JACOBIAN, WIDENED, PROFILE, BOOTSTRAP = KINDS = ("jacobian", "widened", "profile", "bootstrap")
DIGITS, MIN_DIGITS, MAX_DIGITS = 6, 3, 12  # of a number with an infinite interval; of others at least and at most
METHODS = {
    JACOBIAN: "from the derivatives",
    WIDENED: "widened: correlated residuals",
    PROFILE: "profile likelihood",
    BOOTSTRAP: "bootstrap in blocks",
}


class Fitted(NamedTuple):
    """A fitted parameter in SI, with the ends of its 95 % interval.

    ``lower`` and ``upper`` come from the derivatives, widened where residuals correlate under white noise. All
    the requested intervals stand in ``intervals``, by jacobian, widened, profile and bootstrap. An infinite end,
    or zero of a positive parameter, is one that the signals do not determine.
    """

    path: str  # of the case; or ``shift of CHANNEL`` [s]
    value: float
    lower: float
    upper: float
    unit: str
    note: str = ""
    intervals: Mapping[str, tuple[float, float]] = {}

    def __repr__(self) -> str:
        value, between = in_words(self.value, self.lower, self.upper)
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        note = f"; {self.note}" if self.note else ""
        return f"<Fitted {self.path}: {value}{unit}, 95 % interval {between}{note}>"


class Curve(NamedTuple):
    """The profile of a parameter: rise of the loss with it fixed and all others fitted again."""

    path: str
    unit: str
    values: Array  # (points,), SI, increasing
    rise: Array  # (points,), of the sum of squares, over the variance of the residuals
    limit: float  # rise at the ends of the interval
    is_logarithmic: bool

    def __repr__(self) -> str:
        low, high, unit = self.values[0], self.values[-1], "" if self.unit in ("", "1") else f" {self.unit}"
        return f"<Curve of {self.path}: {len(self.values)} points, {low:.6g} to {high:.6g}{unit}>"


class Shown(NamedTuple):
    """A signal beside the channel of the fitted case, in SI."""

    channel: str
    time: Array  # (n,)
    measured: Array  # (n,)
    fitted: Array  # (n,)

    def __repr__(self) -> str:
        span = prefixed_range(float(self.time[0]), float(self.time[-1]), "s")
        return f"<Shown {self.channel!r}: {len(self.time)} samples at {span}, measured and fitted>"

    @property
    def identity(self) -> dict[str, Any]:
        """Channel, number and times of the samples, and a SHA-256 of times and values as little-endian doubles."""
        bits = np.concatenate((self.time, self.measured)).astype("<f8").tobytes()
        start, end = float(self.time[0]), float(self.time[-1])
        found = {"channel": self.channel, "samples": len(self.time), "start": start, "end": end}
        return {**found, "sha256": hashlib.sha256(bits).hexdigest()}


class Resamples(NamedTuple):
    """Settings of the bootstrap."""

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
    undetermined: tuple[str, ...] = ()  # directions that the signals do not determine, in words
    cases: tuple[Case, ...] = ()  # of several experiments, with the fitted values; `case` is the first
    determined: tuple[Product, ...] = ()  # products of those parameters that they determine
    signals: tuple[Shown, ...] = ()
    profiles: tuple[Curve, ...] = ()
    bootstrap: Resamples | None = None
    assumed: Mapping[str, str] = field(default_factory=dict)  # noise and loss of the fit, by their words
    unknowns: tuple[Unknown, ...] = ()  # of the parameters: how the covariance scales each
    reach: float = draws.NORMAL  # half of an interval over a standard deviation

    def __repr__(self) -> str:
        head = f"<Fit of '{self.case.label}' to {counted(len(self.signals), 'signal')}"
        return "\n  ".join([f"{head}, deviations {self.noise:.3g} of the given noise", *str(self).splitlines()]) + ">"

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

    def draws(self, count: int = draws.WRITTEN, seed: int = 0) -> dict[str, Array]:
        """Return random draws of the fitted numbers from their covariance, by path.

        They are points for `impactlab.sweep`. They are drawn from the normal distribution of the covariance, as wide as
        the intervals from the derivatives, and cut at the bounds. Numbers of instruments (gain, offset, shift) are left
        out.

        Parameters
        ----------
        count : int
            Draws; 95 % intervals of a prediction need some hundreds.
        seed : int
            Of the random numbers (PCG64).

        Raises
        ------
        ImpactlabError
            If the signals do not determine a number.
        """
        if unknown := self._unknown():
            raise ImpactlabError(
                f"the signals do not determine {' and '.join(unknown)}: there is no distribution to draw from",
                remedy="Fix the numbers that you know, or measure another channel; then fit again.",
            )
        wide = self.covariance * (self.reach / draws.NORMAL) ** 2
        return draws.drawn(self.unknowns, [each.value for each in self.parameters], wide, count, seed)

    def _unknown(self) -> list[str]:
        """Return the numbers of the case whose intervals are infinite on both sides."""
        of_case = [each for each in self.parameters if not is_of_instrument(each.path)]
        return [each.path for each in of_case if each.lower in (0.0, -math.inf) and each.upper == math.inf]

    def plot(self, name: str = "signals") -> Figure:
        """Return a figure: ``signals`` with their residuals, ``autocorrelation``, ``profiles`` or ``correlations``."""
        figure: Figure = above("fits.plots").plot(self, name)
        return figure

    def to_dict(self) -> dict[str, Any]:
        """Return plain values: None in place of NaN and infinity."""
        made = {
            "schema_version": 1,
            "impactlab_version": __version__,
            "case": self.case.label,
            "signals": [each.identity for each in self.signals],
            "parameters": self.parameters,
            "assumed": self.assumed,
            "noise": self.noise,
            "autocorrelation": self.autocorrelation,
            "warnings": self.warnings,
            "undetermined": self.undetermined,
            "determined": self.determined,
            "correlations": self.correlations.tolist(),
            "profiles": self.profiles,
            "bootstrap": self.bootstrap,
        }
        return {key: plain(value) for key, value in made.items()}

    def to_csv(self) -> str:
        """Return a table of parameters and determined products, in SI units.

        It has a row for each interval.
        """
        text = io.StringIO()
        rows = csv.writer(text, lineterminator="\n")
        rows.writerow(("parameter", "unit", "value", "interval", "lower", "upper", "note"))
        for each in self.parameters:
            for kind, ends in each.intervals.items():
                shown = [repr(end) if math.isfinite(end) else "" for end in ends]
                rows.writerow((each.path, each.unit, repr(each.value), kind, *shown, each.note))
        for product in self.determined:
            numbers = [repr(each) for each in (product.value, product.lower, product.upper)]
            rows.writerow((product.text, "SI", numbers[0], "determined", *numbers[1:], ""))
        return text.getvalue()

    def write(self, folder: str | Path, command: str = "") -> None:
        """Write the fitted case, its numbers and a page into a folder.

        ``fitted.yaml`` is a case that runs (of more experiments ``fitted-2.yaml`` ...), ``fit.json`` has all numbers,
        ``parameters.csv`` the table, ``draws.csv`` those of `draws` for ``impactlab sweep --points``, ``fit.html`` the
        signals, residuals, profiles and correlations, with ``command``, the one that repeats the fit.
        """
        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        for name, case in zip(case_files(self), self.cases or (self.case,), strict=True):
            (path / name).write_text(case.to_yaml(), encoding="utf-8")
        (path / "fit.json").write_text(json.dumps(self.to_dict(), indent=1), encoding="utf-8")
        (path / "parameters.csv").write_text(self.to_csv(), encoding="utf-8")
        if not self._unknown():
            units = {each.path: each.unit for each in self.parameters}
            draws.write_points(path / "draws.csv", self.draws(), units)
        above("fits.page").write_page(path, self, command)

    def __str__(self) -> str:
        rows = [("parameter", "value", "95 % interval", "")]
        for each in self.parameters:
            kinds = dict(each.intervals) or {JACOBIAN: (each.lower, each.upper)}
            if len({in_words(each.value, *ends)[1] for ends in kinds.values()}) == 1:  # all infinite
                kinds = {JACOBIAN: kinds[JACOBIAN]}
            for kind, ends in kinds.items():
                value, between = in_words(each.value, *ends)
                path, note = "", ""
                if kind == JACOBIAN:
                    path, note, value = each.path, each.note, f"{value} {each.unit}".removesuffix(" 1").rstrip()
                else:
                    value = ""  # stands in the first row
                method = METHODS[kind] if len(kinds) > 1 else ""
                rows.append((path, value, between, "; ".join(filter(None, (note, method)))))
        for product in self.determined:
            rows.append((product.text, *in_words(product.value, product.lower, product.upper), "in SI units"))
        return "\n".join([*aligned(rows), *self.warnings, *self.undetermined])


def case_files(fit: Fit) -> list[str]:
    """Return the names of the files of the fitted cases."""
    return ["fitted.yaml", *(f"fitted-{number}.yaml" for number in range(2, len(fit.cases) + 1))]


def in_words(value: float, lower: float, upper: float, size: float = 1.0) -> tuple[str, str]:
    """Return a value and its interval in words, divided by a size.

    Digits resolve a hundredth of half the interval, or better.
    """
    is_open = lower == 0.0 or math.isinf(lower), math.isinf(upper)  # 0 is the exponential of minus infinity
    half = min(
        (abs(end - value) for end, without in zip((lower, upper), is_open, strict=True) if not without), default=0.0
    )
    digits = DIGITS
    if value and half > 0.0:
        digits = min(max(math.ceil(math.log10(abs(value) / half)) + 3, MIN_DIGITS), MAX_DIGITS)
    shown, low, high = (f"{each / size:.{digits}g}" for each in (value, lower, upper))
    if all(is_open):
        return shown, "infinite"
    return shown, f"below {high}" if is_open[0] else f"above {low}" if is_open[1] else f"{low} to {high}"
