"""Scenes with their methods, for tests: a struck body, bodies in a row, or any bodies."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Literal

from impactlab.contact.base import AbstractContactLaw
from impactlab.integrators.base import AbstractScheme
from impactlab.models.base import AbstractRodModel
from impactlab.scene.bodies import Body, End, Mass, Rayleigh, Rod, Segment
from impactlab.scene.method import Method, Simulation, StepRule
from impactlab.scene.problem import Contact, Point, Scene

STEEL = Segment(length=0.3, area=9e-4, young=2.1e11, density=7900.0)
UNIT = Segment(1.0, 1.0, 1.0, 1.0)  # length, wave speed, impedance and mass 1 in SI, round trip 2 s
FREE, CLAMPED, UNDAMPED = End("free"), End("clamped"), Rayleigh()
TEN_STEPS = StepRule(points_per_period=10.0)


def simulation(
    name: str,
    bodies: Mapping[str, Body],
    contacts: Sequence[Contact],
    duration: float,
    integrator: AbstractScheme | None = None,
    step: StepRule = TEN_STEPS,
    events: Literal["dated", "located"] = "dated",
    *,
    model: AbstractRodModel | Mapping[str, AbstractRodModel] | None = None,
    law: AbstractContactLaw | Sequence[AbstractContactLaw] = (),
    **others: Any,
) -> Simulation:
    """Return a scene and its method.

    Parameters
    ----------
    name, bodies, contacts, duration
        As in `impactlab.scene.problem.Scene`.
    integrator, step, events
        As in `impactlab.scene.method.Method`.
    model : AbstractRodModel or mapping
        Of all rods and beams, or by name of the body.
    law : AbstractContactLaw or sequence
        Of all contacts, or of each.
    **others
        Other fields of the scene or the method: ``gravity``, ``round_trip``, ``tolerance`` ...
    """
    of_method = {field.name for field in dataclasses.fields(Method)} & set(others)
    elastic = [label for label, body in bodies.items() if body.elastic is not None]
    models = model if isinstance(model, Mapping) else {} if model is None else dict.fromkeys(elastic, model)
    given = law if isinstance(law, Sequence) else [law] * len(contacts)
    laws = {contact.name: each for contact, each in zip(contacts, given, strict=True)}
    method = Method(laws, models, integrator, step, events, **{field: others.pop(field) for field in of_method})
    return Simulation(Scene(name, bodies, tuple(contacts), duration, **others), method)


def face(body: Body, x: float = 0.0) -> Point:
    """Return the face of a body at x [m], named as ``rod.left`` at ends."""
    if body.elastic is None:
        return Point(body.name, 0.0, body.name)
    side = {0.0: ".left", body.length: ".right"}.get(x, "")
    return Point(body.name, x, body.name + side)


def touching(left: Body, right: Body, gap: float = 0.0) -> Contact:
    """Return the contact of the right end of a body with the next.

    The next body is met at its left end; an overlap is a gap below 0.
    """
    return Contact(face(left, left.length), face(right), gap, overlap_allowed=gap < 0.0)


def in_a_row(
    bodies: Sequence[Body],
    model: AbstractRodModel | Mapping[str, AbstractRodModel] | None = None,
    law: AbstractContactLaw | Sequence[AbstractContactLaw] = (),
    integrator: AbstractScheme | None = None,
    step: StepRule = TEN_STEPS,
    *,
    gaps: float | Sequence[float] = 0.0,
    round_trips: float = 3.0,
    **others: Any,
) -> Simulation:
    """Return bodies in a row, each of which may touch the next.

    ``gaps`` [m] of all contacts, or of each; the run lasts ``round_trips`` of the first rod or beam, unless a
    ``duration`` is given. Models, laws and other fields as in `simulation`.
    """
    distances = [gaps] * (len(bodies) - 1) if isinstance(gaps, float) else gaps
    contacts = [touching(*pair, gap) for pair, gap in zip(pairwise(bodies), distances, strict=True)]
    fields = _fields(bodies, round_trips, others)
    return simulation("row", contacts=contacts, integrator=integrator, step=step, model=model, law=law, **fields)


def _fields(bodies: Sequence[Body], round_trips: float, others: dict[str, Any]) -> dict[str, Any]:
    trip = next((body.elastic.round_trip for body in bodies if body.elastic is not None), math.nan)
    named = {body.name: body for body in bodies}
    return {"bodies": named, "duration": round_trips * trip, "round_trip": trip} | others


def struck(
    body: Body,
    model: AbstractRodModel | None,
    law: AbstractContactLaw,
    integrator: AbstractScheme | None = None,
    step: StepRule = TEN_STEPS,
    *,
    mass: float,
    x: float = 0.0,
    velocity: float = 1.0,
    gap: float = 0.0,
    round_trips: float = 3.0,
    **others: Any,
) -> Simulation:
    """Return a rigid hammer that strikes a rod or beam at x [m]; see `in_a_row`."""
    hammer = Mass("hammer", mass, velocity)
    contact = Contact(face(hammer), face(body, x), gap, overlap_allowed=gap < 0.0)
    fields = _fields((hammer, body), round_trips, others)
    return simulation("struck", contacts=(contact,), integrator=integrator, step=step, model=model, law=law, **fields)


def mass_on_rod(
    model: AbstractRodModel | None,
    law: AbstractContactLaw,
    integrator: AbstractScheme | None = None,
    step: StepRule = TEN_STEPS,
    *,
    segments: tuple[Segment, ...] = (STEEL,),
    left: End = FREE,
    right: End = CLAMPED,
    damping: Rayleigh = UNDAMPED,
    mass_ratio: float = 1.0,
    **others: Any,
) -> Simulation:
    """Return a mass that strikes the left end of a rod, of steel by default.

    ``mass_ratio`` is the mass over that of the rod. Velocity, gap and other fields as in `struck`.
    """
    rod = Rod("rod", segments, left, right, damping=damping)
    return struck(rod, model, law, integrator, step, mass=mass_ratio * rod.mass, **others)
