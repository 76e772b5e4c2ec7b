"""The result of an uncertainty: estimates with their intervals, as text, tables and figures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from impactlab.errors import CaseError
from impactlab.printing import aligned, plain
from impactlab.sweeps.sampled import is_sampled
from impactlab.uncertainties.distributions import Uncertain
from impactlab.uncertainties.plots import plot_counts, plot_indices, plot_spreads
from impactlab.uncertainties.records import Estimate, Index, Share, Spread, least_certain
from impactlab.uncertainties.statistics import unseen

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

MAX_PRINTED = 12  # numbers of contacts that are printed
MAX_PLACES = 4  # decimals of a probability or an index

Rows = list[tuple[str, ...]]


@dataclass(frozen=True, repr=False, eq=False)
class Uncertainty:
    """How the quantities of a case with uncertain numbers spread."""

    case: str
    uncertain: tuple[Uncertain, ...]
    samples: int
    seed: int
    percents: tuple[float, ...]  # of the percentiles
    spreads: tuple[Spread, ...]
    shares: tuple[Share, ...]
    indices: tuple[Index, ...]
    warnings: tuple[str, ...]
    data: xarray.Dataset  # all points that were run; `block` 0 holds the samples

    def find(self, quantity: str, label: str = "") -> Spread:
        """Return the distribution of a quantity; ``label`` where the quantity has several values.

        Raises
        ------
        KeyError
            If there is no such quantity or label.
        """
        for each in self.spreads:
            if each.quantity == quantity and label in ("", each.label):
                return each
        raise KeyError(f"{quantity} {label}".strip())

    def probability(self, number: int, contact: str = "") -> Estimate:
        """Return the probability that a contact has a ``number`` of periods; name the contact where there are several.

        Raises
        ------
        KeyError
            If there is no such contact.
        """
        of = [each for each in self.shares if contact in ("", each.contact)]
        if not of:
            raise KeyError(contact)
        same = [each.probability for each in of if each.number == number and each.contact == of[0].contact]
        return same[0] if same else unseen(self._known(of[0].contact))

    def _known(self, contact: str) -> int:
        """Return the number of samples whose periods of contact are known."""
        values = self.data["contacts"].sel(contact=contact).values[self.data["block"].values == 0]
        return int(np.count_nonzero(np.isfinite(values)))

    def index(self, quantity: str, parameter: str, label: str = "") -> Index:
        """Return the Sobol indices of a quantity by an uncertain number.

        Raises
        ------
        KeyError
            If there are none.
        """
        for each in self.indices:
            if each.quantity == quantity and each.parameter == parameter and label in ("", each.label):
                return each
        raise KeyError(f"{quantity} {label} by {parameter}")

    def plot(self, quantity: str) -> Figure:
        """Return a figure of a quantity: histogram and distribution, or a band.

        The band is that of a sampled channel. Of ``contacts`` the probability of each number of periods.

        Raises
        ------
        CaseError
            If there is no such quantity, or it does not vary.
        """
        if quantity == "contacts" and self.shares:
            return plot_counts(self.shares)
        spreads = [each for each in self.spreads if each.quantity == quantity]
        if spreads and not any(each.varies for each in spreads):
            raise CaseError(f"{quantity} does not vary", remedy="Draw another quantity.")
        if not spreads:
            names = dict.fromkeys(["contacts", *(each.quantity for each in self.spreads)])
            raise CaseError(f"no quantity {quantity!r} to draw", remedy=f"It has {', '.join(names)}.")
        return plot_spreads(self.data, spreads, self.percents)

    @property
    def known_indices(self) -> list[Index]:
        """The Sobol indices that are known, without those of sampled channels."""
        return [each for each in self.indices if _is_printed(each) and not math.isnan(each.total.value)]

    def plot_indices(self) -> Figure:
        """Return a figure of the Sobol indices, with shares of the linear estimate.

        Intervals are drawn, too.

        Raises
        ------
        CaseError
            If there are none.
        """
        known = self.known_indices
        if not known:
            raise CaseError("no indices to draw", remedy="Vary two numbers or more; see the warnings.")
        return plot_indices(known)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a data frame with a row for each value of each quantity."""
        from pandas import DataFrame

        return DataFrame([self._row(each) for each in self.spreads])

    def _row(self, of: Spread) -> dict[str, Any]:
        row: dict[str, Any] = {"quantity": of.quantity, "label": of.label, "unit": of.unit, "samples": of.samples}
        named = {f"{percent:g} %": each for percent, each in zip(self.percents, of.percentiles, strict=True)}
        for name, each in {"mean": of.mean, "deviation": of.deviation, **named}.items():
            row |= {name: each.value, f"{name} lower": each.lower, f"{name} upper": each.upper}
        return row | {"linear mean": of.linear_mean, "linear deviation": of.linear_deviation}

    def to_dict(self) -> dict[str, Any]:
        """Return plain values: None in place of NaN and infinity."""
        names = ("path", "distribution", "unit", "mean", "deviation")
        vary = [
            dict(zip(names, (each.path, each.text, each.unit, each.mean, each.deviation), strict=True))
            for each in self.uncertain
        ]
        found: dict[str, Any] = {
            "schema_version": 1, "case": self.case, "samples": self.samples, "seed": self.seed, "vary": vary,
            "percents": self.percents, "quantities": self.spreads, "contacts": self.shares, "indices": self.indices,
            "warnings": self.warnings,
        }  # fmt: skip
        return {key: plain(value) for key, value in found.items()}

    @property
    def tables(self) -> list[Rows]:
        """The printed tables, each with its header first: quantities, probabilities, indices."""
        return [rows for rows in (self._spread_rows(), self._share_rows(), self._index_rows()) if len(rows) > 1]

    def __str__(self) -> str:
        counted = f"{self.samples} samples, seed {self.seed}; ± and intervals: 95 %"
        lines = [counted, *(f"{each.path} = {each.text}" for each in self.uncertain)]
        for rows in self.tables:
            lines += ["", *aligned(rows)]
        return "\n".join([*lines, *(f"\n{text}" for text in self.warnings)])

    def __repr__(self) -> str:
        return str(self)

    def _spread_rows(self) -> Rows:
        percents = [f"{percent:g} %" for percent in self.percents]
        rows: Rows = [("quantity", "unit", "mean", "deviation", *percents, "linear: mean", "deviation")]
        known = [each for each in self.spreads if each.samples] or self.spreads  # not those that no contact has
        for each in filter(_is_printed, known):
            numbers = [_with_error(of) for of in (each.mean, each.deviation, *each.percentiles)]
            linear = [_number(value, 4) for value in (each.linear_mean, each.linear_deviation)]
            rows.append((each.name, each.unit, *numbers, *linear))
        return rows

    def _share_rows(self) -> Rows:
        rows: Rows = [("periods of contact", "number", "probability", "95 % between")]
        shown = least_certain(self.shares)[:MAX_PRINTED]
        rows += [(each.contact, str(each.number), *_between(each.probability)) for each in sorted(shown)]
        return rows

    def _index_rows(self) -> Rows:
        rows: Rows = [("Sobol indices", "by", "first", "95 % between", "total", "95 % between", "linear")]
        for each in self.known_indices:
            linear = _between(Estimate(each.linear))[0]
            rows.append((each.name, each.parameter, *_between(each.first), *_between(each.total), linear))
        return rows


def _is_printed(of: Spread | Index) -> bool:
    """Return whether a value is in the printed tables, as values of sampled channels are not."""
    return not is_sampled(of.quantity)


def _number(value: float, digits: int) -> str:
    return "-" if math.isnan(value) else f"{float(f'{value:.{digits}g}'):.10g}"


def _digits(of: Estimate) -> int:
    """Return the significant digits of an estimate: one more than its error leaves."""
    if not (0.0 < of.error < math.inf and math.isfinite(of.value) and of.value):
        return 6
    return min(6, max(1, 2 + math.floor(math.log10(abs(of.value))) - math.floor(math.log10(of.error))))


def _with_error(of: Estimate) -> str:
    if math.isinf(of.error):
        known = "open"
        if math.isfinite(of.lower):
            known = f"above {_number(of.lower, 6)}"
        elif math.isfinite(of.upper):
            known = f"below {_number(of.upper, 6)}"
        return f"{_number(of.value, 6)} ({known})"
    return _number(of.value, _digits(of)) + (f" ± {float(f'{of.error:.1g}'):g}" if of.error > 0.0 else "")


def _between(of: Estimate) -> tuple[str, str]:
    if math.isnan(of.value):
        return "-", ""
    places = MAX_PLACES if not of.error > 0.0 else min(MAX_PLACES, max(1, 1 - math.floor(math.log10(of.error))))
    value, lower, upper = (f"{round(number, places) + 0.0:.{places}f}" for number in of)
    return value, "" if math.isnan(of.lower) else f"{lower} and {upper}"
