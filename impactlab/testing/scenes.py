"""Scenes with their methods, for tests: a mass on a rod, or any bodies with models and contacts with laws."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from impactlab.contact.base import AbstractContactLaw
from impactlab.integrators.base import AbstractScheme
from impactlab.models.base import AbstractRodModel
from impactlab.scene.bodies import Body, End, Mass, Rod, Segment
from impactlab.scene.method import Method, Simulation, StepRule
from impactlab.scene.problem import Contact, Point, Scene

STEEL = Segment(length=0.3, area=9e-4, young=2.1e11, density=7900.0)
FREE, CLAMPED = End("free"), End("clamped")
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


def mass_on_rod(
    model: AbstractRodModel,
    law: AbstractContactLaw,
    integrator: AbstractScheme | None = None,
    step: StepRule = TEN_STEPS,
    *,
    segments: tuple[Segment, ...] = (STEEL,),
    left: End = FREE,
    right: End = CLAMPED,
    mass_ratio: float = 1.0,
    velocity: float = 1.0,
    gap: float = 0.0,
    round_trips: float = 3.0,
    **others: Any,
) -> Simulation:
    """Return a mass that strikes the left end of a rod at rest, in steel unless other segments are given.

    ``mass_ratio`` is the mass over that of the rod, ``velocity`` in m/s, ``gap`` in m; the run lasts ``round_trips``
    unless a ``duration`` is given. Other fields of the scene or the method as in `simulation`.
    """
    rod = Rod("rod", segments, left, right)
    contact = Contact(Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left"), gap)
    fields = {"duration": round_trips * rod.round_trip, "round_trip": rod.round_trip} | others
    bodies: dict[str, Body] = {"hammer": Mass("hammer", mass_ratio * rod.mass, velocity), "rod": rod}
    return simulation("struck", bodies, (contact,), integrator=integrator, step=step, model=model, law=law, **fields)
