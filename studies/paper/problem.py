"""The paper's problem, built from its case file, and its runs.

The ledger and the figures share the runs. The case file is the one source of the problem's numbers; values varied by a
row or a figure are replaced there.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import impactlab as il
from impactlab import metrics, simulate
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.errors import StepError
from impactlab.exact.solve import solve
from impactlab.history import AbstractHistory, ContactSpan
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.modal import Modal
from impactlab.scene import Mass, Probe, Rod, Scene, Segment
from impactlab.scene.method import Simulation, StepRule
from impactlab.types import Array
from studies.pages import CASES

CASE = CASES / "axial_impact.yaml"
CONTACT = "hammer|rod.left"
FORCE, GAP = f"force:{CONTACT}", f"gap:{CONTACT}"
MASS, FACE, REACTION = "position:hammer", "displacement:rod@0", "stress:rod@0.3"
SPEED = "velocity:hammer"
NEWMARK = Newmark()
TEN_POINTS = StepRule(points_per_period=10)  # Eq. (24)
WAVE, PLAIN = WaveIdentification(residual=True), WaveIdentification(residual=False)
SNAPSHOTS = (1.551e-5, 3.49e-5, 8.0e-5)  # s: Figs 8 and 9 as captioned; Fig. 10 at a time after the first reflection


@functools.cache
def paper_scene() -> Simulation:
    """Return the scene of the paper over three round trips.

    It is as its case file gives it.
    """
    return il.load_case(CASE).simulation()


def rod_of(scene: Scene) -> Rod:
    """Return the rod of a scene."""
    rod = scene.bodies["rod"]
    assert isinstance(rod, Rod)
    return rod


SEGMENT: Segment = rod_of(paper_scene().scene).segments[0]
T: float = paper_scene().scene.round_trip  # s, 2 L/c
Z: float = SEGMENT.impedance  # N s/m
STRESS: float = SEGMENT.density * SEGMENT.wave_speed  # Pa, rho c v0 for v0 = 1 m/s


@dataclass(frozen=True)
class Method:
    """Method of a run: model, law, scheme and step."""

    model: AbstractRodModel
    law: AbstractContactLaw
    integrator: AbstractIntegrator = NEWMARK
    step: StepRule = TEN_POINTS
    events: Any = "dated"


def scene_of(method: Method | None = None, alpha: float = 1.0, round_trips: float = 3.0) -> Simulation:
    """Return the paper's scene with another method, mass ratio rho A L/M or duration."""
    base = paper_scene()
    rod, hammer = rod_of(base.scene), base.scene.bodies["hammer"]
    assert isinstance(hammer, Mass)
    probes = (*base.scene.probes, Probe("rod", 0.0, "velocity"), Probe("rod", 0.0, "displacement"))
    scene = base.but(
        bodies={"hammer": replace(hammer, mass=rod.mass / alpha), "rod": rod},
        duration=round_trips * T,
        probes=tuple(dict.fromkeys(probes)),
        snapshots=SNAPSHOTS,
    )
    if method is None:
        return scene
    return scene.but(
        model=method.model,
        law=method.law,
        integrator=method.integrator,
        step=method.step,
        events=method.events,
    )


@functools.cache
def exact(alpha: float = 1.0, round_trips: float = 3.0) -> AbstractHistory:
    """Return the exact history, solved from event to event."""
    return solve(*scene_of(None, alpha, round_trips))


@functools.cache
def computed(method: Method, alpha: float = 1.0, round_trips: float = 3.0) -> AbstractHistory:
    """Return the history of a method, also of a failed one.

    A run that more than doubles the energy is failed for it.
    """
    try:
        return simulate.run(*scene_of(method, alpha, round_trips))
    except StepError as error:
        if error.history is None:
            raise
        return error.history


def modal(elements: int | None, modes: int | None, law: AbstractContactLaw, **others: Any) -> Method:
    """Return a method with a modal rod."""
    return Method(Modal(elements, modes), law, **others)


def spans(history: AbstractHistory) -> tuple[ContactSpan, ...]:
    """Return the periods of contact."""
    return history.contacts


def end_of(span: ContactSpan, history: AbstractHistory) -> float:
    """Return when a period of contact ended, or the end of the run [s]."""
    return history.duration if span.end is None else span.end


def first_opening(history: AbstractHistory) -> float:
    """Return when the first impact is over [T].

    It is the end of the last contact that began before 1.8 T. Short interruptions of the first contact, and re-touches
    at its end, belong to it.
    """
    return max(end_of(span, history) for span in spans(history) if span.start < 1.8 * T) / T


def second_contact(history: AbstractHistory) -> tuple[float, float] | None:
    """Return start and end of the second contact [T]; None without one.

    They are first touch and last opening of the contacts between 1.8 and 2.6 T.
    """
    found = [span for span in spans(history) if 1.8 * T <= span.start < 2.6 * T]
    return (found[0].start / T, end_of(found[-1], history) / T) if found else None


def interruptions(history: AbstractHistory, until: float = 1.0) -> list[tuple[float, float]]:
    """Return the gaps between periods of contact, from and to [T].

    Those before the gaps began before ``until`` [T].
    """
    ends = [end_of(span, history) / T for span in spans(history)]
    starts = [span.start / T for span in spans(history)]
    return [(end, start) for end, start in zip(ends, starts[1:], strict=False) if end < until]


def total_impulse(history: AbstractHistory) -> float:
    """Return the impulse of all contacts [m v0]."""
    hammer = paper_scene().scene.bodies["hammer"]
    assert isinstance(hammer, Mass)
    return sum(span.impulse for span in spans(history)) / hammer.mass


def peak(history: AbstractHistory) -> float:
    """Return the largest contact stress [rho c v0]."""
    return max(span.peak_force or 0.0 for span in spans(history)) / Z


def at(history: AbstractHistory, channel: str, t: float) -> float:
    """Return a channel at one time given in T."""
    return float(history.evaluate(t * T, channel))


def error(history: AbstractHistory, channel: str, alpha: float = 1.0) -> float:
    """Return the relative L2 error of a channel over 0..3 T."""
    t = metrics.midpoints(history.duration)
    value = metrics.relative_l2(history.evaluate(t, channel), exact(alpha).evaluate(t, channel))
    assert value is not None
    return value


def exact_field(x: Array, t: float, quantity: str = "stress") -> Array:
    """Return the exact field at places x [m] and one time [s]."""
    field = exact().field("rod", t, quantity)
    return np.asarray(np.interp(x, field.x, field.values))


def event(history: AbstractHistory, number: int) -> float:
    """Return the time of an event [T]."""
    return history.events[number].time / T


def penetration(history: AbstractHistory) -> float:
    """Return the deepest penetration [v0 T]."""
    return -min(0.0, float(history.evaluate(metrics.midpoints(history.duration), GAP).min())) / T
