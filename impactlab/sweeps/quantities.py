"""Quantities of a sweep: functions of scene and history, registered by name."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from impactlab.casefile.text.words import listed, shown
from impactlab.errors import CaseError
from impactlab.history.base import AbstractHistory, ContactSpan
from impactlab.history.units import UNITS
from impactlab.metrics.body_motion import BodyMotion
from impactlab.metrics.collisions import collisions
from impactlab.plugins import QUANTITIES, Registry, describe
from impactlab.scene.problem import Scene
from impactlab.sweeps.sampled import Sampled, extreme_in

Values = Mapping[str, float] | float
Function = Callable[[Scene, AbstractHistory], Values]
F = TypeVar("F", bound=Function)

CONTACT, PAIR, BODY, WHOLE = "contact", "pair", "body", ""  # over which a quantity has values
LINK = "link"  # names of contacts: one name may stand for several, as the pieces of the soil along a pile
DEFAULT = ("contacts", "impulse", "peak_force", "restitution", "final_velocity", "energy_gain", "near_grazing")


def quantity(unit: str, over: str = WHOLE) -> Callable[[F], F]:
    """Return a decorator that states the unit and the labels of a quantity.

    Labels are contact, pair, body, link or ''.
    """

    def stated(function: F) -> F:
        function.unit, function.over = unit, over  # type: ignore[attr-defined]
        return function

    return stated


class WantedQuantity(NamedTuple):
    """A quantity of a sweep with its place in the result."""

    name: str
    unit: str
    description: str
    over: str
    labels: tuple[Any, ...]  # of the values: names of contacts, pairs, bodies or links, or times [s]; empty for one

    @property
    def places(self) -> tuple[Any, ...]:
        """Labels of the values at a point; one empty label for a single value.

        It is empty where the scene has none.
        """
        return self.labels if self.over else ("",)

    @property
    def size(self) -> int:
        """Number of values at a point."""
        return len(self.places)

    @property
    def lacking(self) -> str:
        """Reason why it has no place for a value, or an empty text."""
        return "" if self.places else absent_words(self.over)


def one_by_one(names: str | Sampled | Sequence[str | Sampled]) -> Sequence[str | Sampled]:
    """Return quantities as a sequence, also one alone or a comma-separated text.

    Raise `CaseError` without a quantity.
    """
    if isinstance(names, str):
        names = [each.strip() for each in names.split(",")]
    elif isinstance(names, Sampled):
        names = [names]
    remedy = "Name one; `impactlab plugins` lists them."
    if not isinstance(names, Iterable):
        raise CaseError(f"{shown(names)} is no quantity", remedy=remedy, path="quantities")
    every = [*names]
    if not every:
        raise CaseError("a sweep without a quantity", remedy=remedy)
    for each in every:
        if not isinstance(each, (str, Sampled)):
            raise CaseError(f"{shown(each)} is no quantity", remedy=remedy, path="quantities")
    return every


def quantities_of(
    scene: Scene, names: str | Sampled | Sequence[str | Sampled], registry: Registry, also: Sequence[Scene] = ()
) -> tuple[WantedQuantity, ...]:
    """Return quantities by name, with their labels in one or several scenes.

    Labels of the other scenes come last.

    Raises
    ------
    PluginError, CaseError
        If a quantity is not installed, is named twice, or has no unit.
    """
    found = []
    for name in one_by_one(names):
        if isinstance(name, Sampled):
            unit = UNITS.get(name.channel.partition(":")[0], "")
            times = tuple(float(time) for time in name.times)
            found.append(WantedQuantity(name.channel, unit, name.channel, "time", times))
            continue
        if (extreme := extreme_in(name)) is not None:
            unit = UNITS.get(extreme.channel.partition(":")[0], "")
            found.append(WantedQuantity(name, unit, extreme.description, WHOLE, ()))
            continue
        if name not in registry.names(QUANTITIES) and name.partition(":")[0] in UNITS:
            text = f"{shown(name)} is a channel over time, not a quantity with one value"
            channel = name if ":" in name else f"{name}:BODY@X"
            remedy = f'Give max({channel}) or min({channel}); in Python also il.Sampled("{channel}", times).'
            raise CaseError(text, remedy=remedy)
        function = registry.load(QUANTITIES, name)
        over = getattr(function, "over", WHOLE)
        over = over if over in (CONTACT, PAIR, BODY, LINK) else WHOLE
        labels = list(labels_of(scene, over))
        known = set(labels)
        for other in also:
            labels += [label for label in labels_of(other, over) if label not in known]
            known.update(labels)
        found.append(WantedQuantity(name, getattr(function, "unit", ""), describe(function), over, tuple(labels)))
    twice = [each.name for number, each in enumerate(found) if each.name in [other.name for other in found[:number]]]
    if twice:
        raise CaseError(f"{shown(twice[0])} is named twice", remedy="Name it once.")
    return tuple(found)


def absent_words(over: str) -> str:
    """Return the reason why a scene has no place for a quantity's values."""
    return "no body moves" if over == BODY else "the case has no contact"


def labels_of(scene: Scene, over: str) -> tuple[str, ...]:
    """Return the names over which a quantity has values in a scene."""
    if over == CONTACT:
        return tuple(contact.name for contact in scene.contacts)
    if over == PAIR:
        return tuple(dict.fromkeys(f"{contact.left.body}|{contact.right.body}" for contact in scene.contacts))
    if over == LINK:
        return tuple(dict.fromkeys(contact.shared_name for contact in scene.contacts))
    return tuple(name for name, body in scene.bodies.items() if body.moves) if over == BODY else ()


def values(history: AbstractHistory, wanted: Sequence[WantedQuantity], registry: Registry) -> list[list[float]]:
    """Return the values of each quantity of a run; NaN where a label has none.

    A contact whose name holds a place, as in ``rod.at(0.15)``, keeps the name that it has in the first scene.

    Raises
    ------
    CaseError
        If the run has a label that the quantities do not have.
    """
    scene, rows = history.scene, []
    for each in wanted:
        if each.over == "time":
            rows.append(np.asarray(history.evaluate(np.array(each.labels), each.name), float).tolist())
            continue
        if (extreme := extreme_in(each.name)) is not None:
            rows.append([extreme.value(history)])
            continue
        given: Values = registry.load(QUANTITIES, each.name)(scene, history)
        if isinstance(given, Mapping):
            rows.append([float(given.get(label, math.nan)) for label in _labels_there(scene, each)])
        else:
            rows.append([float(given)])
    return rows


def _labels_there(scene: Scene, each: WantedQuantity) -> Sequence[str]:
    """Return the labels of a quantity as a scene names them."""
    own, known = labels_of(scene, each.over), set(each.labels)
    lost = [label for label in own if label not in known]
    if not lost:
        return each.labels
    if len(own) != len(each.labels):
        text = f"no place for {each.name} of {shown(lost[0])}: the sweep has {listed(each.labels)}"
        raise CaseError(text, remedy="Sweep points of other bodies or contacts on their own.")
    return own


def _by_contact(
    scene: Scene, history: AbstractHistory, value: Callable[[list[ContactSpan]], float]
) -> dict[str, float]:
    return {contact.name: value(history.spans(contact.name)) for contact in scene.contacts}


@quantity("1", CONTACT)
def contacts(scene: Scene, history: AbstractHistory) -> dict[str, float]:
    """Number of periods of contact; of an impulse law the number of kicks."""
    return _by_contact(scene, history, lambda spans: sum(1 if span.kicks is None else span.kicks for span in spans))


@quantity("s", CONTACT)
def first_opening(scene: Scene, history: AbstractHistory) -> dict[str, float]:
    """Time of the first opening."""
    ended = [event for event in history.events if event.kind == "open"]
    first = {event.contact: event.time for event in reversed(ended)}
    return {contact.name: first.get(contact.name, math.nan) for contact in scene.contacts}


@quantity("s", CONTACT)
def time_in_contact(scene: Scene, history: AbstractHistory) -> dict[str, float]:
    """Time in contact, all periods together."""
    return _by_contact(
        scene, history, lambda spans: sum((span.until(history.duration) - span.start for span in spans), 0.0)
    )


@quantity("N s", CONTACT)
def impulse(scene: Scene, history: AbstractHistory) -> dict[str, float]:
    """Impulse of the contact force over the run; of links with its sign.

    The force of a link may pull.
    """
    return {contact.name: history.impulse_of(contact.name) for contact in scene.contacts}


@quantity("N", CONTACT)
def peak_force(scene: Scene, history: AbstractHistory) -> dict[str, float]:
    """Largest contact force; missing for laws of impulses, and for links (see largest_force)."""
    found = {}
    for name in (contact.name for contact in scene.contacts):
        spans = history.spans(name)
        peaks = [span.peak_force for span in spans if span.peak_force is not None]
        if peaks:
            found[name] = max(peaks)
        else:
            found[name] = math.nan if spans or history.method.laws[name].two_sided else 0.0
    return found


@quantity("N", LINK)
def largest_force(scene: Scene, history: AbstractHistory) -> dict[str, float]:
    """Largest force of each contact and link, summed over contacts of one name."""
    forces, by_name = peak_force(scene, history), dict[str, list[float]]()
    for contact in scene.contacts:
        by_name.setdefault(contact.shared_name, []).append(forces[contact.name])
    links = {link.name: link.largest for link in history.links}
    return {name: links[name] if name in links else _of_sum(history, name, own) for name, own in by_name.items()}


def _of_sum(history: AbstractHistory, name: str, peaks: list[float]) -> float:
    """Return the largest sum of the forces of contacts of one name.

    ``peaks`` are their peaks. It is NaN where one has none.
    """
    if len(peaks) == 1:
        return peaks[0]
    if not all(map(math.isfinite, peaks)):
        return math.nan
    return max(*peaks, history.largest(f"force:{name}"))


@quantity("N", LINK)
def smallest_force(_scene: Scene, history: AbstractHistory) -> dict[str, float]:
    """Smallest force of each link by name, negative where it pulled."""
    return {link.name: link.smallest for link in history.links}


@quantity("m", LINK)
def permanent_set(_scene: Scene, history: AbstractHistory) -> dict[str, float]:
    """Permanent set of each link by name, the largest of its pieces."""
    return {link.name: link.set for link in history.links if link.set is not None}


@quantity("1", PAIR)
def restitution(_scene: Scene, history: AbstractHistory) -> dict[str, float]:
    """Apparent restitution of the first collision of two bodies."""
    found = collisions(history, whole=False)
    return {each.bodies: math.nan if each.restitution is None else each.restitution for each in reversed(found)}


@quantity("m/s", BODY)
def final_velocity(scene: Scene, history: AbstractHistory) -> dict[str, float]:
    """Mean velocity at the end of the run: momentum over mass; not of mechanisms.

    Mechanisms move in a plane.
    """
    names, channels = labels_of(scene, BODY), frozenset(history.channels())
    motions = (BodyMotion(history, name, channels) for name in names if not scene.bodies[name].changes)
    found = {each.name: each.mean_velocity(history.duration) for each in motions}
    return {name: velocity for name, velocity in found.items() if velocity is not None}


@quantity("J", BODY)
def final_energy(scene: Scene, history: AbstractHistory) -> dict[str, float]:
    """Energy at the end of the run."""
    return {name: history.at_end(f"energy:{name}") for name, body in scene.bodies.items() if body.moves}


@quantity("N s", BODY)
def final_momentum(scene: Scene, history: AbstractHistory) -> dict[str, float]:
    """Momentum at the end of the run; not for mechanisms, whose momentum is a vector."""
    names = [name for name, body in scene.bodies.items() if body.moves and not body.changes]
    return {name: history.at_end(f"momentum:{name}") for name in names}


@quantity("J")
def contact_loss(_scene: Scene, history: AbstractHistory) -> float:
    """Energy lost in all contacts and links together over the run: damping, yielding, restitution."""
    return history.energy_ends().booked.get("contact", 0.0)


@quantity("1")
def energy_gain(_scene: Scene, history: AbstractHistory) -> float:
    """Largest gain of energy over the reference energy; zero of a perfect run."""
    return history.energy.largest_gain


@quantity("1")
def near_grazing(_scene: Scene, history: AbstractHistory) -> float:
    """1 where a small change may change the number of contacts, else 0."""
    return float(any(warned.code == "near_grazing" for warned in history.warnings))
