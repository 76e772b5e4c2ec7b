"""Times at which the first wave can reach each contact of a scene."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence

from impactlab.models.base import AbstractRodModel
from impactlab.scene.bodies import Body
from impactlab.scene.problem import Contact, Point, Scene

Models = Mapping[str, AbstractRodModel]  # by name of the body


def first_arrivals(scene: Scene, models: Models) -> dict[str, float]:
    """Return the earliest time [s] at which a wave can reach each contact.

    Faces that rest on each other wait for a wave from a contact that moves, from a force on an end or from an initial
    displacement. Waves travel no faster than sqrt(E/rho); through a rigid body, a beam without shear or a rod that is
    damped they take no time. A contact in the way passes them on without delay.
    """
    arrival = {contact.name: 0.0 if _moves(scene, contact) else math.inf for contact in scene.contacts}
    if not any(arrival.values()):
        return arrival
    points = [(contact.name, point) for contact in scene.contacts for point in contact.faces]
    for name, point in points:
        arrival[name] = min(arrival[name], _from_sources(scene, models, point))
    ways = list(_ways(scene, models, points))
    ways += [(source, name, time) for name, source, time in reversed(ways)]
    sooner = True
    while sooner:
        sooner = False
        for name, source, time in ways:
            if arrival[source] + time < arrival[name]:
                arrival[name], sooner = arrival[source] + time, True
    return {name: 0.0 if math.isinf(time) else time for name, time in arrival.items()}


def _ways(scene: Scene, models: Models, points: Sequence[tuple[str, Point]]) -> Iterator[tuple[str, str, float]]:
    """Yield each pair of neighbouring contacts on a body that moves, with the time of a wave between them [s].

    Times add up along a body, so that neighbours are enough.
    """
    on_body: dict[str, list[tuple[str, Point]]] = {}
    for name, point in points:
        if scene.bodies[point.body].moves:
            on_body.setdefault(point.body, []).append((name, point))
    for label, own in on_body.items():
        body, model = scene.bodies[label], models.get(label)
        for (source, start), (name, point) in itertools.pairwise(sorted(own, key=lambda each: each[1].x)):
            yield name, source, _travel_time(body, model, point.x, start.x)


def _moves(scene: Scene, contact: Contact) -> bool:
    """Return whether the faces of a contact may move against each other from the start."""
    bodies = [scene.bodies[point.body] for point in contact.faces]
    still = bodies[0].velocity == bodies[1].velocity
    # A clamped body that moves at the start strikes its own clamp.
    held = any(body.is_held and body.velocity != 0.0 for body in bodies)
    turning = any(body.softening for body in bodies)
    return not still or held or scene.gravity != 0.0 or turning or contact.gap != 0.0


def _from_sources(scene: Scene, models: Models, point: Point) -> float:
    """Return when forces on the ends of a body, or its initial displacement, reach a point [s]; inf without any."""
    body = scene.bodies[point.body]
    if body.elastic is not None and body.elastic.displacement is not None:
        return 0.0
    ends = [x for x, end in body.ends if end.is_loaded]
    return min((_travel_time(body, models.get(body.name), point.x, x) for x in ends), default=math.inf)


def _travel_time(body: Body, model: AbstractRodModel | None, x: float, other: float) -> float:
    """Return the least time [s] that a wave takes between two places of a body; 0 where its waves have no front.

    A model with a theory of its own, as Love's, has waves that begin everywhere at once.
    """
    own = model is not None and model.theory != ""
    return 0.0 if own else body.travel_time(x, other)
