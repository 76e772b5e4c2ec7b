"""First arrivals of faces in free flight and of waves: times before which no contact can close."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence

from impactlab.models.base import AbstractRodModel
from impactlab.scene.bodies import Body
from impactlab.scene.method import Method
from impactlab.scene.problem import Contact, Point, Scene

Models = Mapping[str, AbstractRodModel]  # by name of the body


def first_arrivals(scene: Scene, method: Method) -> dict[str, float]:
    """Return the earliest time [s] at which each contact can close.

    Faces meet in free flight, or wait for a wave from another contact, from a force on an end or from an initial
    displacement. Waves travel no faster than sqrt(E/rho); through a rigid body, a beam without shear or a rod that is
    damped they take no time. A contact in the way passes them on without delay. Links may act on bodies at rest from
    t = 0 on: beside them a contact with a gap is taken to close at any time.
    """
    models, linked = method.models, bool(method.links)
    arrival = {contact.name: _flight_time(scene, contact, linked) for contact in scene.contacts}
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
    """Yield each pair of neighbouring contacts on a moving body, with wave times [s].

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


def _flight_time(scene: Scene, contact: Contact, linked: bool) -> float:
    """Return the time at which two faces meet without waves [s].

    It is inf where they rest or separate, 0 where it is not known.
    """
    left, right = (scene.bodies[point.body] for point in contact.faces)
    for body in (left, right):
        # A body that moves at the start and is held, as at a clamp, or damped as a whole does not fly on.
        if body.softening or body.changes or (body.velocity != 0.0 and not body.is_free):
            return 0.0
    closing = left.velocity - right.velocity
    if scene.gravity != 0.0 or contact.gap < 0.0 or (contact.gap == 0.0 and closing != 0.0):
        return 0.0
    if contact.gap > 0.0 and linked:
        return 0.0
    return contact.gap / closing if closing > 0.0 else math.inf


def _from_sources(scene: Scene, models: Models, point: Point) -> float:
    """Return the arrival time of end forces or an initial displacement [s].

    It is that of their waves at ``point``, inf without any.
    """
    body = scene.bodies[point.body]
    if body.elastic is not None and body.elastic.displacement is not None:
        return 0.0
    ends = [x for x, end in body.ends if end.is_loaded]
    return min((_travel_time(body, models.get(body.name), point.x, x) for x in ends), default=math.inf)


def _travel_time(body: Body, model: AbstractRodModel | None, x: float, other: float) -> float:
    """Return the least time of a wave between two places of a body [s].

    It is 0 where its waves have no front. A model with a theory of its own, as Love's, has waves that begin everywhere
    at once.
    """
    own = model is not None and model.theory != ""
    return 0.0 if own else body.travel_time(x, other)
