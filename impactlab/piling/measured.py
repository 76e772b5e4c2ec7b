"""A pile under a measured head force: the case without its hammer, and names of its soil's numbers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from impactlab.casefile import Case
from impactlab.casefile.blocks.repeat import expand
from impactlab.casefile.values.loads import folder_of, with_tables
from impactlab.contact.smith import Smith
from impactlab.errors import CaseError
from impactlab.history.base import AbstractHistory
from impactlab.measurement.inputs import row_of_numbers
from impactlab.piling.blow import Head
from impactlab.piling.blow import head_of as signals_at_head
from impactlab.piling.pile import Pile, pile_of, soil_of
from impactlab.scene.bodies import WaveBody
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Contact
from impactlab.types import Array

MIN_SAMPLES = 16
TOP = ("schema_version", "title", "source", "bodies", "contacts", "solve", "gravity")  # keys that are kept


class CaseUnderForce(NamedTuple):
    """A case of a pile without hammer, its head under a measured force."""

    case: Case
    body: str  # the rod with the head
    round_trip: float  # s, of a wave from the head to the toe and back
    direction: float  # 1 where it is driven along +x, -1 along -x
    velocity: str  # channel at its head
    blocks: dict[int, int]  # number of a contact block in the given case to that in this one


def checked(time: ArrayLike, force: ArrayLike, velocity: ArrayLike) -> tuple[Array, Array, Array]:
    """Return measured signals as arrays of one length; raise `CaseError` with a wrong sample."""
    given = {"time": time, "force": force, "velocity": velocity}
    found = {name: row_of_numbers(name, each) for name, each in given.items()}
    sizes = [each.size for each in found.values()]
    if any(each.ndim != 1 for each in found.values()) or len(set(sizes)) != 1:
        shapes = ", ".join(f"{name} {each.shape}" for name, each in found.items())
        raise CaseError(f"signals of different length: {shapes}", remedy="Give one sample of each for each time.")
    if sizes[0] < MIN_SAMPLES:
        text = f"{sizes[0]} samples of time, force and velocity. Allowed: {MIN_SAMPLES} or more"
        raise CaseError(text, remedy="Give the record of the whole blow.")
    for name, each in found.items():
        wrong = np.flatnonzero(~np.isfinite(each))
        if wrong.size:
            raise CaseError(f"{name} {wrong[0] + 1} is not a finite number", remedy="Leave that sample out.")
    falls = np.flatnonzero(np.diff(found["time"]) <= 0.0)
    if falls.size:
        before, late = found["time"][falls[0] : falls[0] + 2]
        text = f"time {falls[0] + 2}, {late:.9g} s, is not later than time {falls[0] + 1}, {before:.9g} s"
        raise CaseError(text, remedy="Give rising times, one for each sample.")
    return found["time"] - found["time"][0], found["force"], found["velocity"]


def written_out(case: Case, free: Iterable[str]) -> Case:
    """Return a case whose contacts each have a block of their own.

    It is the same case if it repeats no block.

    Raises
    ------
    CaseError
        If one of the free numbers is named by the number of a block, which is another one there.
    """
    if not case.origins:
        return case
    numbered = next((name for name in free if name.startswith("contacts.")), None)
    if numbered is not None:
        raise CaseError(
            f"{numbered!r} names a block by its number, in a case that makes blocks by repeat or chain",
            remedy="Give the contact a name, such as name: s{i} beside repeat, and write s1.capacity.",
            path=numbered,
        )
    with folder_of(case.file):
        return Case.from_dict(expand(with_tables(case.document.data)).data, case.name)


def driven_by(case: Case, time: Array, force: Array) -> CaseUnderForce:
    """Return the case with a measured head force [N] in place of the hammer.

    The force is positive in compression. The pile is at rest at the first sample. Bodies that no contact still joins to
    the pile are left out, and with them probes, methods and variants of the case.
    """
    run = case.simulation()
    body, from_left, head = head_of(run)
    round_trip = pile_of(run).round_trip if head is not None or body.loads else body.round_trip
    numbers = list(_blocks(case))
    gone = {number for number, contacts in enumerate(numbers) if head in contacts}
    kept = {body.name}
    for _ in numbers:  # bodies joined to the pile by the contacts left
        for number, contacts in enumerate(numbers):
            names = {point.body for each in contacts for point in each.faces}
            if number not in gone and names & {name for name in kept if run.scene.bodies[name].moves}:
                kept |= names
    blocks: dict[int, int] = {}
    for number, contacts in enumerate(numbers):
        if number not in gone and {contacts[0].left.body, contacts[0].right.body} <= kept:
            blocks[number] = len(blocks)
    data: dict[str, Any] = {key: value for key, value in case.document.data.items() if key in TOP}
    data["bodies"] = {name: block for name, block in data["bodies"].items() if name in kept}
    data["contacts"] = [data["contacts"][number] for number in blocks]
    direction, side = (1.0, "left") if from_left else (-1.0, "right")
    held = dict(data["bodies"][body.name].get("ends") or {})
    load: dict[str, Any] = {"force": {"t": time, "f": direction * force}}
    if isinstance(held.get(side), dict):  # a support that carries the force
        load = {key: value for key, value in held[side].items() if key != "force"} | load
    data["bodies"][body.name] = {**data["bodies"][body.name], "ends": {**held, side: load}}
    data["solve"] = {**data["solve"], "duration": float(time[-1])}
    x = 0.0 if from_left else body.length
    data["probes"] = [{"body": body.name, "at": x, "quantity": "velocity"}]
    made = Case.from_dict(data, f"{case.name}_head")
    return CaseUnderForce(made, body.name, round_trip, direction, f"velocity:{body.name}@{x:.6g}", blocks)


def head_of(run: Simulation) -> tuple[WaveBody, bool, Contact | None]:
    """Return the rod with the pile's head, whether the head is left, and the hammer's contact.

    The contact is None without a hammer. Without hammer the head is the end under a force over time; else the pile is
    one rod, and its head the end under a constant force or away from the soil at the toe.
    """
    try:
        pile: Pile = pile_of(run)
    except CaseError:
        body, soil = soil_of(run)
        ends = {0.0: body.left, body.length: body.right}
        loaded = [x for x, end in ends.items() if end.is_loaded]
        toes = {x for each in soil for x in each.places_on(body.name)} & {*ends}
        heads = loaded or [x for x in ends if toes and x not in toes]
        if len(heads) != 1:
            raise CaseError(
                f"the head of the pile {body.name!r} is not unique: no hammer meets it, {len(loaded)} ends are loaded "
                f"and {len(toes)} ends stand on soil",
                remedy=f"Load its head, as in ends: {{left: {{force: 1}}}}, or let a hammer meet {body.name}.left.",
                path=f"bodies.{body.name}",
            ) from None
        return body, heads[0] == 0.0, None
    return pile.body, pile.from_left, pile.head


def head_signals(history: AbstractHistory) -> Head:
    """Return force and velocity at the head of the pile of a run.

    It is driven by a hammer or by a force over time.

    Raises
    ------
    ImpactlabError
        If no pile or no head can be identified, or the velocity of a loaded head was not recorded.
    """
    return signals_at_head(history, pile_of(Simulation(history.scene, history.method)))


def _blocks(case: Case) -> Iterator[tuple[Contact, ...]]:
    """Yield the contacts of each block of a case: one, or all pieces."""
    contacts, at = case.scene().contacts, 0
    for block in case.checked.contacts:
        count = block.pieces or 1
        yield contacts[at : at + count]
        at += count


def soil_path(case: Case, name: str) -> tuple[int, str]:
    """Return contact block and law field of a number of the soil.

    It is named like ``toe.capacity``, or by a path of the case.
    """
    contact, _, field = name.rpartition(".")
    number = -1
    if contact.startswith("contacts.") and contact.endswith(".law"):
        digits = contact.removeprefix("contacts.").removesuffix(".law")
        number = int(digits) if digits.isdecimal() and int(digits) < len(case.checked.contacts) else -1
    else:
        found = [n for n, block in enumerate(case.checked.contacts) if block.name == contact]
        number = found[0] if found else -1
    names = [block.name for block in case.checked.contacts if block.name]
    laws = case.simulation().method.laws
    blocks = list(_blocks(case))
    if number < 0 or not isinstance(laws.get(blocks[number][0].name), Smith):
        raise CaseError(
            f"{name!r} does not name a number of a soil link. Named contacts: {', '.join(names) or 'none'}",
            remedy="Write the name of a contact with the law smith and one of its fields, as toe.capacity.",
            path=name,
        )
    if field not in ("capacity", "quake", "damping"):
        raise CaseError(
            f"{field!r} is not fitted to signals. Allowed: capacity, quake, damping",
            remedy="Leave it as the case has it.",
            path=name,
        )
    return number, field
