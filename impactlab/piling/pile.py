"""The pile of a scene: head under the hammer, toe, and soil."""

from __future__ import annotations

from typing import NamedTuple

from impactlab.contact.smith import Smith
from impactlab.errors import CaseError
from impactlab.scene.bodies import WaveBody
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Contact


class Pile(NamedTuple):
    """A pile, the contact on its head and the soil links on it."""

    body: WaveBody
    head: Contact
    soil: tuple[Contact, ...]  # in the order of the scene, the toe among them
    toe: Contact | None  # the soil link at the end away from the hammer
    from_left: bool  # whether the hammer strikes its left end

    @property
    def head_x(self) -> float:
        """Place of the head [m]."""
        return 0.0 if self.from_left else self.body.length

    @property
    def direction(self) -> float:
        """1 where the pile is driven along +x, -1 along -x."""
        return 1.0 if self.from_left else -1.0

    @property
    def impedance(self) -> float:
        """Impedance at the head [N s/m]."""
        return self.body.segment_at(self.head_x).impedance

    def depth(self, contact: Contact) -> float:
        """Return the distance of a contact on the pile from its head [m]."""
        return abs(self.place(contact) - self.head_x)

    def place(self, contact: Contact) -> float:
        """Return the place x of a contact on the pile [m]."""
        return contact.places_on(self.body.name)[0]


def pile_of(run: Simulation) -> Pile:
    """Return the pile of a scene: the rod that links with `smith` hold.

    Without such links it is the only rod.

    Raises
    ------
    CaseError
        If no rod, or more than one, can be the pile, or no body strikes one of its ends.
    """
    body, soil = soil_of(run)
    struck = [(contact, x) for contact in run.scene.contacts if (x := _struck_at(run, contact, body)) is not None]
    if len(struck) != 1:
        raise CaseError(
            f"{len(struck)} contacts could be the one on the head of the pile {body.name!r}; there must be one",
            remedy=f"Let one body, a ram or a helmet, meet {body.name}.left or {body.name}.right.",
            path="contacts",
        )
    head, x = struck[0]
    ends = [contact for contact in soil if _x_on(contact, body) == body.length - x]
    return Pile(body, head, soil, ends[0] if ends else None, x == 0.0)


def soil_of(run: Simulation) -> tuple[WaveBody, tuple[Contact, ...]]:
    """Return the rod held by links with the law `smith`, and these links.

    Without links it is the only rod.

    Raises
    ------
    CaseError
        If no rod, or more than one, can be the pile.
    """
    scene, laws = run.scene, run.method.laws
    soil = tuple(contact for contact in scene.contacts if isinstance(laws.get(contact.name), Smith))
    rods = {name: body.waves for name, body in scene.elastic.items() if body.waves is not None}
    held = {point.body for contact in soil for point in contact.faces if point.body in rods}
    names = sorted(held) or [*rods]
    if len(names) != 1:
        raise CaseError(
            f"one rod must be the pile, and {', '.join(map(repr, names)) or 'no rod'} could be",
            remedy="Give one rod all contacts with the law smith.",
            path="bodies",
        )
    return rods[names[0]], soil


def _x_on(contact: Contact, body: WaveBody) -> float | None:
    return next(iter(contact.places_on(body.name)), None)


def _struck_at(run: Simulation, contact: Contact, body: WaveBody) -> float | None:
    """Return the end x [m] of the pile that a striker meets, else None.

    A striker is a body other than soil or a wall.
    """
    x = _x_on(contact, body)
    others = [run.scene.bodies[point.body] for point in contact.faces if point.body != body.name]
    if x not in (0.0, body.length) or not others or isinstance(run.method.laws.get(contact.name), Smith):
        return None
    return x if others[0].moves else None
