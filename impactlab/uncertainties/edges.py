"""Edges of the contact sequence within the spread of an uncertain number, by bisection of runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from impactlab import api
from impactlab.casefile import Case
from impactlab.derivatives import Sensitivities
from impactlab.derivatives.exact import sequence
from impactlab.errors import ImpactlabError
from impactlab.numerics.bisection import bisected
from impactlab.uncertainties.distributions import Uncertain
from impactlab.uncertainties.linear import at_means

MIN_BEYOND = 1e-3  # probability beyond an edge that is worth a warning
EDGE_FACTOR = 1.25  # of the estimated distance to an edge: a run there confirms it
PLACES = 8  # at which runs look for an edge, on each side: a sequence that holds for a shorter way may be missed
HALVINGS = 11

Contacts = list[tuple[str, str]] | None
"""The contacts that close and open, in order; None where there is no run."""


class Edge(NamedTuple):
    """A value of an uncertain number, others at their means, that changes the sequence of contacts."""

    number: Uncertain
    value: float
    beyond: float  # probability of values beyond it

    @property
    def words(self) -> str:
        """The edge in words."""
        side = "below" if self.value < self.number.mean else "above"
        away = abs(self.value - self.number.mean) / self.number.deviation
        place = f"{self.value:.6g} {self.number.unit}".removesuffix(" 1").rstrip()
        return (
            f"{self.number.path}: the sequence of contacts changes {side} {place}, {away:.3g} standard deviations from "
            f"the mean; the probability of values beyond is {self.beyond:.3g}. Derivatives at the mean do not hold "
            "there: the linear estimate is wrong."
        )


def edges_within(case: Case, uncertain: Sequence[Uncertain], found: Sensitivities) -> list[Edge]:
    """Return the likely edges next to the mean on each side of each number.

    Values beyond such an edge are likely enough.
    """
    centre = at_means(case, uncertain)
    edges = []
    for number in uncertain:
        runs = _Runs(centre, number)
        row = next(row for row in found if row.parameter == number.path)
        for share, estimated in ((MIN_BEYOND, row.lower), (1.0 - MIN_BEYOND, row.upper)):
            end = float(number.shape.ppf(share))
            likely = number.mean + EDGE_FACTOR * (estimated - number.mean)
            places = np.linspace(number.mean, end, PLACES + 1)[1:].tolist()
            places += [likely] if abs(likely - number.mean) < abs(end - number.mean) else []
            places = [number.mean, *sorted(places, key=lambda place: abs(place - number.mean))]
            apart = next((k for k, place in enumerate(places) if place != number.mean and runs.differ(place)), 0)
            if apart:
                value = 0.5 * sum(bisected(runs.differ, places[apart - 1], places[apart], HALVINGS))
                below = float(number.shape.cdf(value))
                edges.append(Edge(number, value, below if value < number.mean else 1.0 - below))
    return edges


class _Runs:
    """Runs beside the means, which differ from the run at the means by one number."""

    def __init__(self, centre: Case, number: Uncertain) -> None:
        self.centre, self.path = centre, number.path
        self.base = self._sequence(number.mean)

    def differ(self, value: float) -> bool:
        """Return whether the run with a value has another sequence of contacts."""
        found = self._sequence(value)
        return found is not None and found != self.base

    def _sequence(self, value: float) -> Contacts:
        try:
            with api.warnings_kept():
                return sequence(api.run(self.centre.with_(self.path, value)))
        except ImpactlabError:
            return None
