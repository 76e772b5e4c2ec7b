"""Whether a method can resolve a contact at all: its own times against those of the contact, before any error shows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from impactlab.history.base import AbstractHistory, Warned
from impactlab.scene.facts import impedance_of, striker_of
from impactlab.scene.method import Method, is_relative, stiffness_at, stiffness_of
from impactlab.scene.problem import Contact, Scene
from impactlab.simulate.stepping.preparation import BuiltBody

COARSE = 0.25  # of a contact's time: a position is then known to about a quarter of what the contact moves
SOFT = 0.05  # of the bodies' own compliance: displacements then answer a force by 5 % more than they should
LOOKS = 2001  # at the gap of a run
LOADED = 0.01  # of the energy, a tenth of its speeds: from here on what an initial overlap holds is worth resolving


def unresolved(history: AbstractHistory, built: Mapping[str, BuiltBody], dt: float) -> Iterator[Warned]:
    """Give the warnings of contacts that happened and that the method cannot resolve.

    Parameters
    ----------
    history : AbstractHistory
        The run, with its scene and method.
    built : mapping
        Bodies in their coordinates.
    dt : float
        Step [s]; 0 where it is chosen by an error estimate.
    """
    touched = {event.contact for event in history.events}
    for contact in history.scene.contacts:
        if contact.name in touched:
            yield from _too_coarse(history, built, contact, dt)
            yield from _too_soft(history.scene, history.method, contact)


def apart(scene: Scene, built: Mapping[str, BuiltBody], contact: Contact, dt: float) -> float:
    """Return the shortest time that a method tells apart at a contact [s]: its step, or half its shortest period."""
    times = [dt]
    for point in (contact.left, contact.right):
        if scene.bodies[point.body].waves is not None and built[point.body].system.highest_frequency > 0.0:
            times.append(math.pi / built[point.body].system.highest_frequency)
    return max(times)


def _too_coarse(
    history: AbstractHistory, built: Mapping[str, BuiltBody], contact: Contact, dt: float
) -> Iterator[Warned]:
    scene, stiffness = history.scene, _stiffness(history, contact)
    impedance, mass = impedance_of(scene, contact), striker_of(scene, contact)
    if not stiffness:
        return
    # A mass m on a rod of impedance Z loses its speed in m/Z; a spring k between them lets both swing with sqrt(m/k).
    time = max(mass / impedance, math.sqrt(mass / stiffness)) if mass < math.inf else math.inf
    words = "the speed of what strikes"
    if contact.gap < 0.0 and 0.0 < stiffness < math.inf:
        at_start = float(history.energy.stored[0])
        if at_start > LOADED * float(history.energy.total[0]):
            # What is pressed together at the start relaxes as fast as the spring lets it.
            time = min(impedance / stiffness, math.sqrt(mass / stiffness))
            words = "the overlap at the start"
    if scene.duration < time:
        time, words = scene.duration, "all that happens in this run"
    tells = apart(scene, built, contact, dt)
    if tells > COARSE * time > 0.0:
        text = (
            f"{contact.name}: {words} changes within {time:.3g} s, and this method tells no less than {tells:.3g} s "
            "apart; give more elements or modes, and a smaller step"
        )
        yield Warned("coarse_contact", text)


def _stiffness(history: AbstractHistory, contact: Contact) -> float | None:
    """Return the stiffness of a contact [N/m]; of a law that stiffens, that at its deepest overlap in the run."""
    known = stiffness_of(history.scene, history.method, contact)
    if known is not None:
        return known
    gap = history.evaluate(np.linspace(0.0, history.duration, LOOKS), f"gap:{contact.name}")
    return stiffness_at(history.scene, history.method, contact, max(0.0, -contact.gap, -float(np.min(gap))))


def _too_soft(scene: Scene, method: Method, contact: Contact) -> Iterator[Warned]:
    """Warn of a spring that stands for a hard contact, its stiffness taken from a mesh, and gives way like a body."""
    stiffness = stiffness_of(scene, method, contact)
    if stiffness is None or not is_relative(method.laws[contact.name]):
        return
    pliancy = 0.0
    for point in (contact.left, contact.right):
        pliancy += scene.bodies[point.body].static_compliance
    if pliancy > 0.0 and 1.0 / stiffness > SOFT * pliancy * (1.0 + 1e-9):
        text = (
            f"{contact.name}: the spring of {stiffness:.3g} N/m gives way by {100.0 / (stiffness * pliancy):.2g} % of "
            "what the rods do; give a larger relative stiffness, or more elements"
        )
        yield Warned("soft_contact", text)
