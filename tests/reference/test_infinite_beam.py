"""The infinite Euler-Bernoulli beam against closed forms and finite beams; infinite ends of rods and meshes."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import solve_banded
from scipy.special import erfcx

import impactlab as il
from impactlab.casefile.infinite_ends import BEND_STEPS, CURVATURE
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.dispersive_identification import DispersiveIdentification
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.power_law import Hertz
from impactlab.errors import ImpactlabError, PairingError
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import Face
from impactlab.models.continuous import Continuous
from impactlab.models.continuous.infinite_beam import InfiniteBeam
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.beams import BeamMesh
from impactlab.models.modal import Modal
from impactlab.scene import Beam, BeamSegment, End, Probe, Rayleigh
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import prepare, run
from impactlab.testing.scenes import struck
from tests.reference.test_timoshenko_waves import beam as timoshenko
from tests.solving import in_steps, mesh

INFINITE, FREE = End("infinite"), End("free")
SEGMENT = BeamSegment(2.0, 1e-4, 2.1e11, 7900.0, inertia=1e-8 / 12.0)
EI, RHO_A = 175.0, 0.79
K = math.sqrt(8.0) * EI**0.25 * RHO_A**0.75
KAPPA = 100.0


def scene(law: AbstractContactLaw, dt: float, duration: float, **changes: Any) -> Simulation:
    given = {"left": INFINITE, "right": INFINITE, "model": Continuous(), "resistance": K, "x": 1.0, **changes}
    mass, x, model = given.pop("resistance") / KAPPA, given.pop("x"), given.pop("model")
    beam = Beam("beam", (SEGMENT,), **given)
    return struck(beam, model, law, None, StepRule(dt=dt), mass=mass, x=x, duration=duration)


@pytest.mark.parametrize(
    ("law", "within"), [(AdditionDeletion(), 1e-6), (DispersiveIdentification(), 1e-3)], ids=["positions", "velocities"]
)
@pytest.mark.parametrize("tip", [False, True])
def test_a_hard_mass_slows_down_by_the_closed_form(tip: bool, law: AbstractContactLaw, within: float) -> None:
    """v/v0 = e^(kappa^2 t) erfc(kappa sqrt t); at a free tip of a beam that goes on one way K is a quarter of it."""
    changes = {"left": FREE, "x": 0.0, "resistance": 0.25 * K} if tip else {}
    history = run(*scene(law, 1e-8, 1e-3, **changes))
    known = (0.896457, 0.723578, 0.427584, 0.170578)
    for t, value in zip((1e-6, 1e-5, 1e-4, 1e-3), known, strict=True):
        assert erfcx(KAPPA * math.sqrt(t)) == pytest.approx(value, abs=5e-7)
        exact = erfcx(KAPPA * math.sqrt(t))
        assert history.evaluate([t], "velocity:hammer")[0] == pytest.approx(exact, abs=within)
    # The force falls from infinity: K v0/sqrt(pi t) less what the mass has lost by then, 2 % at kappa^2 t = 1e-4.
    force = history.evaluate([1e-8 * 100.5], f"force:{history.scene.contacts[0].name}")[0]
    assert force == pytest.approx(0.25**tip * K / math.sqrt(math.pi * 1e-6), rel=0.2)


@pytest.mark.parametrize(
    ("law", "order", "slack"), [(AdditionDeletion(), 2.0, 0.4), (DispersiveIdentification(), 1.0, 0.1)]
)
def test_orders_of_a_hard_contact(law: AbstractContactLaw, order: float, slack: float) -> None:
    """Second where the law holds positions, first where it holds velocities: the force is singular at t = 0."""
    exact = erfcx(KAPPA * math.sqrt(1e-5))
    steps = (1e-6, 5e-7, 2.5e-7)
    errors = [run(*scene(law, dt, 1e-5)).evaluate([1e-5], "velocity:hammer")[0] - exact for dt in steps]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(slopes - order) < slack)


def built(left: End = INFINITE, dt: float = 1e-7) -> tuple[InfiniteBeam, Any]:
    beam = Beam("beam", (SEGMENT,), left, INFINITE)
    model = InfiniteBeam(beam, 0.0, (Face(0.0, 0, math.nan),))
    return model, model.stepper(np.ones((1, 1)), dt)


def test_a_constant_force_has_the_exact_response_over_decades() -> None:
    """v = 2 F sqrt(t/pi)/K, u its integral: the trapezoidal rule in ln p with spacing 1/2 errs by 1e-8."""
    dt, count = 1e-7, 5_000
    _, stepper = built(dt=dt)
    state, answer = stepper.state.copy(), stepper.force_response[0]
    for step in range(1, count + 1):
        stepper.free(stepper.parameters, state)
        state += 3.0 * answer
        if step in (1, 2, 10, 1000, count):
            t = step * dt
            assert state[1] == pytest.approx(6.0 * math.sqrt(t / math.pi) / K, rel=1e-7)
            # The modes that fade faster than a thousandth of a step give nothing back: 3e-5 of the first step.
            assert state[0] == pytest.approx(4.0 * t * math.sqrt(t / math.pi) / K, rel=1e-4 / step + 1e-7)


def test_it_gives_back_no_more_than_it_was_given() -> None:
    """Whatever the forces: the work done on it is never negative, and at least what its memory holds."""
    rng = np.random.default_rng(3)
    _, stepper = built()
    n = int(stepper.parameters[0])
    weight = stepper.parameters[5 : 5 + n]
    for rough in (0.0, 0.9, 0.999):
        state, force, out = stepper.state.copy(), 0.0, np.zeros(4)
        for _ in range(2000):
            stepper.free(stepper.parameters, state)
            force = rough * force + rng.normal()
            state += force * stepper.force_response[0]
            stepper.measure(stepper.parameters, state, out)
            held = 0.5 * float(weight @ state[8:] ** 2) / K  # masses K/w with momenta q
            assert out[0] >= held * (1.0 - 1e-9) > 0.0


def test_a_long_finite_beam_gives_the_same_until_something_comes_back() -> None:
    """Hertz contact: its force holds frequencies up to 1e5 rad/s, whose waves need 1 ms for 2 m: 250 us are free."""
    law = Hertz(stiffness=1.58e10)
    infinite = run(*scene(law, 2.5e-7, 2.5e-4))
    ends = {"left": FREE, "right": FREE, "model": FiniteElement(elements=800)}
    finite = run(*scene(law, 2.5e-7, 2.5e-4, **ends))
    t = np.linspace(0.0, 2.5e-4, 300)
    # Steps of 1/600 of the contact: (w dt)^2/12 of both schemes, and h^4 of the mesh, stay below 1e-3.
    for channel in ("velocity:hammer", "displacement:beam@1"):
        one, other = infinite.evaluate(t, channel), finite.evaluate(t, channel)
        assert_allclose(one, other, atol=1e-3 * float(np.max(np.abs(other))))
    assert infinite.contacts[0].peak_force == pytest.approx(finite.contacts[0].peak_force, rel=1e-3)
    # All that left the mass is in the beam, and its momentum is what the contact gave.
    book = infinite.energy
    assert max(book.largest_gain, book.largest_loss) < 1e-9
    momentum = infinite.evaluate([2.5e-4], "momentum:beam")[0]
    assert momentum == pytest.approx(sum(span.impulse for span in infinite.contacts), rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"left": End("pinned")}, "the ends of 'beam' are pinned and infinite"),
        ({"left": FREE}, "struck at 1 m; its motion is known at its free tip, 0 m"),
        ({"segments": (SEGMENT, SEGMENT)}, "does not support a second segment"),
        ({"tension": 10.0}, "does not support tension"),
        ({"damping": Rayleigh(1.0)}, "does not support damping"),
        ({"displacement": np.sin}, "does not support displacement at t = 0"),
    ],
)
def test_unsupported_parts_are_refused(changes: dict[str, Any], told: str) -> None:
    case = scene(DispersiveIdentification(), 1e-7, 1e-5)
    beam = dataclasses.replace(case.scene.bodies["beam"], **changes)
    with pytest.raises(ImpactlabError, match=told) as caught:
        prepare(*case.but(bodies={**case.scene.bodies, "beam": beam}))
    assert caught.value.remedy


def test_other_places_gravity_and_impulses_are_refused() -> None:
    case = scene(DispersiveIdentification(), 1e-7, 1e-5)
    with pytest.raises(ImpactlabError, match="has weight, and has an infinite end"):
        prepare(*case.but(gravity=-9.81))
    with pytest.raises(ImpactlabError, match=r"no displacement at 0\.7 m"):
        run(*case.but(probes=(Probe("beam", 0.7, "displacement"),)))
    with pytest.raises(ImpactlabError, match="strike on a continuous beam is zero"):
        prepare(*scene(ImpulseMomentum(), 1e-7, 1e-5))


PILE = """
schema_version: 1
bodies:
  hammer: {{kind: mass, mass: 2.133, velocity: 1.0}}
  rod: {{kind: rod, length: 0.3, area: 9 cm^2, material: {{young: 210 GPa, density: 7900}}, ends: {{right: infinite}}}}
contacts: [{{between: [hammer, rod.left], law: {law}}}]
solve: {{duration: {{round_trips: 3}}, {solve}}}
"""
FINE = "model: {kind: finite_element, elements: 400, mass: lumped}, integrator: {kind: central_difference}, "


@pytest.mark.parametrize(
    ("law", "solve", "within"),
    [
        ("{kind: wave_identification}", "model: {kind: continuous}", 1e-12),
        # Lumped elements at h/c carry the wave exactly; the mass is of second order in 1/400 of the length.
        ("{kind: addition_deletion}", FINE + "step: {courant: 1.0}", 2e-4),
    ],
)
def test_nothing_comes_back_in_a_rod_that_goes_on(tmp_path: Path, law: str, solve: str, within: float) -> None:
    """A mass on a semi-infinite rod slows down as e^(-Z t/M); the energy it lost has left through the end, or is on
    its way: what passed it within the last L/c."""
    file = tmp_path / "pile.yaml"
    file.write_text(PILE.format(law=law, solve=solve), encoding="utf-8")
    case = il.load_case(file)
    history = il.run(case)
    trip = case.scene().round_trip
    t = np.linspace(0.01, 3.0, 50) * trip  # at once the impulse of the end node's mass acts
    assert_allclose(history.evaluate(t, "velocity:hammer"), np.exp(-2.0 * t / trip), atol=within)
    book = history.energy
    lost = 0.5 * 2.133 * (1.0 - math.exp(-4.0 * (3.0 - 0.5)))
    assert book.booked["ends"][-1] == pytest.approx(lost, rel=max(1e-2 * (within > 1e-6), 1e-9))


def sent_back(lumped: bool, wave: float, duration: float, elements: int) -> float:
    """Return the reflection of a wave of ``wave`` elements in an Euler-Bernoulli beam of 1 m, for runs of a duration.

    The free tip of a mesh is shaken; of the deflections between 0.2 L and 0.9 L the parts e^(-ikx), e^(ikx), e^(-kx),
    e^(kx) are fitted.
    """
    body = Beam("beam", (dataclasses.replace(SEGMENT, length=1.0),), FREE, INFINITE)
    mesh = BeamMesh(body, elements, "lumped" if lumped else "consistent", 0.0, duration=duration)
    k = 2.0 * math.pi * elements / wave
    omega = k**2 * math.sqrt(EI / RHO_A)
    n = mesh.stiffness.shape[1]
    bands = np.zeros((7, n), complex)
    for matrix, factor in ((mesh.stiffness, 1.0), (mesh.damping, 1j * omega), (mesh.mass, -(omega**2))):
        for i, band in enumerate(matrix):
            bands[3 + i, : n - i] += factor * band[: n - i]
            bands[3 - i, i:] += factor * band[: n - i] * (i > 0)
    answer = solve_banded((3, 3), bands, mesh.row(0.0, "displacement"))
    inside = slice(int(0.2 * elements), int(0.9 * elements))
    x, w = mesh.nodes[inside], answer[::2][inside]
    waves_of = np.array([np.exp(-1j * k * x), np.exp(1j * k * (x - 1.0)), np.exp(-k * x), np.exp(k * (x - 1.0))])
    parts = np.linalg.lstsq(waves_of.T, w, rcond=None)[0]
    return float(abs(parts[1] / parts[0]))


@pytest.mark.parametrize(("lumped", "most"), [(False, 5e-4), (True, 3e-3)])
@pytest.mark.parametrize("elements", [20, 200])
@pytest.mark.parametrize("duration", [1e-3, 1.0])
def test_the_reflection_of_the_layer_of_a_mesh(lumped: bool, most: float, elements: int, duration: float) -> None:
    """Waves of 9 elements up to those that run twice the layer in the duration, 2 l = 2 k sqrt(EI/(rho A)) t."""
    spread = (EI / RHO_A) ** 0.25 * math.sqrt(duration)
    length = max(2.0, 16.0 * spread)
    longest = 2.0 * math.pi * elements * spread**2 / length
    waves = [wave for wave in (9.0, 15.0, 40.0, 150.0, 400.0) if wave <= min(longest, 3.0 * elements)]
    for wave in waves or [9.0]:
        assert sent_back(lumped, wave, duration, elements) < (most if waves else 1e-2), wave


RESTING = """
schema_version: 1
bodies:
  m: {{kind: mass, mass: 2.0, velocity: 1.0}}
  b:
    kind: beam
    length: 0.4
    section: {{width: 0.01, height: 0.01}}
    material: {{young: 2.1e11, density: 7850}}
    ends: {{left: {left}, right: infinite}}
contacts: [{{between: [m, b.at(0.2)], law: {{kind: hertz, stiffness: 1.0e7}}}}]
solve: {{duration: 0.05, {solve}}}
"""
BY_MESH = "model: {{kind: finite_element, elements: 60, mass: {}}}, integrator: {{kind: newmark}}, step: {{dt: 2.0e-5}}"


def long_run(tmp_path: Path, left: str, solve: str) -> Any:
    file = tmp_path / "resting.yaml"
    file.write_text(RESTING.format(left=left, solve=solve), encoding="utf-8")
    return il.run(il.load_case(file))


@pytest.mark.parametrize("solve", ["tolerance: 1.0e-3", BY_MESH.format("consistent"), BY_MESH.format("lumped")])
@pytest.mark.parametrize(
    ("left", "known"),
    # Meshes of 1520 elements on 30.4 m, free at the far end.
    [("clamped", (0.0023726, -0.0043709, -0.0178959)), ("pinned", (0.0070501, 0.0067820, 0.0025473))],
)
def test_long_runs_are_those_of_a_long_beam(tmp_path: Path, left: str, known: tuple[float, ...], solve: str) -> None:
    history = long_run(tmp_path, left, solve)
    moved = history.evaluate([0.0125, 0.025, 0.05], "position:m")
    assert_allclose(moved, known, atol=2e-4 * float(np.max(np.abs(known))))
    if "tolerance" in solve:
        assert history.choice is not None
        assert history.choice.met


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_a_heavy_mass_in_the_middle_slows_down_by_the_closed_form(tmp_path: Path, mass: str) -> None:
    """Its Hertzian contact is soft: after 12.5 ms it is 3e-3 behind the hard one, after 50 ms 1e-3."""
    history = long_run(tmp_path, "infinite", BY_MESH.format(mass))
    resistance = math.sqrt(8.0) * EI**0.25 * 0.785**0.75
    for t in (0.025, 0.05):
        exact = erfcx(resistance * math.sqrt(t) / 2.0)
        assert history.evaluate([t], "velocity:m")[0] == pytest.approx(exact, abs=1.5e-3)


def test_a_tolerance_below_the_reflection_of_a_layer_is_refused(tmp_path: Path) -> None:
    """All runs have it in common: it is known before the first of them."""
    with pytest.raises(ImpactlabError, match=r"keeps 2e-05: the best .* is about 5e-05, by [^0-9]*\n"):
        long_run(tmp_path, "pinned", "tolerance: 2.0e-5")


def test_a_layer_of_too_many_elements_is_refused(tmp_path: Path) -> None:
    solve = BY_MESH.format("lumped").replace("elements: 60", "elements: 20000")
    with pytest.raises(ImpactlabError, match=r"of 'b' must be 13\.8 m long .* Allowed: 20000") as caught:
        long_run(tmp_path, "clamped", solve)
    assert "shorter duration" in caught.value.remedy


def test_the_shortest_element_bounds_the_frequencies_of_a_mesh_between_layers() -> None:
    body = Beam("beam", (dataclasses.replace(SEGMENT, length=1.0),), INFINITE, INFINITE)
    one, plain = (
        BeamMesh(each, 40, "lumped", 0.0, duration=0.01).operators().highest_frequency
        for each in (body, dataclasses.replace(body, left=FREE, right=FREE))
    )
    assert one == pytest.approx(plain, rel=1e-9)


def struck_in_the_middle(body: Beam, integrator: Any, dt: float, duration: float) -> Simulation:
    law, middle = Hertz(stiffness=1.58e10), 0.5 * body.length
    return struck(body, None, law, integrator, StepRule(dt=dt), mass=0.0333, x=middle, duration=duration)


@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_a_mesh_with_layers_responds_like_the_infinite_beam(theory: str, mass: str) -> None:
    """The contact lasts 100 us; its waves, of 10 cm, would be back at the middle of 60 cm after 200 us."""
    model = FiniteElement(elements=240, mass=mass)  # type: ignore[arg-type]
    piece = (
        Beam("beam", (dataclasses.replace(SEGMENT, length=0.6),), INFINITE, INFINITE)
        if theory == "euler_bernoulli"
        else timoshenko(INFINITE, INFINITE, 0.6)
    )
    scheme, dt = (CentralDifference(), 2e-8) if mass == "lumped" else (Newmark(), 2e-7)
    mesh = run(*struck_in_the_middle(piece, scheme, dt, 5e-4).but(model=model))
    endless = run(*struck_in_the_middle(piece, None, 2e-7, 5e-4).but(model=Continuous()))
    t = np.linspace(0.0, 5e-4, 400)
    for channel in ("velocity:hammer", "velocity:beam@0.3"):
        one, other = mesh.evaluate(t, channel), endless.evaluate(t, channel)
        # Of the first step, in which the beam starts to move where it is struck; later 1e-3.
        assert np.max(np.abs(one - other)) < 5e-3 * np.max(np.abs(other)), channel
    assert max(mesh.energy.largest_gain, mesh.energy.largest_loss) < 1e-3
    # The energy that waves carried away is booked as damping.
    assert mesh.energy.booked["damping"][-1] > 0.0


@pytest.mark.parametrize("model", [FiniteElement(), Continuous(), Modal(elements=20)])
@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
def test_a_beam_that_moves_or_has_weight_has_no_infinite_end(theory: str, model: Any) -> None:
    body = Beam("beam", (SEGMENT,), INFINITE, INFINITE) if theory == "euler_bernoulli" else timoshenko(INFINITE)
    moving = dataclasses.replace(body, velocity=1.0, right=INFINITE)
    case = struck_in_the_middle(moving, Newmark(), 1e-6, 1e-5).but(model=model)
    with pytest.raises(PairingError, match="moves as a whole at t = 0, and has an infinite end") as caught:
        prepare(*case)
    assert "longer beam" in caught.value.remedy
    still = {**case.scene.bodies, moving.name: dataclasses.replace(moving, velocity=0.0)}
    with pytest.raises(PairingError, match="has weight, and has an infinite end"):
        prepare(*case.but(bodies=still, gravity=-9.81))


BENT = (
    ("1e-5*sin(pi*x)**2", "bending moment", EI * 2e-5 * math.pi**2),
    ("1e-5*x**3", "shear force", -EI * 6e-5),
    ("1e-7*x**2 + 1", "bending moment", EI * 2e-7),
)
STRAIGHT = "1e-4", "1e-4*(3 - 2*x)", "1e-5*exp(-((x - 0.5)/0.1)**2)", "1e-5*sin(10*pi*x)**4", "1 + 1e-5*sin(pi*x)**4"


@pytest.mark.parametrize(("shape", "quantity", "value"), BENT)
def test_a_beam_that_is_bent_at_an_infinite_end_is_refused(shape: str, quantity: str, value: float) -> None:
    """Its far part is straight: the moment and the shear force at the end would be let go."""
    with pytest.raises(ImpactlabError, match="would spring back") as caught:
        endless_beam(shape)
    found = re.search(rf"a {quantity} of (\S+) N.* at t = 0 at its infinite end \(left\)", str(caught.value))
    assert found is not None
    # Differences over 0.004 m of a deflection of 1 m are rounded, each of six to half a last digit.
    rounding = EI * sum(map(abs, CURVATURE)) * 2.0**-53 / BEND_STEPS[0] ** 2 if shape.endswith("+ 1") else 0.0
    assert float(found[1]) == pytest.approx(value, rel=1e-3, abs=rounding)
    assert caught.value.path == "bodies.beam.displacement"


@pytest.mark.parametrize("shape", STRAIGHT)
def test_a_beam_that_is_straight_at_its_infinite_ends_may_be_displaced(shape: str) -> None:
    assert "beam" in endless_beam(shape).scene().bodies


def endless_beam(displacement: str) -> il.Case:
    section, ends = {"width": 0.01, "height": 0.01}, {"left": "infinite", "right": "infinite"}
    beam = il.Beam(
        length=1.0, section=section, material={"young": 2.1e11, "density": 7900}, ends=ends, displacement=displacement
    )
    solve = in_steps(1e-3, "newmark", mesh(10), dt=1e-5)
    return il.Case(bodies={"beam": beam}, solve=solve)


def test_a_layer_under_tension_is_refused() -> None:
    body = Beam("beam", (SEGMENT,), INFINITE, INFINITE, tension=10.0)
    with pytest.raises(PairingError, match="has a tension"):
        prepare(*struck_in_the_middle(body, Newmark(), 1e-6, 1e-5).but(model=FiniteElement()))


ROD_SOLVES = (
    "tolerance: 1.0e-3",
    "model: {kind: continuous}",
    "model: {kind: finite_element}, integrator: {kind: newmark}",
    "model: {kind: modal, modes: 20}, integrator: {kind: newmark}",
)


@pytest.mark.parametrize("solve", ROD_SOLVES)
def test_a_rod_that_moves_or_has_weight_has_no_infinite_end(tmp_path: Path, solve: str) -> None:
    """Its dashpot would brake it: two half-infinite rods would push one another with Z v/2 for a trip alone."""
    file = tmp_path / "pile.yaml"
    given = PILE.format(law="{kind: addition_deletion}", solve=solve)

    def refused(*changes: tuple[str, str]) -> ImpactlabError:
        text = given
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        file.write_text(text, encoding="utf-8")
        with pytest.raises(ImpactlabError) as caught:
            il.run(il.load_case(file))
        return caught.value

    error = refused(("rod: {kind: rod,", "rod: {kind: rod, velocity: -1.0,"))
    assert error.path == "bodies.rod.velocity"
    assert "'rod' has velocity -1 m/s at t = 0 and an infinite end (right)" in str(error)
    assert "ends: {right: {dashpot: 36657.7}}" in error.remedy
    error = refused(("schema_version: 1", "schema_version: 1\ngravity: 9.81"))
    assert error.path == "bodies.rod.ends.right"
    assert "gravity acts on 'rod', which has an infinite end (right)" in str(error)
    error = refused(("rod: {kind: rod,", "rod: {kind: rod, displacement: 1e-5*x,"))
    assert error.path == "bodies.rod.displacement"
    assert "'rod' has a strain of 1e-05 at t = 0 at its infinite end (right)" in str(error)
    assert "ends: {right: {dashpot: 36657.7}}" in error.remedy
    # Allowed: a shape without slope at that end, what is given as a dashpot, and an infinite end of a rod at rest.
    shapes = "1e-5*cos(pi*x/L)", "1e-5", "1e-5*exp(-((x/L - 0.5)/0.05)**2)", "{x: [0, 0.1, 0.3], u: [0, 1e-5, 1e-5]}"
    for shape in shapes:
        text = given.replace("rod: {kind: rod,", f"rod: {{kind: rod, displacement: {shape},")
        file.write_text(text, encoding="utf-8")
        assert il.load_case(file).scene().bodies["rod"].displacement is not None
    law = "{kind: penalty, stiffness: 1.0e9}"
    held = ("ends: {right: infinite}", "velocity: -1.0, ends: {right: {dashpot: 36657.7}}")
    for text in (given, given.replace(*held)):
        file.write_text(text.replace("{kind: addition_deletion}", law), encoding="utf-8")
        assert il.load_case(file).scene().bodies["rod"].right.kind == "dashpot"


@pytest.mark.parametrize(
    ("end", "named"), [("infinite", "the infinite end (right)"), ("{dashpot: 1.0e4}", "the dashpot at the right end")]
)
def test_modes_name_the_end_that_they_cannot_hold(tmp_path: Path, end: str, named: str) -> None:
    file = tmp_path / "pile.yaml"
    given = PILE.format(law="{kind: addition_deletion}", solve=ROD_SOLVES[-1])
    file.write_text(given.replace("right: infinite", f"right: {end}"), encoding="utf-8")
    with pytest.raises(PairingError) as caught:
        il.run(il.load_case(file))
    assert f"model 'modal' does not support {named} of 'rod'" in str(caught.value)
