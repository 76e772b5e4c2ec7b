"""The infinite Euler-Bernoulli beam against closed forms and finite beams; infinite ends of rods and meshes."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import erfcx

import impactlab as il
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
from impactlab.numerics.banded import full
from impactlab.scene import Beam, BeamSegment, End, Probe, Rayleigh
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import prepare, run
from impactlab.testing.scenes import struck
from tests.reference.test_timoshenko_waves import beam as timoshenko

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


def test_a_constant_force_is_answered_exactly_over_decades() -> None:
    """v = 2 F sqrt(t/pi)/K, u its integral: the trapezoidal rule in ln p with spacing 1/2 errs by 1e-8."""
    dt, count = 1e-7, 20_000
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
def test_what_it_does_not_know_is_refused(changes: dict[str, Any], told: str) -> None:
    case = scene(DispersiveIdentification(), 1e-7, 1e-5)
    beam = dataclasses.replace(case.scene.bodies["beam"], **changes)
    with pytest.raises(ImpactlabError, match=told) as caught:
        prepare(*case.but(bodies={**case.scene.bodies, "beam": beam}))
    assert caught.value.remedy


def test_other_places_gravity_and_impulses_are_refused() -> None:
    case = scene(DispersiveIdentification(), 1e-7, 1e-5)
    with pytest.raises(ImpactlabError, match="does not support gravity"):
        prepare(*case.but(gravity=-9.81))
    with pytest.raises(ImpactlabError, match=r"not by displacement at 0\.7 m"):
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


def sent_back(lumped: bool, waves: float, elements: int = 100) -> float:
    """Return the reflection of a wave of number ``waves``/l in an Euler-Bernoulli beam, l the length of its layer.

    The free tip of a mesh is shaken; of the deflections between 0.4 L and 0.9 L the parts e^(-ikx), e^(ikx), e^(-kx),
    e^(kx) are fitted.
    """
    mesh = BeamMesh(
        Beam("beam", (dataclasses.replace(SEGMENT, length=1.0),), FREE, INFINITE),
        elements, "lumped" if lumped else "consistent", 0.0,
    )  # fmt: skip
    k = waves / 2.0
    omega = k**2 * math.sqrt(EI / RHO_A)
    system = full(mesh.stiffness) + 1j * omega * full(mesh.damping) - omega**2 * full(mesh.mass)
    answer = np.linalg.solve(system, mesh.row(0.0, "displacement"))
    x = mesh.nodes[int(0.4 * elements) : int(0.9 * elements)]
    w = answer[::2][int(0.4 * elements) : int(0.9 * elements)]
    waves_of = np.array([np.exp(-1j * k * x), np.exp(1j * k * (x - 1.0)), np.exp(-k * x), np.exp(k * (x - 1.0))])
    parts = np.linalg.lstsq(waves_of.T, w, rcond=None)[0]
    return float(abs(parts[1] / parts[0]))


@pytest.mark.parametrize(
    ("lumped", "waves", "most"),
    [
        (False, 8.0, 3e-2),
        (False, 10.0, 1e-2),
        (False, 15.0, 3e-3),
        (False, 20.0, 1e-3),
        (False, 60.0, 1e-3),
        (True, 10.0, 6e-2),
        (True, 15.0, 1e-2),
        (True, 40.0, 1e-2),
    ],
)
def test_what_the_layer_of_a_mesh_sends_back(lumped: bool, waves: float, most: float) -> None:
    assert sent_back(lumped, waves) < most


def struck_in_the_middle(body: Beam, integrator: Any, dt: float, duration: float) -> Simulation:
    law, middle = Hertz(stiffness=1.58e10), 0.5 * body.length
    return struck(body, None, law, integrator, StepRule(dt=dt), mass=0.0333, x=middle, duration=duration)


@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_a_mesh_with_layers_answers_like_the_infinite_beam(theory: str, mass: str) -> None:
    """The contact lasts 100 us; its waves, of 10 cm, would be back at the middle of 60 cm after 200 us."""
    model = FiniteElement(elements=240, mass=mass)  # type: ignore[arg-type]
    piece = (
        Beam("beam", (dataclasses.replace(SEGMENT, length=0.6),), INFINITE, INFINITE)
        if theory == "euler_bernoulli"
        else timoshenko(INFINITE, INFINITE, 0.6)
    )
    scheme, dt = (CentralDifference(), 2e-8) if mass == "lumped" else (Newmark(), 2e-7)
    mesh = run(*struck_in_the_middle(piece, scheme, dt, 1e-3).but(model=model))
    endless = run(*struck_in_the_middle(piece, None, 2e-7, 1e-3).but(model=Continuous()))
    t = np.linspace(0.0, 1e-3, 400)
    for channel in ("velocity:hammer", "velocity:beam@0.3"):
        one, other = mesh.evaluate(t, channel), endless.evaluate(t, channel)
        # 3e-3 of the largest: 1 % of the low end of the spectrum comes back, and mesh and steps err by 1e-3.
        assert np.max(np.abs(one - other)) < (1e-2 if mass == "lumped" else 5e-3) * np.max(np.abs(other)), channel
    assert max(mesh.energy.largest_gain, mesh.energy.largest_loss) < 1e-3
    # The energy that waves carried away is booked as damping.
    assert mesh.energy.booked["damping"][-1] > 0.0


def test_a_beam_that_moves_or_has_weight_has_no_layer() -> None:
    case = struck_in_the_middle(Beam("beam", (SEGMENT,), INFINITE, INFINITE, velocity=1.0), Newmark(), 1e-6, 1e-5).but(
        model=FiniteElement()
    )
    with pytest.raises(PairingError, match="moves as a whole"):
        prepare(*case)
    still = {**case.scene.bodies, "beam": dataclasses.replace(case.scene.bodies["beam"], velocity=0.0)}
    with pytest.raises(PairingError, match="has weight"):
        prepare(*case.but(bodies=still, gravity=-9.81))
