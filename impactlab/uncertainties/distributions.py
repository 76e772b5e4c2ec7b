"""Distributions of uncertain numbers, read from texts, tables and the distributions of scipy."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from impactlab.casefile import Case
from impactlab.casefile.text.words import shown
from impactlab.casefile.values.units import to_si
from impactlab.errors import CaseError, ImpactlabError, closest
from impactlab.sweeps import axes, axis_texts, given_twice
from impactlab.types import Array

NAMES = {
    "normal": "normal(MEAN, DEVIATION)",
    "lognormal": "lognormal(MEAN, DEVIATION)",
    "uniform": "uniform(LOW, HIGH)",
    "table": "table(VALUE: WEIGHT, ...) or table(FILE.csv)",
}
WEIGHT = "weight"  # heading of the column of weights in a file
INNER = (0.31, 0.382, 0.618, 0.73)  # probabilities whose quantiles are hardly all whole in a continuous distribution
MAX_TEXT = 40  # characters of a distribution in a result


class Shape(Protocol):
    """A distribution in SI, with the methods of those of scipy."""

    def ppf(self, q: ArrayLike, /) -> Any:
        """Return quantiles."""

    def cdf(self, x: ArrayLike, /) -> Any:
        """Return probabilities of values up to some."""

    def mean(self) -> float:
        """Return the mean."""

    def std(self) -> float:
        """Return the standard deviation."""


class Table:
    """Values with weights, as a distribution."""

    def __init__(self, values: Array, weights: Array) -> None:
        order = np.argsort(values, kind="stable")
        self.values, self.weights = values[order], weights[order] / weights.sum()
        self.sums = np.cumsum(self.weights)
        self.sums[-1] = 1.0

    def ppf(self, q: ArrayLike, /) -> Any:
        """Return quantiles: the smallest value whose probability, with those below it, is at least q."""
        return self.values[np.searchsorted(self.sums, np.asarray(q))]

    def cdf(self, x: ArrayLike, /) -> Any:
        """Return probabilities of values up to some."""
        return np.concatenate(([0.0], self.sums))[np.searchsorted(self.values, np.asarray(x), side="right")]

    def mean(self) -> float:
        """Return the mean."""
        return float(self.weights @ self.values)

    def std(self) -> float:
        """Return the standard deviation."""
        return math.sqrt(float(self.weights @ (self.values - self.mean()) ** 2))


class Uncertain(NamedTuple):
    """An uncertain number of a case."""

    path: str
    text: str  # of its distribution, as it was given
    unit: str
    shape: Shape  # in SI
    mean: float
    deviation: float


def read_vary(text: str) -> tuple[str, str]:
    """Return path and distribution of an option of the command line, ``PATH=DISTRIBUTION``."""
    path, equals, given = (part.strip() for part in text.partition("="))
    if not equals or not path or not given:
        raise CaseError(
            f"--vary {shown(text)} is not PATH=DISTRIBUTION",
            remedy="Write --vary 'bodies.hammer.mass=normal(2 kg, 1 %)', for example.",
        )
    return path, given


def read_uncertain(case: Case, vary: Mapping[str, Any]) -> tuple[Uncertain, ...]:
    """Return uncertain numbers by path, checked by the case.

    Means, ends and values of tables are checked. A distribution is a text (see `NAMES`), one of `scipy.stats` with its
    parameters in SI, a sequence of values with equal weights, or a mapping of values to weights.

    Raises
    ------
    CaseError
        If there is no such path, or a distribution is wrong.
    """
    if not isinstance(vary, Mapping):
        raise CaseError(
            f"{shown(vary)} is not paths with distributions",
            remedy="Write {'bodies.hammer.mass': 'normal(2 kg, 1 %)'}; the numbers of a fit are drawn by its draws().",
        )
    if not vary:
        raise CaseError("no number is uncertain", remedy="Give a distribution, as normal(2 kg, 1 %), of a path.")
    given_twice.refuse_twice(case, list(vary))
    try:
        return tuple(_Reader(case, path).read(given) for path, given in vary.items())
    except ImpactlabError as error:
        for each in (error, *error.others):
            each.given_by = axes.BY_DRAWING if each.given_by == axes.BY else each.given_by
        raise


class _Reader:
    """Reads the distribution of one path."""

    def __init__(self, case: Case, path: str) -> None:
        self.case, self.path, self.unit = case, path, ""

    def read(self, given: Any) -> Uncertain:
        if isinstance(given, str):
            shape = self._of_text(given)
        elif all(hasattr(given, name) for name in ("ppf", "cdf", "mean", "std")):
            shape = given
            self._value(float(given.ppf(0.5)))
        elif isinstance(given, Mapping):
            shape = self._table(list(given), list(given.values()))
        elif isinstance(given, tuple) and len(given) == 2:
            a, b = map(str, given)
            raise self._wrong(
                f"a pair, ({a}, {b}), may be mean and deviation, two ends, or two values",
                f"Write 'normal({a}, {b})', 'uniform({a}, {b})' or the list [{a}, {b}].",
            )
        elif isinstance(given, Iterable):
            shape = self._table(list(given), None)
        else:
            raise self._wrong(f"{shown(given)} is not a distribution")
        if np.any(np.asarray(shape.ppf(INNER)) % 1.0) and axes.takes_whole(self.case, self.path):
            raise self._wrong(
                "a distribution with values that are not whole numbers, where the case takes only whole numbers",
                f"Write {NAMES['table']}.",
            )
        mean, deviation = float(shape.mean()), float(shape.std())
        if not (math.isfinite(mean) and math.isfinite(deviation)):
            raise self._wrong("a distribution without a finite mean and deviation")
        if deviation <= 0.0:
            raise self._wrong("a distribution without spread", f"Give the value by --set {self.path}=VALUE instead.")
        return Uncertain(self.path, _text(given), self.unit, shape, mean, deviation)

    def _of_text(self, text: str) -> Shape:
        from scipy import stats

        called = re.fullmatch(r"\s*([A-Za-z_]+)\s*\((.*)\)\s*", text, flags=re.DOTALL)
        if called is None or called[1] not in NAMES:
            near = closest(called[1], NAMES) if called else ""
            raise self._wrong(f"{shown(text)} is not a distribution.{near}")
        name, parts = called[1], [part.strip() for part in called[2].split(",")]
        if name == "table":
            return self._of_table(parts)
        if len(parts) != 2 or not all(parts):
            raise self._wrong(f"{shown(text)} does not have two numbers", f"Write {NAMES[name]}.")
        made: Shape
        first = self._value(parts[0])
        if name == "uniform":
            last = self._value(parts[1])
            if not first < last:
                raise self._wrong(f"a uniform distribution from {first:g} to {last:g}", "Give the lower end first.")
            made = stats.uniform(first, last - first)
        else:
            deviation = self._deviation(parts[1], first)
            if name == "normal":
                made = stats.norm(first, deviation)
            elif first > 0.0:
                spread = math.sqrt(math.log1p((deviation / first) ** 2))
                made = stats.lognorm(spread, scale=first * math.exp(-0.5 * spread**2))
            else:
                raise self._wrong(f"a lognormal distribution with the mean {first:g}", "Its mean is above zero.")
        return made

    def _value(self, given: Any) -> float:
        """Return a value of the path in SI, checked by the case."""
        axis = axes.read_axis(self.case, self.path, (_plain(given),))
        self.unit = axis.unit
        return self._number(axis.si[0], self.unit)

    def _number(self, given: Any, unit: str) -> float:
        """Return a number in SI, given in SI or as a text with its unit."""
        given = _plain(given)
        if isinstance(given, str):
            try:
                return to_si(given, unit)
            except ValueError as error:
                raise self._wrong(str(error)) from None
        if isinstance(given, bool) or not isinstance(given, (int, float)) or not math.isfinite(given):
            raise self._wrong(f"{shown(given)} is not a finite number")
        return float(given)

    def _deviation(self, text: str, mean: float) -> float:
        share = re.fullmatch(r"([^%]*)%", text)
        if share is None:
            found = self._number(text, self.unit)
        elif mean == 0.0:
            raise self._wrong(f"{shown(text)} of a mean of zero", f"Give the deviation in {self.unit or 'numbers'}.")
        else:
            found = 0.01 * abs(mean) * self._number(share[1].strip(), "1")
        if not found > 0.0:
            raise self._wrong(f"the standard deviation {shown(text)} is not above zero", "Give one above zero.")
        return found

    def _of_table(self, parts: Sequence[str]) -> Shape:
        if parts[0].lower().endswith(".csv"):
            if len(parts) > 2:
                raise self._wrong("a table of a file with more than one column", "Write table(FILE.csv, COLUMN).")
            return self._of_file(Path(parts[0]), parts[1] if len(parts) > 1 else "")
        pairs = [[side.strip() for side in part.split(":")] for part in parts]
        if not all(all(pair) for pair in pairs) or {len(pair) for pair in pairs} not in ({1}, {2}):
            raise self._wrong(f"{shown(', '.join(parts))} is not a valid table", f"Write {NAMES['table']}.")
        return self._table([pair[0] for pair in pairs], [pair[1] for pair in pairs] if len(pairs[0]) == 2 else None)

    def _of_file(self, file: Path, column: str) -> Shape:
        columns = axis_texts.read_points(file)
        weights = columns.pop(WEIGHT, None)
        names = [column] if column else list(columns)
        if len(names) != 1 or names[0] not in columns:
            raise CaseError(
                f"{'no column ' + shown(column) if column else f'{len(names)} columns'} in the table",
                path=self.path,
                file=str(file),
                remedy=f"Write table(FILE.csv, COLUMN). Columns: {', '.join(columns)}.",
            )
        return self._table(columns[names[0]], weights)

    def _table(self, given: Sequence[Any], weights: Sequence[Any] | None) -> Shape:
        if not given:
            raise self._wrong("a table without values", f"Write {NAMES['table']}.")
        self._value(given[0])
        values = [self._number(value, self.unit) for value in given]
        axes.read_axis(self.case, self.path, tuple(values))
        heavy = np.array([self._number(weight, "1") for weight in weights or [1.0] * len(values)])
        if np.any(heavy < 0.0) or not heavy.sum() > 0.0:
            raise self._wrong("a table with a negative weight, or none above zero", "Give weights above zero.")
        return Table(np.array(values), heavy)

    def _wrong(self, text: str, remedy: str = "") -> CaseError:
        return CaseError(text, path=self.path, remedy=remedy or f"Write {', '.join(NAMES.values())}.")


def _plain(value: Any) -> Any:
    """Return a text as the number that it may hold."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, str):
        try:
            return float(value)
        except ValueError:
            return value.strip()
    return value


def _text(given: Any) -> str:
    if isinstance(given, str):
        return given.strip()
    if hasattr(given, "dist"):
        options = [f"{value:g}" for value in given.args] + [f"{name}={value:g}" for name, value in given.kwds.items()]
        return f"{given.dist.name}({', '.join(options)})"
    if not isinstance(given, Iterable):
        return type(given).__name__
    parts = [f"{value}: {given[value]}" for value in given] if isinstance(given, Mapping) else list(map(str, given))
    text = f"table({', '.join(parts)})"
    if len(text) <= MAX_TEXT:
        return text
    return f"table of {len(parts)} {'weighted values' if isinstance(given, Mapping) else 'values'}"
