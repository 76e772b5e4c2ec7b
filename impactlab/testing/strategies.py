"""Hypothesis strategies: parts and whole scenes that a run supports.

They may be in any units that a user may choose.

Needs hypothesis (the ``test`` extra). Parts that impactlab registers join in by themselves, with their ``examples``; a
law or integrator of your own by ``scenes(laws=st.just(MyLaw()))``.
"""

from __future__ import annotations

import dataclasses
import math
from functools import cache
from typing import Any

from hypothesis import reject
from hypothesis import strategies as st

from impactlab.bases.craig_bampton import CraigBampton
from impactlab.bases.ritz import Ritz
from impactlab.bases.substructured import Substructured
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.penalty import Penalty
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.errors import CaseError, PairingError
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.bathe import Bathe
from impactlab.integrators.generalised_alpha import GeneralisedAlpha
from impactlab.integrators.hht_alpha import HhtAlpha
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.integrators.newmark import Newmark
from impactlab.integrators.nonsmooth_generalised_alpha import NonsmoothGeneralisedAlpha
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.plugins import INTEGRATORS, LAWS, MODELS, Group, registry
from impactlab.scene.bodies import Body, End, Mass, Rayleigh, Rod, Segment, Wall
from impactlab.scene.method import Method, Simulation, StepRule, laws_of
from impactlab.scene.problem import Contact, Point, Scene
from impactlab.simulate.plan import prepare
from impactlab.types import Relative


def log_uniform(low: float, high: float) -> st.SearchStrategy[float]:
    """Return numbers whose logarithm is spread evenly between two limits."""
    return st.floats(math.log(low), math.log(high)).map(math.exp)


def segments() -> st.SearchStrategy[Segment]:
    """Return uniform pieces: millimetres to metres, wires to piles, rubber to steel."""
    return st.builds(
        Segment,
        length=log_uniform(1e-2, 10.0),
        area=log_uniform(1e-6, 1e-1),
        young=log_uniform(1e8, 4e11),
        density=log_uniform(500.0, 2e4),
    )


@st.composite
def ends(draw: st.DrawFn, segment: Segment, kinds: tuple[str, ...]) -> End:
    """Return an end whose support is 0.01 to 100 times that of the segment."""
    kind = draw(st.sampled_from(kinds))
    share = draw(log_uniform(1e-2, 1e2))
    size = {"spring": segment.young * segment.area / segment.length, "dashpot": segment.impedance, "mass": segment.mass}
    return End(kind, share * size[kind]) if kind in size else End(kind)  # type: ignore[arg-type]


def is_dimensionless(part: object) -> bool:
    """Return whether no option of a part is a number with a unit.

    Such a part means the same in any scene.
    """
    fields = [field for field in dataclasses.fields(part) if field.init]  # type: ignore[arg-type]
    return all(
        field.metadata["unit"] == "1"
        or getattr(part, field.name) in (0.0, None)
        or isinstance(getattr(part, field.name), Relative)
        for field in fields
    )


@cache
def others(group: Group, *tuned: type[Any]) -> tuple[Any, ...]:
    """Return the examples of our registered parts other than the tuned ones.

    Those with a number that has a unit are left out.
    """
    ours = registry().only("impactlab")
    kinds = [kind for kind in (ours.load(group, name) for name in ours.names(group)) if kind not in tuned]
    made = [kind(**options) for kind in kinds for options in kind.examples]
    return tuple(part for part in made if is_dimensionless(part))


def with_others(group: Group, **tuned: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Return the tuned strategies by part name, with all other registered parts."""
    ours = registry().only("impactlab")
    rest = others(group, *(ours.load(group, name) for name in tuned))  # type: ignore[arg-type] # classes are hashable
    return st.one_of(*tuned.values(), *([st.sampled_from(rest)] if rest else []))


def models() -> st.SearchStrategy[AbstractRodModel]:
    """Return models that step: finite elements, modes, and other registered ones.

    Modes are those of a mesh or analytic.
    """
    mass = st.sampled_from(["consistent", "lumped"])
    elements = st.integers(2, 40)
    modal = st.one_of(
        elements.flatmap(lambda n: st.builds(Modal, st.just(n), st.one_of(st.none(), st.integers(1, n - 1)), mass)),
        st.builds(Modal, st.none(), st.integers(1, 40)),
        st.builds(
            Modal,
            st.integers(10, 40),
            st.integers(4, 9),
            basis=st.sampled_from([CraigBampton(), Ritz(), Substructured(pieces=2, others=1)]),
        ),
    )
    finite_element = st.one_of(
        st.builds(FiniteElement, elements, mass), st.builds(FiniteElement, st.integers(1, 8), mass, st.integers(2, 6))
    )
    return with_others(MODELS, continuous=st.nothing(), finite_element=finite_element, modal=modal)


def integrators() -> st.SearchStrategy[AbstractIntegrator]:
    """Return every kind of integrator that is registered and steps; Newmark mostly with average acceleration."""
    damped = st.floats(0.5, 0.9).flatmap(
        lambda gamma: st.builds(Newmark, beta=st.floats(0.5 * gamma, 0.9), gamma=st.just(gamma))
    )
    radius = st.floats(0.0, 1.0)
    return with_others(
        INTEGRATORS,
        adaptive=st.nothing(),
        newmark=st.one_of(st.just(Newmark()), damped),
        moreau_jean=st.builds(MoreauJean, theta=st.floats(0.5, 1.0)),
        hht_alpha=st.builds(HhtAlpha, alpha=st.floats(-1.0 / 3.0, 0.0)),
        generalised_alpha=st.builds(GeneralisedAlpha, rho_inf=radius),
        nonsmooth_generalised_alpha=st.builds(NonsmoothGeneralisedAlpha, rho_inf=radius),
        bathe=st.builds(Bathe, first_part=st.floats(0.3, 0.7)),
    )


def laws() -> st.SearchStrategy[AbstractContactLaw]:
    """Return every kind of law that is registered and needs no number with a unit."""
    relative = st.builds(Relative, log_uniform(1e-2, 10.0))
    return with_others(
        LAWS,
        wave_identification=st.builds(WaveIdentification, residual=st.booleans()),
        penalty=st.builds(Penalty, stiffness=relative, damping=st.one_of(st.just(0.0), relative)),
        impulse_momentum=st.builds(ImpulseMomentum, restitution=st.floats(0.0, 1.0)),
    )


FAR_ENDS = ("free", "clamped", "spring", "dashpot", "mass")


@st.composite
def rods(
    draw: st.DrawFn, name: str, far: tuple[str, ...] = FAR_ENDS, velocity: float = 0.0, most_segments: int = 2
) -> Rod:
    """Return a rod of one segment or several, its left end free."""
    pieces = tuple(draw(st.lists(segments(), min_size=1, max_size=most_segments)))
    return Rod(name, pieces, End("free"), draw(ends(pieces[-1], far)), velocity=velocity)


def _turned(end: End) -> End:
    """Return an end with the opposite force."""
    load = None if end.load is None else end.load.scaled(-1.0)
    return dataclasses.replace(end, force=-end.force, load=load)


def mirrored(simulation: Simulation) -> Simulation:
    """Return the same scene and method seen from behind: x from right to left."""
    scene, laws = simulation.scene, laws_of(*simulation)

    def turned(body: Body) -> Body:
        if not body.moves:
            return body
        values: dict[str, Any] = {"velocity": -body.velocity}
        if (elastic := body.elastic) is not None:
            profile, length = elastic.displacement, elastic.length
            values |= {
                "segments": elastic.segments[::-1],
                "left": _turned(elastic.right),
                "right": _turned(elastic.left),
                "displacement": None if profile is None else lambda x: -profile(length - x),
            }
        return dataclasses.replace(body, **values)

    def moved(point: Point) -> Point:
        body = scene.bodies[point.body]
        if body.elastic is None:
            return point
        side = {0.0: "right", body.length: "left"}.get(point.x)
        label = f"{point.body}.{side}" if side else f"{point.body}.at({body.length - point.x:g})"
        return Point(point.body, body.length - point.x, label)

    contacts = tuple(
        dataclasses.replace(contact, left=moved(contact.right), right=moved(contact.left)) for contact in scene.contacts
    )
    bodies = {name: turned(body) for name, body in scene.bodies.items()}
    named = {contact.name: law for contact, law in zip(contacts, laws, strict=True)}
    return simulation.but(bodies=bodies, contacts=contacts, gravity=-scene.gravity, laws=named)


def in_other_units(simulation: Simulation, mass: float, length: float, time: float) -> Simulation:
    """Return the same scene and method in smaller units; laws without dimension.

    With factors that are powers of 4 no digit of any number changes, only its exponent.
    """
    scene, method = simulation
    stiffness, damping, speed = mass / time**2, mass / time, length / time
    of_ends = {"spring": stiffness, "dashpot": damping, "mass": mass}
    of_pieces = {
        "length": length,
        "area": length**2,
        "young": stiffness / length,
        "density": mass / length**3,
        "viscosity": stiffness / length * time,
        "inertia": length**4,
        "shear_stiffness": stiffness * length,
        "rotary_inertia": mass * length,
        "height": length,
    }
    of_bodies = {"mass": mass, "velocity": speed, "tension": stiffness * length}

    def times(record: Body | Segment, factors: dict[str, float]) -> dict[str, Any]:
        names = [each.name for each in dataclasses.fields(record) if each.name in factors]
        return {name: getattr(record, name) * factors[name] for name in names}

    def at_end(end: End) -> End:
        force, rotational = mass * length / time**2, stiffness * length**2
        load = None if end.load is None else end.load.scaled(force, time)
        value = end.value * of_ends.get(end.kind, 1.0)
        return End(end.kind, value, end.force * force, end.rotational * rotational, load)

    def scaled(body: Body) -> Body:
        values = times(body, of_bodies)
        if (elastic := body.elastic) is not None:
            values |= {
                "segments": tuple(dataclasses.replace(piece, **times(piece, of_pieces)) for piece in elastic.segments),
                "left": at_end(elastic.left),
                "right": at_end(elastic.right),
                "damping": Rayleigh(elastic.damping.mass / time, elastic.damping.stiffness * time),
            }
        return dataclasses.replace(body, **values)

    def placed(point: Point) -> Point:
        return dataclasses.replace(point, x=point.x * length)

    step = method.step if method.step.dt is None else StepRule(dt=method.step.dt * time)
    return simulation.but(
        bodies={name: scaled(body) for name, body in scene.bodies.items()},
        contacts=tuple(
            dataclasses.replace(c, left=placed(c.left), right=placed(c.right), gap=c.gap * length)
            for c in scene.contacts
        ),
        duration=scene.duration * time,
        step=step,
        gravity=scene.gravity * speed / time,
        round_trip=scene.round_trip * time,
        snapshots=tuple(snapshot * time for snapshot in scene.snapshots),
        frames=tuple(frame * time for frame in scene.frames),
        probes=tuple(dataclasses.replace(probe, x=probe.x * length) for probe in scene.probes),
    )


@st.composite
def scenes(
    draw: st.DrawFn,
    laws: st.SearchStrategy[AbstractContactLaw] | None = None,
    integrators: st.SearchStrategy[AbstractIntegrator] | None = None,
    models: st.SearchStrategy[AbstractRodModel] | None = None,
    far: tuple[str, ...] = FAR_ENDS,
    kinds: tuple[str, ...] = ("mass_on_rod", "rod_on_wall", "two_rods"),
    steps: int = 300,
    gravity: bool = True,
    turned: bool = True,
    most_segments: int = 2,
) -> Simulation:
    """Return scenes of one impact that `prepare` accepts, some seen from behind.

    A mass on a rod, a rod on a wall, two rods, of at most ``most_segments`` each. The mass of the striker is a
    thousandth to a thousand times that of the rod. The run is a whole number of steps, at most ``steps``, of about
    three round trips at most.
    """
    law = draw(DEFAULTS.laws() if laws is None else laws)
    integrator = draw(DEFAULTS.integrators() if integrators is None else integrators)
    some_model = DEFAULTS.models() if models is None else models
    model = draw(some_model)
    kind = draw(st.sampled_from(kinds))
    speed = draw(log_uniform(1e-2, 10.0))
    weight = draw(st.sampled_from([0.0, 1e-2, -1e-2])) if gravity else 0.0
    bodies: dict[str, Body] = {}
    chosen = {"rod": model}
    if kind == "rod_on_wall":
        rod = draw(rods("rod", ("free",) if "free" in far else far, -speed, most_segments))
        bodies = {"wall": Wall("wall"), "rod": rod}
        left = Point("wall", 0.0, "wall")
    elif kind == "mass_on_rod":
        rod = draw(rods("rod", far, most_segments=most_segments))
        bodies = {"hammer": Mass("hammer", rod.mass * draw(log_uniform(1e-3, 1e3)), speed), "rod": rod}
        left = Point("hammer", 0.0, "hammer")
    else:
        rod = draw(rods("rod", far, most_segments=most_segments))
        chosen["striker"] = draw(some_model)
        other = draw(rods("striker", ("free",), most_segments=most_segments))
        striker = dataclasses.replace(other, segments=other.segments[::-1], velocity=speed)
        bodies = {"striker": striker, "rod": rod}
        left = Point("striker", striker.length, "striker.right")
    trip = rod.round_trip
    gap = draw(st.sampled_from([0.0, 0.1])) * speed * trip
    rule = StepRule(points_per_period=draw(st.floats(8.0, 40.0)))
    contact = Contact(left, Point("rod", 0.0, "rod.left"), gap)
    scene = Scene(
        name=kind,
        bodies=bodies,
        contacts=(contact,),
        duration=3.0 * trip,
        gravity=weight * speed / trip,
        round_trip=trip,
    )
    made = Simulation(scene, Method({contact.name: law}, chosen, integrator, rule))
    made = mirrored(made) if turned and draw(st.booleans()) else made
    try:
        plan = prepare(*made)
    except (PairingError, CaseError):
        reject()
    assert plan.dt is not None
    return made.but(duration=min(plan.steps, steps) * plan.dt)


class DEFAULTS:
    """The strategies of this module, under names that the arguments of `scenes` do not hide."""

    laws, integrators, models = staticmethod(laws), staticmethod(integrators), staticmethod(models)
