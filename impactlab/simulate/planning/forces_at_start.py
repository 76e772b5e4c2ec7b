"""Forces at t = 0 of faces that are pressed together or joined.

They are needed by schemes whose forces act at an instant. Leapfrog keeps the velocities of half a step before: under a
force F they are v - dt F/(2 m) there. Generalised-alpha keeps accelerations. A start without F would be an error of
first order in a scheme of second order.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from impactlab.contact.base import AbstractContactLaw
from impactlab.mechanisms.model import MechanismModel
from impactlab.scene.problem import Point, Scene
from impactlab.simulate.planning.model_shapes import checked_row
from impactlab.simulate.planning.preparation import BuiltBody
from impactlab.simulate.stepping.ports import fill_instant
from impactlab.types import Port, Reply, Start


class ClosedAtStart(NamedTuple):
    """A pair of overlapping or joined faces at t = 0.

    The force of its law follows from gap, rate and memory.
    """

    law: AbstractContactLaw
    start: Start
    gap: float  # m
    rate: float  # m/s

    def force(self, dt: float) -> float:
        """Return the force at this instant [N].

        It is zero where the law fails, as the first step then states.
        """
        port, reply = Port(), Reply()
        port.dt, port.in_contact = dt, 1.0
        port.parameters[: len(self.start.parameters)] = [*self.start.parameters]
        port.memory[: len(self.start.memory)] = [*self.start.memory]
        fill_instant(port, self.gap, self.rate)
        try:
            type(self.law).respond(port, reply)
        except Exception:  # noqa: BLE001 - a law may raise anything; it does so again in the first step
            return 0.0
        return 0.0 if reply.failed else float(reply.force)


def forces_at_start(
    scene: Scene,
    laws: Sequence[AbstractContactLaw],
    starts: Sequence[Start],
    built: Mapping[str, BuiltBody],
    dt: float,
    numbers: Iterable[int] | None = None,
) -> dict[int, float]:
    """Return the nonzero contact forces at t = 0 [N], by number.

    They are of all contacts by default.
    """
    found: dict[int, float] = {}
    known: dict[tuple[int, int, float, float], float] = {}  # contacts of a chain are mostly alike
    for number in range(len(scene.contacts)) if numbers is None else numbers:
        contact, law, start = scene.contacts[number], laws[number], starts[number]
        elastic = any(scene.bodies[point.body].elastic is not None for point in contact.faces)
        if not (law.smooth or law.acts_at_start):
            continue
        if contact.gap >= 0.0 and not elastic and not law.two_sided:  # rigid bodies begin without displacements
            continue
        (left_u, left_v), (right_u, right_v) = _motion(built, contact.left), _motion(built, contact.right)
        gap, rate = contact.gap + right_u - left_u, right_v - left_v
        key = id(law), id(start), gap, rate
        if key not in known:
            acts = gap < 0.0 or law.two_sided  # a link may pull, be deformed before, or have a dashpot that moves
            known[key] = ClosedAtStart(law, start, gap, rate).force(dt) if acts else 0.0
        if known[key] != 0.0:
            found[number] = known[key]
    return found


def _motion(built: Mapping[str, BuiltBody], point: Point) -> tuple[float, float]:
    """Return displacement [m] and velocity [m/s] of a face at t = 0."""
    body = built[point.body]
    system = body.system
    row = checked_row(point.body, body.model.row(point.x, "displacement"), system.load.size)
    moved = not isinstance(body.model, MechanismModel)  # the gaps at mechanisms are those of the first instant
    return float(row.dot(system.displacement)) if moved else 0.0, float(row.dot(system.velocity))
