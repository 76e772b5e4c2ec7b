"""What a scene with a beam is judged by: modes under exact steps and a mesh, each refined, one checked by the other."""

from __future__ import annotations

import math
from collections.abc import Iterator

from impactlab.bases.beams.modes import BeamModes
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.errors import CaseError, ImpactlabError
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.refine.contact_times import rise_time
from impactlab.refine.described import described, has_one_answer
from impactlab.refine.ways import COARSEST, Way
from impactlab.scene.bodies import Beam, WaveBody
from impactlab.scene.facts import beams_of, rods_of, split_at_contacts
from impactlab.scene.method import Simulation, StepRule, force_jumps, laws_of
from impactlab.scene.problem import Scene
from impactlab.simulate import driver as simulate

STEPS = 20  # in the shortest of the scene's times, per unit of fineness
MESHED = 400  # elements behind modes where no closed form is known: they are worked out densely
CHECKING = 3e-5  # uncertainty at which the second answer is good enough to check the first
DISAGREE = 3.0  # times what both answers claim to be off by: from here on it is their difference that is known


def slowest_time(beam: Beam) -> float:
    """Return L2 sqrt(rho A/EI) of a beam [s], from its whole length and its softest piece: about its first period."""
    return max(beam.length**2 * math.sqrt(s.density * s.area / s.bending_stiffness) for s in beam.segments)


def scale(asked: Simulation) -> float:
    """Return the shortest of the times on which a scene changes [s]: its own, its beams', and those of its contacts."""
    scene, method = asked
    contacts = [STEPS * rise_time(scene, method, contact) for contact in scene.contacts]
    return min([scene.duration, *(slowest_time(beam) for beam in beams_of(scene)), *contacts])


def is_singular(asked: Simulation) -> bool:
    """Return whether a hard contact meets an Euler-Bernoulli beam."""
    return any(
        asked.scene.bodies[point.body].unbounded_first_force
        for contact in asked.scene.contacts
        if asked.method.laws[contact.name].hard
        for point in (contact.left, contact.right)
    )


def every_way(asked: Simulation) -> Iterator[Way]:
    """Give the descriptions that may judge a scene with beams: those of `ways`, and continuous beams.

    These go first where fronts count, under hard contacts; alone where a beam goes on for ever, of which the layers of
    a mesh only come near.
    """
    scene, beams = asked.scene, beams_of(asked.scene)
    endless = any(is_endless(beam) for beam in beams)
    if (endless or any(law.hard for law in laws_of(*asked))) and has_one_answer(asked):
        continuous = all(is_continuous(beam) for beam in beams) and all(is_a_line(scene, rod) for rod in rods_of(scene))
        way = _waves(asked)
        if continuous and _serves(way):
            yield way
            if endless:
                return
    yield from ways(asked)


def _serves(way: Way) -> bool:
    try:
        simulate.prepare(*way.run(COARSEST))
    except ImpactlabError:
        return False
    return True


def ways(asked: Simulation) -> Iterator[Way]:
    """Give the descriptions in coordinates that may serve a scene with beams.

    None where a hard contact meets an Euler-Bernoulli beam: the faces then part and meet again the more often the finer
    the description, and nothing converges.
    """
    scene = asked.scene
    if is_singular(asked) or not has_one_answer(asked):
        return
    sheared = any(beam.theory == "timoshenko" for beam in beams_of(scene))
    if sheared:  # near a force it gives way over no length at all: modes converge as 1/n, elements at once
        yield _meshed(asked)
    if not any(is_lossy(beam) for beam in beams_of(scene)) and all(is_a_line(scene, rod) for rod in rods_of(scene)):
        yield _modal(asked)
    if not sheared:
        yield _meshed(asked)


def is_endless(beam: Beam) -> bool:
    """Return whether a beam goes on for ever."""
    return "infinite" in (beam.left.kind, beam.right.kind)


def is_continuous(beam: Beam) -> bool:
    """Return whether a beam may be continuous; what else speaks against it, its description tells."""
    uniform = len(beam.segments) == 1 and beam.tension == 0.0 and not beam.is_damped
    return uniform and (beam.theory == "timoshenko" or is_endless(beam))


def is_lossy(beam: Beam) -> bool:
    """Return whether a beam or its ends lose energy, which exact modes do not know."""
    return beam.is_damped or any(end.kind in ("dashpot", "infinite") for end in (beam.left, beam.right))


def is_a_line(scene: Scene, rod: WaveBody) -> bool:
    """Return whether a rod of a scene may be a stepped delay line beside modes of beams."""
    places = [
        point.x for contact in scene.contacts for point in (contact.left, contact.right) if point.body == rod.name
    ]
    places += [probe.x for probe in scene.probes if probe.body == rod.name]
    plain = not scene.gravity and not rod.is_damped and len(rod.segments) == 1
    return plain and all(x in (0.0, rod.length) for x in places)


def has_closed_modes(beam: Beam) -> bool:
    """Return whether the modes of a beam are known without a mesh."""
    try:
        BeamModes(beam, 2)
    except CaseError:
        return False
    return True


def modal_scene(asked: Simulation, modes: int, dt: float) -> Simulation:
    """Return the scene with its beams in so many modes, its rods as delay lines, under exact steps of dt [s]."""
    described_by = described(asked, Continuous(), ExactModal(), StepRule(dt=dt), AdditionDeletion())
    models = dict(described_by.method.models)
    for beam in beams_of(asked.scene):
        closed = has_closed_modes(beam)
        held = sum({"clamped": 2, "pinned": 1}.get(end.kind, 0) for end in (beam.left, beam.right))
        elements = min(4 * modes, MESHED)
        model = Modal(modes=modes) if closed else Modal(elements=elements, modes=min(modes, 2 * elements - held - 2))
        models[beam.name] = model
    return described_by.but(models=models)


def _modal(asked: Simulation) -> Way:
    scene = asked.scene
    shortest, count = scale(asked), len(beams_of(scene))
    lines = min((0.5 * rod.round_trip for rod in rods_of(scene)), default=math.inf)

    def dt(n: int) -> float:
        return min(shortest / (STEPS * n), lines)

    return Way(
        "modes under exact steps:",
        lambda n: modal_scene(asked, n, dt(n)),
        lambda n: (3e-7 + 1.5e-9 * count * n) * scene.duration / dt(n),
        order=1.0 if any(beam.theory == "timoshenko" for beam in beams_of(scene)) else 2.0,
    )


def _waves(asked: Simulation) -> Way:
    scene = asked.scene
    shortest, beams = scale(asked), beams_of(scene)
    sheared = [beam for beam in beams if beam.theory == "timoshenko"]
    shortest = min([shortest / STEPS, *(beam.length / beam.segments[0].shear_speed for beam in sheared)])
    spans = [
        beam.length / beam.segments[0].shear_speed
        + (1.8 * scene.duration if is_endless(beam) else 0.0)  # c1/c2 of steel, what is beyond the ends
        for beam in sheared
    ]

    def seconds(n: int) -> float:
        dt = shortest / n
        return (6e-7 * len(beams) + 1.6e-8 * sum(spans) / dt) * scene.duration / dt

    return Way(
        "continuous beams, steps in the shortest of the scene's times:",
        lambda n: described(asked, Continuous(), None, StepRule(dt=shortest / n), AdditionDeletion()),
        seconds,
    )


def _meshed(asked: Simulation) -> Way:
    scene = asked.scene
    shortest, count = scale(asked), len(scene.elastic)

    def rule(n: int) -> StepRule:
        return StepRule(dt=shortest / (STEPS * n))

    meshed = Simulation(split_at_contacts(scene), asked.method)
    return Way(
        "consistent mesh under the midpoint rule, elements:",
        lambda n: described(meshed, FiniteElement(n), Midpoint(), rule(n), AdditionDeletion()),
        lambda n: (3e-7 + 5e-8 * count * n) * STEPS * n * scene.duration / shortest,
        order=1.0 if force_jumps(*asked) else 2.0,
    )
