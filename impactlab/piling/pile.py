"""The pile of a scene: head under a hammer or a force over time, toe, and soil."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from impactlab.contact.smith import Smith
from impactlab.errors import CaseError
from impactlab.scene.bodies import WaveBody
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Contact


class Pile(NamedTuple):
    """A pile of one rod or of several sections, the contact on its head and the soil links on it."""

    body: WaveBody  # the rod with the head
    head: Contact | None  # None where a force over time drives its end
    soil: tuple[Contact, ...]  # in the order of the scene, the toe among them
    toe: Contact | None  # the soil link at the end away from the hammer
    from_left: bool  # whether its left end is the head
    below: tuple[WaveBody, ...] = ()  # further sections, from the head downwards

    @property
    def sections(self) -> tuple[WaveBody, ...]:
        """The rods of the pile, from the head downwards."""
        return (self.body, *self.below)

    @property
    def named(self) -> str:
        """Names of its rods for messages."""
        return " and ".join(repr(each.name) for each in self.sections)

    @property
    def round_trip(self) -> float:
        """Time of a wave from the head to the toe and back [s]."""
        return sum(each.round_trip for each in self.sections)

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

    def place(self, contact: Contact) -> float:
        """Return the place x of a contact on the rod with the head [m]."""
        return contact.places_on(self.body.name)[0]


def pile_of(run: Simulation) -> Pile:
    """Return the pile of a scene: the rods that links with `smith` hold, joined end to end.

    Where no hammer strikes it, its head is the end under a force over time.

    Raises
    ------
    CaseError
        If no rod, or several that are not joined end to end, can be the pile, or neither a body strikes nor a force
        over time drives one of its ends.
    """
    rods, soil = _held(run)
    struck: list[tuple[Contact | None, WaveBody, float]] = [
        (contact, body, x)
        for contact in run.scene.contacts
        for body in rods.values()
        if (x := _struck_at(run, contact, body, rods)) is not None
    ]
    heads = struck or [(None, body, x) for body in rods.values() for x, _ in body.loads]
    if len(heads) != 1:
        name, *others = rods
        found = f"{len(struck)} contacts" if struck or not heads else f"{len(heads)} ends under a force over time"
        end = "a free end of its first section" if others else f"{name}.left or {name}.right"
        raise CaseError(
            f"{found} could be the one on the head of the pile {' and '.join(map(repr, rods))}; there must be one",
            remedy=f"Let one body, a ram or a helmet, meet {end}, or give that end the measured force over time.",
            path="contacts",
        )
    ((head, body, x),) = heads
    sections = _joined(run, rods, body, x)
    if len(sections) != len(rods):
        raise _no_single_pile(rods)
    last, at = sections[-1]
    ends = [contact for contact in soil if _x_on(contact, last) == at]
    return Pile(body, head, soil, ends[0] if ends else None, x == 0.0, tuple(each for each, _ in sections[1:]))


def struck_pile_of(run: Simulation, what: str) -> Pile:
    """Return the pile of a scene under a hammer; ``what`` needs one.

    Raises
    ------
    CaseError
        As `pile_of`, and if a force over time drives the pile.
    """
    pile = pile_of(run)
    if pile.head is None:
        raise CaseError(
            f"{what} needs a hammer, and a force over time drives the pile {pile.named}: in other soil, or at the next "
            "blow, the force of the same hammer is another one",
            remedy="Take a case with the ram and the cushions, and give its soil the fitted values.",
            path="contacts",
        )
    return pile


def soil_of(run: Simulation) -> tuple[WaveBody, tuple[Contact, ...]]:
    """Return the one rod held by links with the law `smith`, and these links.

    Raises
    ------
    CaseError
        If no rod, or more than one, can be the pile.
    """
    rods, soil = _held(run)
    if len(rods) != 1:
        raise _no_single_pile(rods)
    return next(iter(rods.values())), soil


def soil_laws(run: Simulation, pile: Pile) -> dict[str, Smith]:
    """Return the laws of the soil links of a pile by contact, in the order of the scene."""
    return {each.name: law for each in pile.soil if isinstance(law := run.method.laws[each.name], Smith)}


def _held(run: Simulation) -> tuple[dict[str, WaveBody], tuple[Contact, ...]]:
    """Return the rods that soil links hold, by name, and these links.

    Raise `CaseError` without links.
    """
    scene, laws = run.scene, run.method.laws
    soil = tuple(contact for contact in scene.contacts if isinstance(laws.get(contact.name), Smith))
    rods = {name: body.waves for name, body in scene.elastic.items() if body.waves is not None}
    held = {point.body for contact in soil for point in contact.faces if point.body in rods}
    if not held:
        raise CaseError(
            "no rod is a pile: the case has no soil, as contacts with the law smith",
            remedy="Add a contact of the law smith along the rod or at its toe, as `impactlab new FILE --like pile`.",
            path="contacts",
        )
    return {name: body for name, body in rods.items() if name in held}, soil


def _no_single_pile(rods: Mapping[str, WaveBody]) -> CaseError:
    return CaseError(
        f"one rod must be the pile, and {', '.join(map(repr, sorted(rods)))} could be",
        remedy="Give one rod all contacts with the law smith; sections joined without play are its segments. `blow`, "
        "`bearing_graph` and `match` also take several rods with such contacts under a hammer, each joined to the "
        "next end to end, as by a splice or at a crack.",
        path="bodies",
    )


def _joined(run: Simulation, rods: Mapping[str, WaveBody], body: WaveBody, x: float) -> list[tuple[WaveBody, float]]:
    """Return the sections from the one with the head at x on, each with the place of its lower end [m]."""
    found = [(body, body.length - x)]
    while True:
        upper, end = found[-1]
        for contact in run.scene.contacts:
            names = [point.body for point in contact.faces]
            other = next((rods[name] for name in names if name in rods and name != upper.name), None)
            if other is None or _x_on(contact, upper) != end or any(other is each for each, _ in found):
                continue
            start = _x_on(contact, other)
            if start in (0.0, other.length):
                found.append((other, other.length - start))
                break
        else:
            return found


def _x_on(contact: Contact, body: WaveBody) -> float | None:
    return next(iter(contact.places_on(body.name)), None)


def _struck_at(run: Simulation, contact: Contact, body: WaveBody, rods: Mapping[str, WaveBody]) -> float | None:
    """Return the end x [m] of a section that a striker meets, else None.

    A striker is a body other than soil, a wall or another section.
    """
    x = _x_on(contact, body)
    others = [run.scene.bodies[point.body] for point in contact.faces if point.body != body.name]
    if x not in (0.0, body.length) or not others or isinstance(run.method.laws.get(contact.name), Smith):
        return None
    return x if others[0].moves and others[0].name not in rods else None
