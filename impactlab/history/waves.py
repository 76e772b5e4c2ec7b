"""The two travelling waves at a section of a rod: d'Alembert's solution read backwards.

In a rod of wave speed c and impedance Z any motion is a wave to the right of velocity R and one to the left of velocity
L: the velocity is R + L, the strain (R - L)/c, the force Z (R - L), both positive in compression. So velocity and
strain at one section give both waves; at a step, a gauge or an end they separate arriving from leaving waves.
"""

from __future__ import annotations

import numbers
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from impactlab.errors import CaseError, ImpactlabError, closest
from impactlab.scene.bodies import Body, WaveBody
from impactlab.scene.facts import SAME_PLACE
from impactlab.scene.problem import Scene
from impactlab.types import Array


class Waves(NamedTuple):
    """The two waves at a section; their sum is the quantity itself."""

    body: str
    x: float  # m
    quantity: str
    time: Array  # (n,) s
    to_right: Array  # (n,) SI
    to_left: Array  # (n,) SI

    @classmethod
    def of(cls, body: Body, x: float, quantity: str, time: Array, right: Array, left: Array) -> Waves:
        """Return the waves in a quantity, from the velocities that they carry [m/s]."""
        read, factor = body.reading(quantity)
        if read == "displacement" or body.waves is None:
            raise CaseError(
                f"the waves of '{body.name}' carry no {quantity}.{closest(quantity, carried(body))}",
                remedy=f"They carry: {', '.join(carried(body))}.",
            )
        if read == "velocity":
            return cls(body.name, x, quantity, time, factor * right, factor * left)
        factor *= body.waves.segment_at(x).per_velocity(read)
        return cls(body.name, x, quantity, time, factor * right, -factor * left)

    @property
    def total(self) -> Array:
        """The quantity at the section, shape (n,)."""
        return self.to_right + self.to_left


def carried(body: Body) -> list[str]:
    """Return the quantities of a body that waves carry."""
    return [name for name, (read, _) in body.quantities.items() if read != "displacement"]


def wave_body(scene: Scene, name: str, x: float) -> WaveBody:
    """Return a rod or shaft that has a section at x [m].

    Raises
    ------
    ImpactlabError
        If the body is neither, or x lies outside it.
    """
    if not isinstance(name, str) or name not in scene.bodies:
        raise ImpactlabError(f"no body '{name}'; bodies: {', '.join(scene.bodies)}", remedy="Name one of these.")
    body = scene.bodies[name].waves
    if body is None:
        kind = scene.bodies[name].kind
        raise ImpactlabError(
            f"'{name}' is a {kind}, and the two waves are those of rods and shafts",
            remedy="Waves of a beam change their shape on the way; use history.field."
            if kind == "beam"
            else "Name a rod or a shaft.",
        )
    if not isinstance(x, numbers.Real):
        raise ImpactlabError(f"{str(x)[:60]!r} is not a place", remedy="Give x from the left end of the body, in m.")
    if not -SAME_PLACE * body.length <= x <= (1.0 + SAME_PLACE) * body.length:
        raise ImpactlabError(
            f"{x:.12g} m lies outside '{name}', 0 to {body.length:.12g} m",
            remedy="Give x from the left end of the body.",
            path=f"bodies.{name}",
        )
    return body


def separated(
    scene: Scene, name: str, x: float, channels: Sequence[str], evaluate: Callable[[str], Array]
) -> tuple[Array, Array]:
    """Return the velocities [m/s] of both waves at x [m], from recorded channels.

    Raises
    ------
    ImpactlabError
        If the body has no such waves or a channel is missing.
    """
    body = wave_body(scene, name, x)
    known: dict[str, Array] = {}  # by the quantity of the model
    for quantity, (read, factor) in body.quantities.items():
        channel = f"{quantity}:{name}@{x:.6g}"
        if read != "displacement" and read not in known and channel in channels:
            known[read] = evaluate(channel) / factor
    loads = [quantity for quantity in known if quantity != "velocity"]
    touching = _contacts_at(scene, body, x)
    if not loads and touching:
        known["force"] = np.asarray(sum(evaluate(f"force:{contact}") for contact in touching))
        loads = ["force"]
    if "velocity" not in known or not loads:
        probes = " and ".join(f"{{body: {name}, at: {x:.6g}, quantity: {each}}}" for each in _wanted(body))
        raise ImpactlabError(
            f"the waves at {x:.6g} m of '{name}' need its velocity and its strain, stress or force there; recorded: "
            f"{', '.join(known) or 'neither'}",
            remedy=f"Add the probes {probes}.",
            path="probes",
        )
    apart = known[loads[0]] / body.segment_at(x).per_velocity(loads[0])
    return 0.5 * (known["velocity"] + apart), 0.5 * (known["velocity"] - apart)


def _contacts_at(scene: Scene, body: WaveBody, x: float) -> list[str]:
    """Return contacts on an end without support or load: their forces are the rod's there."""
    slack = SAME_PLACE * body.length
    if not any(abs(place - x) <= slack and end.kind == "free" and not end.is_loaded for place, end in body.ends):
        return []
    return [
        contact.name
        for contact in scene.contacts
        if any(point.body == body.name and abs(point.x - x) <= slack for point in contact.faces)
    ]


def _wanted(body: WaveBody) -> list[str]:
    """Return the names of a velocity and of a load among its quantities."""
    names = {read: name for name, (read, _) in reversed(list(body.quantities.items()))}
    return [names["velocity"], names.get("strain", names["force"])]
