"""Descriptions of scenes with rods and rigid bodies.

Each is a model, an integrator and a step rule, with its cost and its order. Converged references and the automatic
choice climb the levels of the same list. Its order is that in which references prefer them; the automatic choice
compares predicted costs. Factors of predicted errors were measured on the paper's impact and its relatives
(docs/automatic-choice.md): they decide where trials begin, and never which error is stated.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import Any, Literal

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz
from impactlab.exact.cost import begin
from impactlab.exact.setup.contact_kinds import massless
from impactlab.integrators.adaptive import Adaptive
from impactlab.integrators.base import AbstractScheme
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.contact_stabilised_newmark import ContactStabilisedNewmark
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.models.base import AbstractRodModel
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.bar_elements import elements_per_segment
from impactlab.refine.descriptions import cost
from impactlab.refine.descriptions.contact_times import shortest_rise
from impactlab.refine.descriptions.cost import Cost
from impactlab.refine.descriptions.description import Description
from impactlab.refine.descriptions.rows_of_beads import row_of_beads, serves
from impactlab.refine.errors.smooth_touch import stated_alone
from impactlab.scene.facts import (
    delay_unit,
    is_a_delay_line,
    on_end,
    shortest_transit,
    split_at_contacts,
)
from impactlab.scene.method import Method, Simulation, StepRule, force_jumps, is_relative, laws_of, sides
from impactlab.scene.problem import RECORDS, Scene
from impactlab.simulate.planning.preparation import build_bodies

EXACT_ERROR = 1e-9  # stated for the exact solver, whose error is 1e-12 except for instants near a grazing touch
MAX_RECORDS = 200_000  # instants that are kept, 14 MB for a contact
OFF_COURANT = 0.95  # courant number at which no wave goes exactly one element in a step
SMOOTH_FRONT_ELEMENTS = 10  # a rod: damped fronts wider than one of these count as smooth (docs/audit.md)
TOLERANCE_POWER = 4.0  # the tolerance of adaptive steps falls as fineness to minus this
MIN_FINENESS = 50  # of the first level of a reference: elements, or steps in the shortest transit
STABLE_TURN = 8.0  # rad of the highest frequency in an adaptive step of the first level; measured: 5 to 10
STEPS_A_CONTACT = 3.0  # of adaptive steps, which begin again where a contact closes or opens; beside the first
MAX_STEPS_RATIO = 20.0  # over the expected number of adaptive steps: a stiffer damping is not for such steps


def modelled_as(
    request: Simulation,
    model: AbstractRodModel,
    integrator: AbstractScheme | None,
    step: StepRule,
    law: AbstractContactLaw = AdditionDeletion(),  # noqa: B008 - frozen
    events: Any = "dated",
) -> Simulation:
    """Return a scene with one model for all bodies; ``law`` replaces hard ones.

    A stiffness relative to the elements of the given models becomes one in N/m.
    """
    laws = {}
    for contact in request.scene.contacts:
        own = request.method.laws[contact.name]
        constants = own.spring(*sides(*request, contact), math.nan) if is_relative(own) and not own.hard else None
        laws[contact.name] = law if own.hard else own if constants is None else Penalty(*constants)
    return Simulation(
        request.scene, Method(laws, dict.fromkeys(request.scene.elastic, model), integrator, step, events)
    )


def exact(request: Simulation) -> Description:
    """Return the exact solver; raise `CaseError` or `PairingError` where it does not apply."""
    waves = modelled_as(request, Continuous(), None, StepRule(points_per_period=10.0))
    begun = begin(*waves)
    return Description(
        "continuous, from event to event",
        "",
        lambda _n: waves,
        cost.EXACT,
        lambda _n: (begun.predicted_s, 0.0),
        error=lambda _n: EXACT_ERROR,
        order=0.0,
        safety=1.0,
        begun=begun,
    )


def stepped(request: Simulation) -> Iterator[Description]:
    """Give the descriptions with steps for rods and rigid bodies."""
    request = Simulation(split_at_contacts(request.scene), request.method)
    if not request.scene.wave_bodies:
        if serves(request):
            yield row_of_beads(request)
        yield _rigid(request, for_choice=not serves(request))
        yield _adaptive(request)
        return
    if is_a_delay_line(request.scene) and not any(law.hard for law in laws_of(*request)):
        yield _delay_line(request)
    elif (unit := delay_unit(request.scene)) is not None and not any(law.hard for law in laws_of(*request)):
        yield _delay_chain(request, unit)
    rods = request.scene.wave_bodies
    if not any(rod.damping.stiffness > 0.0 or any(each.viscosity > 0.0 for each in rod.segments) for rod in rods):
        yield from _explicit(request)  # these schemes do not support dampers inside a rod
    yield from _implicit(request)


def mechanisms(request: Simulation) -> Iterator[Description]:
    """Yield the description of a scene with a mechanism: adaptive steps.

    All bodies have the shapes of their models.
    """
    if all(law.smooth for law in laws_of(*request)):
        yield _adaptive(request, *_frequency_and_size(request), cost.MECHANISM)


def _frequency_and_size(request: Simulation) -> tuple[float, int]:
    """Return the highest frequency of the bodies [rad/s], and the number of their coordinates."""
    systems = [body.system for body in build_bodies(*request).values()]
    return max(system.highest_frequency for system in systems), sum(system.load.size for system in systems)


def without_places(scene: Scene) -> Scene:
    """Return the scene without inner probes and snapshots."""
    probes = tuple(
        probe
        for probe in scene.probes
        if on_end(body := scene.bodies[probe.body], probe)
        and body.reading(probe.quantity)[0] in ("displacement", "velocity")
    )
    return dataclasses.replace(scene, probes=probes, snapshots=())


def recorded(made: Simulation, steps: float) -> Simulation:
    """Return the scene with enough records for a run of ``steps``.

    Up to `MAX_RECORDS` are kept, unless the case limits them: records give the forces.
    """
    records = max(RECORDS, min(math.ceil(steps), MAX_RECORDS))
    return made if made.scene.records != RECORDS or records == RECORDS else made.but(records=records)


def _smooth_error(request: Simulation, factor: float, time: float) -> Callable[[int], float]:
    """Return the error of forces without fronts as a function of fineness.

    It is of the second order in a time [s] over the fineness.
    """
    scale = shortest_rise(*request) * request.scene.duration
    return lambda n: factor * (time / n) ** 2 / scale


def _rigid(request: Simulation, for_choice: bool) -> Description:
    duration, bodies = request.scene.duration, request.scene.bodies
    shared = [faces for name, faces in request.scene.touching.items() if len(faces) > 1 and bodies[name].moves]
    coupled = len({number for faces in shared for number, _ in faces})

    def simulation(steps: int) -> Simulation:
        method = Method(request.method.laws, {}, ExactModal(), StepRule(dt=duration / steps))
        return recorded(Simulation(request.scene, method), steps)

    return Description(
        "rigid bodies",
        "steps",
        simulation,
        cost.RIGID,
        lambda n: (n, coupled),
        reference_order=2.0,
        per_level=20,
        error=_smooth_error(request, 1.0, duration),
        safety=3.0,
        min_fineness=40,
        alike=True,
        alone=stated_alone(request),
        for_choice=for_choice,  # along rows of beads leapfrog is as accurate, at a hundredth of the cost
    )


def _adaptive(request: Simulation, frequency: float = 0.0, size: int = 0, prices: Cost = cost.ADAPTIVE) -> Description:
    rises, turns = request.scene.duration / shortest_rise(*request), request.scene.duration * frequency
    others = max(0, len(request.scene.contacts) - 1)

    def steps(n: int) -> float:
        return max(10.0, rises, turns / STABLE_TURN) * math.sqrt(n / MIN_FINENESS) + STEPS_A_CONTACT * others

    def simulation(n: int) -> Simulation:
        tolerance = max(1e-4 * (MIN_FINENESS / n) ** TOLERANCE_POWER, 1e-12)
        integrator = Adaptive(relative_tolerance=tolerance, most_steps=round(MAX_STEPS_RATIO * steps(n)))
        step = StepRule(points_per_period=10.0)
        return Simulation(request.scene, Method(request.method.laws, request.method.models, integrator, step))

    return Description(
        "adaptive steps between located events",
        "grades of tolerance",
        simulation,
        prices,
        lambda n: (steps(n), size or others),
        reference_order=TOLERANCE_POWER,
        for_choice=False,
    )


def _by_delays(request: Simulation, unit: float) -> Callable[[int], Simulation]:
    """Return the scene on delay lines as a function of fineness.

    This is the number of steps in a unit of time [s].
    """

    def simulation(n: int) -> Simulation:
        dt = unit / n
        return recorded(modelled_as(request, Continuous(), None, StepRule(dt=dt)), request.scene.duration / dt)

    return simulation


def _delay_line(request: Simulation) -> Description:
    scene, laws = request.scene, laws_of(*request)
    shortest, bare = shortest_transit(scene), Simulation(without_places(scene), request.method)
    # Elastic power laws begin softly; damping by the indentation rate gives a force with a kink.
    elastic = all(isinstance(law, Hertz) or law.is_spring for law in laws)

    return Description(
        "stepped delay line",
        "steps in the shortest transit",
        _by_delays(bare, shortest),
        cost.DELAY_LINE,
        lambda n: (n * scene.duration / shortest, len(scene.wave_bodies)),
        reference_order=2.0,
        # The choice keeps all probes, and springs alone are solved exactly.
        for_choice=bare.scene == scene and not all(law.is_spring for law in laws),
        error=_smooth_error(request, 0.25 if elastic else 2.5, shortest),
        own_steppers=True,
        # Half of it is even: transits of other rods are often whole multiples of half the shortest, and a wave that
        # arrives between two steps is less exact. Even and odd numbers of steps would not lie on one line.
        multiple=4,
    )


def _delay_chain(request: Simulation, unit: float) -> Description:
    """Return the description of segmented rods, struck inside, as chains of delays.

    The delays are of whole steps: a unit [s] holds a whole number of them.
    """
    scene = request.scene
    size = sum(len(rod.segments) for rod in scene.wave_bodies) + len(scene.contacts)

    return Description(
        "stepped delay line of segments",
        "steps in their common unit of time",
        _by_delays(request, unit),
        cost.DELAY_LINE,
        lambda n: (n * scene.duration / unit, size),
        reference_order=2.0,
        for_choice=False,
    )


def _explicit(request: Simulation) -> Iterator[Description]:
    """Yield lumped meshes at courant 1 or below, under central difference.

    It is 1 for hard contact and fronts, and not 1 where such a mesh disperses fronts, too. On special rods waves go one
    element in a step at courant 1, whatever the number of elements. Then a mesh disperses nothing, and its error is
    that of its contacts alone: two meshes at that step have the same advantage, and do not check each other.
    """
    scene, jumps, shortest = request.scene, force_jumps(*request), shortest_transit(request.scene)
    times = [segment.length / segment.wave_speed for rod in scene.wave_bodies for segment in rod.segments]
    special = jumps and max(times) - min(times) <= 1e-9 * max(times)
    hard = any(law.hard for law in laws_of(*request))

    def described(courant: float, order: float, safety: float, error: Callable[[int], float]) -> Description:
        def simulation(n: int, courant: float = courant) -> Simulation:
            return modelled_as(request, FiniteElement(n, "lumped"), CentralDifference(), StepRule(courant=courant))

        return Description(
            f"lumped mesh, central difference at courant {courant:g}",
            "elements a rod",
            simulation,
            cost.LUMPED_MESH,
            lambda n: _mesh_work(scene, n, courant),
            reference_order=order if hard and courant == 1.0 else 0.0,
            for_choice=special or courant != 1.0,
            error=error,
            order=order,
            safety=safety,
            check=(lambda n: simulation(n, OFF_COURANT)) if special else None,
            check_error=lambda n: 6.0 * shortest / n / scene.duration,
        )

    if special:
        # An opening falls between two steps now here, now there: an error may be nearly that of half the fineness.
        yield described(1.0, 2.0, 4.0, _smooth_error(request, 6.0, shortest))
    elif jumps:
        for courant in (1.0, OFF_COURANT) if hard else (OFF_COURANT,):
            yield described(courant, 1.0, 3.0, lambda n: 2.0 * shortest / n / scene.duration)
    else:
        yield described(OFF_COURANT, 2.0, 2.0, _smooth_error(request, 1.5, shortest))


def _mesh_work(scene: Scene, elements: int, courant: float) -> tuple[float, float]:
    """Return the number of steps of a run on a mesh, and of its elements.

    Each rod has ``elements``; the shortest sets the step by the Courant number.
    """
    shortest = min(
        segment.length / segment.wave_speed / count
        for rod in scene.wave_bodies
        for segment, count in zip(rod.segments, elements_per_segment(rod.segments, elements), strict=True)
    )
    return scene.duration / (courant * shortest), len(scene.wave_bodies) * elements


def _implicit(request: Simulation) -> Iterator[Description]:
    """Give meshes under implicit schemes, which serve damped rods, too.

    Hard contacts under the midpoint rule gain energy at each touch where the fronts of damped rods are sharp. There the
    choice takes a scheme that gains none; it is of the first order, and needs a face without mass.
    """
    scene, jumps, shortest = request.scene, force_jumps(*request), shortest_transit(request.scene)
    # Damping rounds the fronts over a time that grows with it; elements that resolve it converge at order 2.
    rounding = 10.0 * min(
        rod.damping.stiffness + min(s.viscosity / s.young for s in rod.segments) for rod in scene.wave_bodies
    )
    sharp = rounding <= shortest / SMOOTH_FRONT_ELEMENTS
    hard = [contact for contact in scene.contacts if request.method.laws[contact.name].hard]
    bare = all(massless(scene, contact.left) or massless(scene, contact.right) for contact in hard)
    stabilised = rounding > 0.0 and sharp and bool(hard) and bare

    def error_of_fronts(n: int) -> float:
        h = shortest / n
        return (0.5 if rounding else 1.5) * h / scene.duration * h / (h + rounding)

    def described(name: str, mass: Literal["consistent", "lumped"], scheme: AbstractScheme) -> Description:
        return Description(
            f"{mass} mesh, {name} at courant 1/2",
            "elements a rod",
            lambda n: modelled_as(request, FiniteElement(n, mass), scheme, StepRule(courant=0.5)),
            cost.IMPLICIT_MESH,
            lambda n: _mesh_work(scene, n, 0.5),
            reference_order=1.0 if jumps else 2.0,
            for_choice=mass == "consistent" and not stabilised,
            error=error_of_fronts if jumps else _smooth_error(request, 1.5, shortest),
            order=1.0 if jumps and not rounding else 2.0,
            safety=4.0 if jumps and sharp else 2.0,
        )

    yield described("midpoint rule", "consistent", Midpoint())
    yield described("midpoint rule", "lumped", Midpoint())
    if stabilised:
        gaining_nothing = described("contact-stabilised Newmark", "consistent", ContactStabilisedNewmark())
        yield dataclasses.replace(gaining_nothing, reference_order=0.0, for_choice=True)
