"""Scenes with beams for `benchmarks/choice.py`: supports, theories, contacts, and quantities that a tolerance is on."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz, HuntCrossley
from impactlab.scene import Beam, BeamSegment, Body, Contact, End, Mass, Point, Rayleigh, Wall
from impactlab.scene.method import Counted, Simulation, StepRule
from impactlab.testing.scenes import simulation

PLAIN = BeamSegment(length=0.3, area=1e-4, young=2.1e11, density=7850.0, inertia=1e-8 / 12.0)
SHEARED = dataclasses.replace(PLAIN, shear_stiffness=6.7e6, rotary_inertia=7850.0 * 1e-8 / 12.0)
FREE, CLAMPED, PINNED = End("free"), End("clamped"), End("pinned")
ALL: tuple[Counted, ...] = ("displacements", "impulses", "peak_forces")
STEPS = StepRule(dt=1e-6)  # replaced by every description


def struck(
    beam: Beam, x: float, law: AbstractContactLaw, duration: float, mass: float = 0.05, stop: float | None = None
) -> Simulation:
    """Return a ball that strikes a beam at x [m].

    With ``stop``, a wall is behind its right end at that gap [m].
    """
    bodies: dict[str, Body] = {"ball": Mass("ball", mass, 1.0), beam.name: beam}
    contacts = [Contact(Point("ball", 0.0, "ball"), Point(beam.name, x, "beam.at"), 0.0)]
    if stop is not None:
        bodies["wall"] = Wall("wall")
        contacts.append(Contact(Point(beam.name, beam.length, "beam.right"), Point("wall", 0.0, "wall"), stop))
    return simulation("beam", bodies, tuple(contacts), duration, None, STEPS, law=law)


def plain(left: End, right: End, *segments: BeamSegment, damping: Rayleigh = Rayleigh(), tension: float = 0.0) -> Beam:  # noqa: B008 - frozen
    """Return a beam without shear."""
    return Beam("beam", segments or (PLAIN,), left, right, damping=damping, tension=tension)


def sheared(left: End, right: End, length: float = 0.3) -> Beam:
    """Return a beam with shear and rotary inertia."""
    return Beam("beam", (dataclasses.replace(SHEARED, length=length),), left, right, theory="timoshenko")


def scenes() -> Iterator[tuple[str, Simulation, tuple[Counted, ...]]]:
    """Give label, scene and the quantities that count."""
    hertz, stiff, soft = Hertz(1e9), Hertz(1e11), Penalty(stiffness=1e5)
    yield "EB, pinned ends, Hertz in the middle", struck(plain(PINNED, PINNED), 0.15, hertz, 2e-3), ALL
    yield "EB, pinned ends, stiff Hertz off the middle", struck(plain(PINNED, PINNED), 0.1, stiff, 1e-3), ALL
    yield "EB, clamped ends, Hertz", struck(plain(CLAMPED, CLAMPED), 0.12, hertz, 1e-3), ALL
    yield "EB, cantilever, spring at the tip", struck(plain(CLAMPED, FREE), 0.3, soft, 5e-3), ALL
    yield "EB, cantilever, Hertz inside", struck(plain(CLAMPED, FREE), 0.2, hertz, 2e-3), ALL
    yield "EB, free, Hertz with losses", struck(plain(FREE, FREE), 0.15, HuntCrossley(1e9, restitution=0.6), 2e-3), ALL
    spring = End("spring", 1e6, rotational=50.0)
    yield "EB, on springs, Hertz", struck(plain(spring, spring), 0.15, hertz, 1e-3), ALL
    yield "EB, mass at the tip, Hertz", struck(plain(CLAMPED, End("mass", 0.05)), 0.3, hertz, 2e-3), ALL
    thin = dataclasses.replace(PLAIN, length=0.15)
    thick = dataclasses.replace(thin, area=2e-4, inertia=8e-8 / 12.0)
    yield "EB, two segments, Hertz", struck(plain(CLAMPED, PINNED, thin, thick), 0.15, hertz, 1e-3), ALL
    yield "EB, under tension, Hertz", struck(plain(PINNED, PINNED, tension=2e3), 0.15, hertz, 1e-3), ALL
    damped = plain(PINNED, PINNED, damping=Rayleigh(mass=100.0, stiffness=1e-7))
    yield "EB, damped, Hertz", struck(damped, 0.15, hertz, 1e-3), ALL
    yield "EB, cantilever on a stop, springs", struck(plain(CLAMPED, FREE), 0.2, Penalty(2e6), 3e-3, stop=1e-4), ALL
    yield "Timoshenko, pinned ends, Hertz", struck(sheared(PINNED, PINNED), 0.15, hertz, 1e-3), ALL
    yield "Timoshenko, short, stiff Hertz", struck(sheared(PINNED, PINNED, 0.06), 0.03, stiff, 1e-4), ALL
    yield "Timoshenko, cantilever, Hertz at the tip", struck(sheared(CLAMPED, FREE, 0.1), 0.1, hertz, 5e-4), ALL
    yield "Timoshenko, clamped ends, spring", struck(sheared(CLAMPED, CLAMPED), 0.15, Penalty(1e6), 1e-3), ALL
    yield "Timoshenko, free, hard", struck(sheared(FREE, FREE, 0.1), 0.05, AdditionDeletion(), 3e-5), ALL
    yield (
        "Timoshenko, infinite, hard",
        struck(sheared(End("infinite"), End("infinite")), 0.15, AdditionDeletion(), 5e-5),
        ALL,
    )
    middle = struck(plain(PINNED, PINNED), 0.15, hertz, 2e-3)
    for counted in ALL:
        yield f"EB, pinned ends, Hertz, {counted} alone", middle, (counted,)
    tip = struck(plain(CLAMPED, FREE), 0.3, soft, 5e-3)
    yield "EB, cantilever, spring, displacements alone", tip, ("displacements",)
