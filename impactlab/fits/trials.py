"""Runs of a case at trial values of its unknowns.

Exact scenes are marched in a memory that is prepared once: a trial writes its numbers there, marches and reads its
signals in compiled code, in a tenth of a millisecond. Every other scene is run.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from impactlab import api
from impactlab.casefile import Case
from impactlab.derivatives.exact import sequence
from impactlab.errors import ImpactlabError
from impactlab.exact.results.history import ContinuousHistory
from impactlab.fits.model import ENDING, AbstractMeans, Means
from impactlab.fits.unknowns import Unknown
from impactlab.history.base import AbstractHistory
from impactlab.scene.recent import Recent
from impactlab.startup.lazy import lazy
from impactlab.sweeps.batch_numbers import NotServed, numbers_of
from impactlab.types import Array

if TYPE_CHECKING:
    from impactlab.exact.batch import single
else:  # compiled code, needed only for exact scenes
    single = lazy("impactlab.exact.batch.single")

MAX_BITS = 4  # unknowns whose bounds are all combined to check the case; of more there are as many corners
MAX_KEPT = 32  # runs
ROUNDING = 1e-14  # of a value that is read as it was written

Values = tuple[float, ...]
"""Values of the unknowns of a case, in SI."""


class Trials:
    """Runs of a case; ``channels`` are read of each."""

    def __init__(self, case: Case, unknowns: Sequence[Unknown], channels: Sequence[str]) -> None:
        self.case, self.channels = case, list(channels)
        self.paths = [each.path for each in unknowns]
        self._kept: Recent[Values, list[AbstractMeans] | None] = Recent(MAX_KEPT)

    def at(self, values: Values) -> Case:
        """Return the case with values of its unknowns; raises the errors of the case."""
        return self.case.with_settings(list(zip(self.paths, values, strict=True)), by="the fit")

    def means(self, values: Values) -> list[AbstractMeans] | None:
        """Return the signal of each channel from a run; None without such a run."""

        def made() -> list[AbstractMeans] | None:
            try:
                return self._run(values)
            except ImpactlabError:
                return None

        return self._kept.get_or_make(values, made)

    def closings(self, values: Values) -> tuple[str, ...] | None:
        """Return the contacts that close, in order; None where there is no such run."""
        try:
            with api.warnings_kept():
                history = api.run(self.at(values))
        except ImpactlabError:
            return None
        return tuple(contact for contact, kind in sequence(history) if kind == "close")

    def _run(self, values: Values) -> list[AbstractMeans] | None:
        with api.warnings_kept():
            history = api.run(self.at(values))
        return [Means(history, channel) for channel in self.channels]


class MarchedMeans(AbstractMeans):
    """Means of a channel of an exact scene.

    The scene is marched again where the memory holds another one.
    """

    def __init__(self, memory: single.Single, vector: Array, integral: single.Integral, ends: bool) -> None:
        self.memory, self.vector, self.integral = memory, vector, integral
        self.duration = memory.duration
        first, last = integral(np.array([0.0, self.duration]), False).tolist()
        self.rest, self.last = 0.0 if ends else first, last

    def sums(self, edges: Array) -> Array:
        self.memory.march(self.vector)
        return self.integral(edges, True)


def corners_of(unknowns: Sequence[Unknown]) -> Array:
    """Return corners of the bounds, (corners, unknowns): all, or some where there are many."""
    count = len(unknowns)
    sides = np.array(list(itertools.product((False, True), repeat=min(count, MAX_BITS))))
    if count > MAX_BITS:
        sides = np.random.default_rng(0).random((len(sides), count)) < 0.5
    return np.where(sides, [each.high for each in unknowns], [each.low for each in unknowns])


class MarchedTrials(Trials):
    """Runs of an exact scene whose numbers alone change."""

    def __init__(
        self, case: Case, unknowns: Sequence[Unknown], channels: Sequence[str], history: AbstractHistory
    ) -> None:
        super().__init__(case, unknowns, channels)
        base = numbers_of(case)
        if not isinstance(history, ContinuousHistory):
            raise NotServed("waves that are sampled as the run goes on")
        self.pattern, self.vector = base.pattern, base.vector
        self._entries = self._direct(unknowns)
        of_length = [int(first) for first in np.asarray(base.pattern.links)["segment"]]
        lengths = self._entries is None or any(entry in of_length for each in self._entries for entry in each)
        self.memory = single.Single(base, history)
        self.readers = []
        for channel in channels:
            reader = self.memory.reader(channel, lengths)
            if reader is None:
                raise NotServed(f"{channel} has no exact integral")
            self.readers.append((reader, channel.partition(":")[0] in ENDING))

    def _direct(self, unknowns: Sequence[Unknown]) -> list[list[int]] | None:
        """Return the entries of the vector that are the unknowns themselves.

        It is None where the case computes others from them. The case is built at corners of the bounds: where it
        refuses one, it is built at each trial.
        """
        corners = corners_of(unknowns)
        try:
            made = [numbers_of(self.at(tuple(corner))) for corner in corners.tolist()]
        except (ImpactlabError, NotServed):
            return None
        if not all(each.pattern.same_as(self.pattern) for each in made):
            return None
        vectors = np.array([each.vector for each in made])
        found: list[list[int]] = [[] for _ in unknowns]
        for entry in np.flatnonzero(np.any(vectors != self.vector, axis=0)).tolist():
            error = np.abs(vectors[:, entry, None] - corners) - ROUNDING * np.abs(corners)
            own = np.flatnonzero(np.all(error <= 0.0, axis=0))
            if len(own) != 1:
                return None
            found[int(own[0])].append(entry)
        return found

    def _vector(self, values: Values) -> Array:
        if self._entries is None:
            made = numbers_of(self.at(values))
            if not made.pattern.same_as(self.pattern):
                raise NotServed("bodies that are connected in another way")
            return made.vector
        vector = self.vector.copy()
        for entries, value in zip(self._entries, values, strict=True):
            vector[entries] = value
        return vector

    def closings(self, values: Values) -> tuple[str, ...] | None:
        try:
            marched = self.memory.march(self._vector(values))
        except (ImpactlabError, NotServed):
            marched = False
        return self.memory.closings if marched else super().closings(values)

    def _run(self, values: Values) -> list[AbstractMeans] | None:
        try:
            vector = self._vector(values)
        except NotServed:
            return super()._run(values)
        if not self.memory.march(vector):
            return super()._run(values)
        return [MarchedMeans(self.memory, vector, reader, ends) for reader, ends in self.readers]


def trials_of(case: Case, unknowns: Sequence[Unknown], channels: Sequence[str], history: AbstractHistory) -> Trials:
    """Return the quickest way to run a case at trial values.

    ``history`` is the run of the case itself.
    """
    try:
        return MarchedTrials(case, unknowns, channels, history)
    except NotServed:
        return Trials(case, unknowns, channels)
