"""Contacts that touch at rest under laws that divide by approach speed.

A wave that arrives moves the faces from rest, so that they meet at a speed that falls to zero as steps and elements are
refined, and the damping factor of such a law grows without a limit: up to that of its `slowest_approach`. Runs of
neighbouring fineness nearly agree, so that no estimate from them shows it.
"""

from __future__ import annotations

from impactlab.contact.power_law import AbstractHystereticLaw
from impactlab.errors import CaseError
from impactlab.exact.setup.contact_kinds import first_gap
from impactlab.plugins import kind_of
from impactlab.printing import at_least
from impactlab.refine.descriptions.contact_times import meeting_speed
from impactlab.scene.facts import changes
from impactlab.scene.method import Simulation, laws_of

MIN_SPEED_SHARE = 0.05  # of the speed at which the bodies meet: a larger slowest_approach decides at any fineness


def check(request: Simulation) -> None:
    """Raise `CaseError` for the first contact whose force has no limit.

    The limit is that of a refined description.
    """
    if changes(request.scene):
        return
    scene = request.scene
    for number, (contact, law) in enumerate(zip(scene.contacts, laws_of(*request), strict=True)):
        if not isinstance(law, AbstractHystereticLaw) or law.hysteresis() == 0.0:
            continue
        speeds = [scene.bodies[point.body].velocity for point in contact.faces]
        gap, slack = first_gap(scene, number)
        if abs(gap) > slack or speeds[0] != speeds[1]:
            continue
        least = MIN_SPEED_SHARE * meeting_speed(scene)
        if law.slowest_approach < least:
            raise CaseError(
                f"{contact.name}: the faces touch at rest, and law '{kind_of(law)}' divides its damping by the speed "
                f"at which they meet; this speed falls to its slowest_approach, {law.slowest_approach:g} m/s, as a "
                "description is refined, so that no tolerance can be kept",
                remedy=f"Give the contact a gap, a slowest_approach of {at_least(least, 2)} m/s or more, or a law "
                "without restitution; or give model, integrator and step of your own.",
                path=f"contacts.{number}.law",
            )
