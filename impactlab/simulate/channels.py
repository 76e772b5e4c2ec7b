"""Recorded histories: channels read as stairs or as lines, forces with slopes inside steps, fields at snapshots."""

from __future__ import annotations

import itertools
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import ImpactlabError
from impactlab.history.base import AbstractHistory, Cost, Field, within_run
from impactlab.numerics.slopes import slopes
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene
from impactlab.simulate.stepping.preparation import BuiltBody
from impactlab.types import Array, Port, Quantity


class Channel(NamedTuple):
    """Values at times, stepped (each value holds since the time before it) or linear.

    Where the values of a stepped channel are means over steps with known middles, it is read with a slope inside each
    step (`slopes`): the stairs themselves are of the first order only.
    """

    times: Array
    values: Array
    stepped: bool
    middles: Array | None = None


class Probed(NamedTuple):
    """A channel of a quantity of one body at one place."""

    channel: str
    body: str
    x: float  # m
    quantity: Quantity
    factor: float  # of the quantity, in the channel


def probed(scene: Scene) -> Iterator[Probed]:
    """Give the channels of probes, of loaded ends and of rigid masses."""
    for probe in (*scene.probes, *scene.loaded_ends):
        yield Probed(probe.channel, probe.body, probe.x, *scene.bodies[probe.body].reading(probe.quantity))
    for name, body in scene.bodies.items():
        for own, quantity in body.own_channels:
            yield Probed(f"{own}:{name}", name, 0.0, quantity, 1.0)


OF_THE_RUN = ("assembly", "ports", "_record")  # fields that refer to the memory of a run


class AbstractRecordedHistory(AbstractHistory):
    """A history of recorded channels. To write one, fill ``recorded``, and supply `snapshots` and `motion`."""

    def __init__(
        self,
        scene: Scene,
        method: Method,
        built: Mapping[str, BuiltBody],
        ports: Sequence[Port],
        dt: float | None = None,
    ) -> None:
        self.scene, self.method, self.duration, self.dt = scene, method, scene.duration, dt
        self.events, self.contacts, self.warnings, self.cost = (), (), [], Cost()
        self.recorded: dict[str, Channel] = {}
        self.built, self.ports = built, ports
        self._slopes: dict[str, Array] = {}  # of forces that were read
        self._taken: tuple[Array, dict[tuple[int, str, bool], Array]] | None = None  # snapshots of a copy

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields of a copy, pickled or not: snapshots are read, and the memory of the run stays behind."""
        times = self._snapshots
        numbers = range(len(times))
        motions = {at: self._motion(*at) for at in itertools.product(numbers, self.built, (False, True))}
        return {key: value for key, value in vars(self).items() if key not in OF_THE_RUN} | {"_taken": (times, motions)}

    @property
    def _snapshots(self) -> Array:
        return self.snapshots() if self._taken is None else self._taken[0]

    def _motion(self, number: int, body: str, velocities: bool) -> Array:
        return (
            self.motion(number, body, velocities) if self._taken is None else self._taken[1][number, body, velocities]
        )

    @abstractmethod
    def snapshots(self) -> Array:
        """Return the times of the snapshots taken so far, shape (n,) [s]."""

    @abstractmethod
    def motion(self, number: int, body: str, velocities: bool) -> Array:
        """Return the displacements or velocities of a body's coordinates at a snapshot, shape (n_dof,)."""

    def channels(self) -> tuple[str, ...]:
        return tuple(self.recorded)

    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        if channel not in self.recorded:
            raise ImpactlabError(
                f"channel '{channel}' was not recorded; recorded: {', '.join(sorted(self.recorded))}",
                remedy="A quantity at another place needs a probe in the case.",
                path="probes",
            )
        times, values, stepped, middles = self.recorded[channel]
        t = within_run(t, self.duration)
        if not stepped:
            return np.asarray(np.interp(t, times, values))
        # A value holds on [time before, its own time): at a jump the value after it is given.
        step = np.minimum(np.searchsorted(times, t, side="right"), values.size - 1)
        if middles is None:
            return values[step]
        if channel not in self._slopes:  # the value at t = 0 belongs to no step
            self._slopes[channel] = np.append(0.0, slopes(middles[1:], values[1:]))
        mean = values[step]
        sloped = mean + self._slopes[channel][step] * (t - middles[step])
        return np.asarray(np.maximum(sloped, np.minimum(mean, 0.0)))  # beyond the last step a force that falls is zero

    def jumps(self, channel: str) -> Array:
        found = self.recorded[channel]
        return found.times if found.stepped else np.zeros(0)

    def field(self, body: str, t: float, quantity: str) -> Field:
        if body not in self.built:
            raise ImpactlabError(f"no body '{body}'; bodies: {', '.join(self.built)}")
        within_run(t, self.duration)
        times = self._snapshots
        near = np.flatnonzero(np.isclose(times, t, rtol=1e-12, atol=0.0))
        if near.size == 0:
            given = ", ".join(f"{time:.6g}" for time in times) or "none"
            raise ImpactlabError(
                f"no snapshot at t = {t:.6g} s; snapshots: {given}",
                remedy="Add the time to 'snapshots'.",
                path="snapshots",
            )
        read, factor = self.scene.bodies[body].reading(quantity)
        model = self.built[body].model
        x = model.grid()
        rows = np.array([factor * model.row(float(place), read) for place in x])
        return Field(x, np.asarray(rows @ self._motion(int(near[0]), body, read == "velocity")))
