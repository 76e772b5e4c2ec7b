"""Fields of bodies that are kept at some instants, as in a file, and those that follow from them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import ImpactlabError
from impactlab.history.arguments import places_on
from impactlab.history.base import FIELD_POINTS, AbstractHistory, Field
from impactlab.history.sampling import frame_times, places_in_file
from impactlab.scene.bodies import Body, ElasticBody
from impactlab.scene.problem import Scene
from impactlab.types import Array

KEPT = ("displacement", "velocity", "strain", "stress", "force", "bending_moment")  # as far as a body has them


class BodyFields(NamedTuple):
    """The fields of one body at some instants."""

    times: Array  # (n,) s
    x: Array  # (m,) m
    values: dict[str, Array]  # quantity -> (n, m)

    def field(self, body: Body, t: float, quantity: str, x: ArrayLike | None, slack: float) -> Field | None:
        """Return a quantity along a body at the instant t [s], which may differ by the ``slack`` [s]; None: not kept.

        Between the places kept it lies on lines.
        """
        near = np.flatnonzero(np.abs(self.times - t) <= slack)
        values = self._row(body, quantity, int(near[0])) if near.size else None
        if values is None or x is None:
            return None if values is None else Field(self.x, values)
        places = places_on(body, x)
        return Field(places, np.interp(places, self.x, values))

    def _row(self, body: Body, quantity: str, number: int) -> Array | None:
        """Return a quantity along a body at one of the instants, (m,), or None.

        Strain and force of rods may follow from the stress, stress and strain of beams from the bending moment.
        """
        if quantity in self.values:
            return np.asarray(self.values[quantity][number])
        read, times = body.quantities.get(quantity, ("", 1.0))
        if read != quantity and read in self.values:
            return np.asarray(times * self.values[read][number])
        if body.elastic is None or quantity not in ("strain", "force") or "stress" not in self.values:
            return None
        pieces = [body.elastic.segment_at(float(x)) for x in self.x]
        factor = [1.0 / piece.young if quantity == "strain" else piece.area for piece in pieces]
        return np.asarray(self.values["stress"][number] * np.array(factor))


def joined(windows: Sequence[BodyFields]) -> BodyFields:
    """Return the fields of one body in windows of time that follow one another."""
    values = {name: np.concatenate([window.values[name] for window in windows]) for name in windows[0].values}
    return BodyFields(np.concatenate([window.times for window in windows]), windows[0].x, values)


def body_fields(history: AbstractHistory) -> dict[str, BodyFields]:
    """Return the fields of each body at the frames of a page and at snapshots.

    Of many continuous rods they have fewer places (`places_along`).
    """
    fields, scene = {}, history.scene
    for name, body in scene.elastic.items():
        times, places = history.field_times(name), None
        if times is None:
            times = np.union1d(frame_times(history.duration), [t for t in scene.snapshots if t <= history.duration])
            places = places_along(scene, body)
        kept = fields_of(history, body, times, places)
        if kept is not None:
            fields[name] = kept
    return fields


def places_along(scene: Scene, body: ElasticBody) -> Array | None:
    """Return the places of kept fields along a body without a mesh [m]; None for those of a plain field."""
    count = places_in_file(sum(len(kept_quantities(each)) for each in scene.elastic.values()), FIELD_POINTS)
    return np.linspace(0.0, body.length, count) if count < FIELD_POINTS else None


def fields_of(history: AbstractHistory, body: ElasticBody, times: Array, places: Array | None) -> BodyFields | None:
    """Return the fields of a body at instants [s], (n,), and places [m], (m,); None where it has none."""
    values = {}
    x = np.zeros(0)
    for quantity in kept_quantities(body) if times.size else ():
        try:
            x, values[quantity] = history.fields_at(body.name, times, quantity, places)
        except ImpactlabError:  # a body with a quantity at its contacts and probes only
            continue
    return BodyFields(times, x, values) if values else None


def kept_quantities(body: ElasticBody) -> list[str]:
    """Return the quantities of a body that are kept.

    Stress gives force, and strain in a body that is not viscous.
    """
    names = {read: name for name, (read, _) in reversed(list(body.quantities.items()))}
    viscous = body.damping.stiffness > 0.0 or any(piece.viscosity for piece in body.segments)
    followed = {"force": "stress" in names, "strain": not viscous}
    return [names[read] for read in KEPT if read in names and not followed.get(read, False)]
