"""Descriptions of scenes with beams for references.

They are modes under exact steps, beam elements, and continuous beams on grids. Each refines space and time together.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from impactlab.bases.beams.modes import has_closed_form
from impactlab.errors import ImpactlabError
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.absorbing import SENT_BACK
from impactlab.models.modal import Modal
from impactlab.refine.descriptions import cost
from impactlab.refine.descriptions.contact_times import shortest_rise
from impactlab.refine.descriptions.description import Description
from impactlab.refine.descriptions.rods import MIN_FINENESS, modelled_as
from impactlab.scene.bodies import Beam
from impactlab.scene.facts import beams_of, is_lossy, split_at_contacts
from impactlab.scene.method import Simulation, StepRule, force_jumps, laws_of
from impactlab.scene.problem import Point, Probe, Scene
from impactlab.scene.sizes import PER_CELL, fits
from impactlab.simulate import plan
from impactlab.simulate.planning.body_sizes import MAX_BEAM_MODES

STEPS = 20  # in the shortest of the scene's times, per unit of fineness
COARSE_FINENESS = 6  # of continuous beams, whose plan shows whether their parts support a scene
MAX_DENSE_ELEMENTS = 400  # behind modes without a closed form, whose eigenproblem is dense
SPEED_RATIO = 1.8  # c1/c2 of steel: wave speeds of a Timoshenko beam


def stepped(request: Simulation) -> Iterator[Description]:
    """Give the modes and the mesh, the better one first."""
    scene = request.scene
    sheared = any(beam.theory == "timoshenko" for beam in beams_of(scene))
    modal = not any(is_lossy(beam) for beam in beams_of(scene)) and are_delay_lines(scene)
    if sheared:  # the slope jumps at a force: modes converge as 1/n, elements with a node there do not see it
        yield _meshed(request)
    if modal:
        yield _modal(request)
    if not sheared:
        yield _meshed(request)


def is_singular(request: Simulation) -> bool:
    """Return whether a hard contact meets an Euler-Bernoulli beam.

    Its faces part and meet the more often the finer the description, and nothing converges.
    """
    return any(
        request.scene.bodies[point.body].unbounded_first_force
        for contact in request.scene.contacts
        if request.method.laws[contact.name].hard
        for point in contact.faces
    )


def is_infinite(beam: Beam) -> bool:
    """Return whether a beam has an infinite end."""
    return "infinite" in (beam.left.kind, beam.right.kind)


def continuous(request: Simulation, jumps: bool = False, unchecked: bool = False) -> Description | None:
    """Return the description by continuous beams.

    It is for hard contacts, infinite beams, and where ``jumps`` of a force send fronts. None if not possible;
    ``unchecked``, a run may still be refused as it is set up.
    """
    scene, beams = request.scene, beams_of(request.scene)
    sheared = [beam for beam in beams if beam.theory == "timoshenko"]
    for beam in beams:
        uniform = len(beam.segments) == 1 and beam.tension == 0.0 and not beam.is_damped
        if not uniform or not (beam.theory == "timoshenko" or is_infinite(beam)):
            return None
    wanted = jumps or any(law.hard for law in laws_of(*request)) or any(is_infinite(beam) for beam in beams)
    if not wanted or not are_delay_lines(scene):
        return None
    transits = {beam.name: beam.length / beam.segments[0].shear_speed for beam in sheared}
    shortest = min([shortest_time(request) / STEPS, *transits.values()])
    # The grid of an infinite beam goes on for as far as its waves run.
    spans = [transits[beam.name] + SPEED_RATIO * scene.duration * is_infinite(beam) for beam in sheared]

    def simulation(n: int) -> Simulation:
        return modelled_as(request, Continuous(), None, StepRule(dt=shortest / n))

    found = Description(
        "continuous beams",
        "steps in the shortest time of the scene",
        simulation,
        cost.BEAM_GRIDS,
        lambda n: (n * scene.duration / shortest, n * sum(spans) / shortest),
        reference_order=2.0,
        for_choice=False,
    )
    return found if unchecked or can_be_set_up(found) else None


def can_be_set_up(description: Description) -> bool:
    """Return whether the parts of a description support its scene.

    A coarse run, whose plan takes little, shows that; where its step is too long, or a finer run may take too much
    memory, that at the least fineness of a reference does.
    """
    _, cells = description.work(MIN_FINENESS)
    return any(
        _can_be_planned(description.simulation(fineness))
        for fineness in (COARSE_FINENESS, MIN_FINENESS)
        if fineness == MIN_FINENESS or fits(PER_CELL * cells)
    )


def _can_be_planned(made: Simulation) -> bool:
    try:
        plan.prepare(*made)
    except ImpactlabError:
        return False
    return True


def shortest_time(request: Simulation) -> float:
    """Return the shortest time of a scene [s].

    It is its duration, about the first period of its beams, or a rise of force.

    About the first period is L2 sqrt(rho A/EI), from the whole length and the softest piece. Rises count `STEPS` times.
    """
    periods = [
        max(beam.length**2 * math.sqrt(s.density * s.area / s.bending_stiffness) for s in beam.segments)
        for beam in beams_of(request.scene)
    ]
    return min(request.scene.duration, STEPS * shortest_rise(*request), *periods)


def are_delay_lines(scene: Scene) -> bool:
    """Return whether all rods may be stepped delay lines beside beams."""
    rods = {rod.name: rod for rod in scene.wave_bodies}
    places: list[Point | Probe] = [*scene.probes]
    places += [point for contact in scene.contacts for point in contact.faces]
    on_ends = all(place.x in (0.0, rods[place.body].length) for place in places if place.body in rods)
    plain = not any(rod.is_damped or len(rod.segments) > 1 or rod.rotation for rod in rods.values())
    return not rods or (plain and on_ends and not scene.gravity)


def modal_model(beam: Beam, modes: int, elements: int | None = None, fastest: float | None = None) -> Modal:
    """Return the modes of a beam, in closed form or of a mesh.

    The mesh has so many ``elements``, at most `MAX_DENSE_ELEMENTS`; four a mode by default. With ``fastest`` [rad/s]
    static shapes at its contacts stand for those left out (`Modal.residual`), no faster.
    """
    shapes = Modal(modes=modes) if fastest is None else Modal(modes=modes, residual=True, residual_frequency=fastest)
    if has_closed_form(beam):
        return shapes
    held = sum({"clamped": 2, "pinned": 1}.get(end.kind, 0) for end in (beam.left, beam.right))
    elements = min(elements or 4 * modes, MAX_DENSE_ELEMENTS)
    return replace(shapes, elements=elements, modes=min(modes, 2 * elements - held - 2))


def _modal(request: Simulation) -> Description:
    scene, beams = request.scene, beams_of(request.scene)
    shortest = shortest_time(request)
    transit = min((0.5 * rod.round_trip for rod in scene.wave_bodies), default=math.inf)
    order = 1.0 if any(beam.theory == "timoshenko" for beam in beams) else 2.0

    def dt(n: int) -> float:
        return min(shortest / (STEPS * n), transit * MIN_FINENESS / n)  # the step of a rod is at most its transit

    def simulation(n: int) -> Simulation:
        rods = modelled_as(request, Continuous(), ExactModal(), StepRule(dt=dt(n)))
        return rods.but(models={**rods.method.models, **{beam.name: modal_model(beam, n) for beam in beams}})

    def finding(n: int) -> float:
        models = [modal_model(beam, n) for beam in beams]
        return sum(
            cost.CLOSED_FORM_S * n if model.elements is None else cost.of_eigenvectors(2.0 * model.elements)
            for model in models
        )

    return Description(
        "modes under exact steps",
        "modes",
        simulation,
        cost.BEAM_MODES,
        lambda n: (scene.duration / dt(n), len(beams) * n),
        reference_order=order,
        for_choice=False,
        finding=finding,
        max_fineness=MAX_BEAM_MODES,
    )


def _meshed(request: Simulation) -> Description:
    scene = request.scene
    shortest, meshed = shortest_time(request), Simulation(split_at_contacts(scene), request.method)

    def simulation(n: int) -> Simulation:
        return modelled_as(meshed, FiniteElement(n), Midpoint(), StepRule(dt=shortest / (STEPS * n)))

    return Description(
        "consistent mesh under the midpoint rule",
        "elements",
        simulation,
        cost.BEAM_MESH,
        lambda n: (STEPS * n * scene.duration / shortest, len(scene.elastic) * n),
        reference_order=1.0 if force_jumps(*request) else 2.0,
        for_choice=False,
        unseen=lambda _n, _history: SENT_BACK * any(is_infinite(beam) for beam in beams_of(scene)),
    )
