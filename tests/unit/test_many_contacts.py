"""Several contacts at once, and scenes at the edge: what a review found, named after the symptom."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.penalty import Penalty
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.errors import PairingError
from impactlab.history import AbstractHistory, ContactSpan
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.contact_stabilised_newmark import ContactStabilisedNewmark
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.metrics.grazing import MAX_RUN_SAMPLES, near_grazing
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import End, Mass, Probe, Rod, Wall
from impactlab.scene.facts import RoundTrip
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import prepare, run
from impactlab.testing.scenes import CLAMPED, FREE, UNIT, in_a_row, simulation, struck
from impactlab.types import Array
from tests.unit.synthetic import SyntheticHistory

MILLI = StepRule(dt=1e-3)


def row_of_masses(count: int, law: AbstractContactLaw, integrator: AbstractIntegrator) -> Simulation:
    """Return unit masses that touch each other, the first one moving at 1 m/s."""
    masses = [Mass(f"m{i}", 1.0, 1.0 if i == 0 else 0.0) for i in range(count)]
    return in_a_row(masses, None, law, integrator, MILLI, duration=5e-3)


def velocities(history: AbstractHistory, count: int) -> list[float]:
    return [float(history.evaluate(history.duration, f"velocity:m{i}")) for i in range(count)]


@pytest.mark.parametrize("integrator", [Newmark(), CentralDifference(), ExactModal()])
def test_coupled_elastic_kicks_keep_the_energy(integrator: AbstractIntegrator) -> None:
    """Three touching masses: impulses 4/3 and 2/3, velocities -1/3, 2/3, 2/3 (restitution where there was approach)."""
    history = run(*row_of_masses(3, ImpulseMomentum(1.0), integrator))
    assert velocities(history, 3) == pytest.approx([-1 / 3, 2 / 3, 2 / 3], abs=1e-12)
    assert history.energy.largest_gain < 1e-12
    assert history.energy.largest_loss < 1e-12


@pytest.mark.parametrize("law", [ImpulseMomentum(0.0), AdditionDeletion()])
def test_a_plastic_row_books_its_loss_once(law: AbstractContactLaw) -> None:
    history = run(*row_of_masses(3, law, Newmark()))
    assert velocities(history, 3) == pytest.approx([1 / 3] * 3, abs=1e-12)
    assert history.energy.booked["contact"][-1] == pytest.approx(1 / 3, rel=1e-12)
    assert history.energy.largest_gain < 1e-12


@pytest.mark.parametrize("count", [10, 20])
def test_a_long_row_is_solved_to_rounding(count: int) -> None:
    history = run(*row_of_masses(count, AdditionDeletion(), Newmark()))
    # Sweeps stop when an answer changes by less than 1e-15 of the largest; the row's slowest mode adds up n^2 of that.
    assert velocities(history, count) == pytest.approx([1 / count] * count, abs=1e-11)


def test_many_located_contacts_come_to_an_end() -> None:
    """Fourteen contacts once filled the room for events before the first step, and the run never moved."""
    history = run(*row_of_masses(15, ImpulseMomentum(0.0), ExactModal()).but(events="located"))
    assert history.cost.steps == 5


def test_located_events_refuse_a_delay_line() -> None:
    rods = [Rod(name, (UNIT,), FREE, FREE, velocity=v) for name, v in (("a", 1.0), ("b", 0.0))]
    models = {"a": Modal(None, 5), "b": Continuous()}
    scene = in_a_row(rods, models, Penalty(), ExactModal(), MILLI, gaps=1e-2, events="located")
    with pytest.raises(PairingError, match="the continuous rod 'b' has one step length"):
        prepare(*scene)


@pytest.mark.parametrize("end", [End("mass", 1.0), End("dashpot", 1.0), End("spring", 1.0)], ids=lambda end: end.kind)
def test_wave_identification_refuses_a_face_that_carries_something(end: End) -> None:
    scene = struck(
        Rod("rod", (UNIT,), end, CLAMPED), FiniteElement(10), WaveIdentification(), Newmark(), MILLI, mass=1.0
    )
    with pytest.raises(
        PairingError, match=f"needs a struck end without support or force, and that of 'rod' has a {end.kind}"
    ):
        prepare(*scene)


def test_a_snapshot_at_the_very_end_is_taken() -> None:
    rod = Rod("rod", (UNIT,), FREE, FREE, velocity=1.0)
    scene = simulation(
        "x", {"rod": rod}, (), 1e-4, Newmark(), StepRule(dt=1e-6), snapshots=(0.0, 1e-4), model=FiniteElement(4)
    )
    field = run(*scene).field("rod", 1e-4, "displacement")
    assert field.values == pytest.approx(np.full(5, 1e-4), rel=1e-12)


@pytest.mark.parametrize("model", [FiniteElement(40), Modal(None, 10)])
def test_a_rod_let_go_of_from_rest_keeps_no_momentum_and_that_is_no_fault(model: FiniteElement | Modal) -> None:
    rod = Rod("rod", (UNIT,), FREE, FREE, displacement=lambda x: 1e-6 * x * x)
    history = run(*simulation("x", {"rod": rod}, (), 3.0, Newmark(), StepRule(points_per_period=10), model=model))
    assert abs(float(history.evaluate(3.0, "momentum:rod"))) < 1e-16


def test_a_heavy_mass_that_falls_from_rest_gains_no_energy() -> None:
    bodies = Mass("ball", 1e6), Wall("stop")
    history = run(*in_a_row(bodies, None, Penalty(1e9), Newmark(), MILLI, gaps=1.0, duration=0.1, gravity=9.81))
    assert float(history.evaluate(0.1, "velocity:ball")) == pytest.approx(0.981, rel=1e-12)
    [warned] = [each for each in history.warnings if each.code == "no_contact"]
    assert "the faces never met; the smallest gap was 0.95095 m" in warned.text


def test_leapfrog_velocities_stand_at_their_own_instants_also_at_the_start() -> None:
    rod = Rod("rod", (UNIT,), FREE, CLAMPED, displacement=lambda x: np.cos(np.pi * x / 2))
    probe = Probe("rod", 0.0, "velocity")
    scene = simulation(
        "x",
        {"rod": rod},
        (),
        0.5,
        CentralDifference(),
        StepRule(courant=0.5),
        probes=(probe,),
        model=FiniteElement(50, "lumped"),
    )
    history = run(*scene)
    times = np.array([0.0, 0.1, 0.3])
    exact = -0.5 * np.pi * np.sin(0.5 * np.pi * times)
    # Second order in dt = 0.01 and h = 0.02; half a step late would be 0.012.
    assert history.evaluate(times, probe.channel) == pytest.approx(exact, abs=5e-4)


def test_faces_that_part_at_both_ends_agree_on_their_projections() -> None:
    """Without forces one sweep was taken for agreement: 1e-4 of the energy were gained where a large step couples ends.

    The scheme keeps energy but for what projections take, which is booked: 1e-12 is the rounding of some ten steps.
    """
    bodies = Mass("m0", 1.0, 1.0), Rod("rod", (UNIT,), FREE, FREE), Mass("m1", 1.0, -1.0)
    scheme, rule = ContactStabilisedNewmark(), StepRule(courant=4.0)
    history = run(*in_a_row(bodies, FiniteElement(10), AdditionDeletion(), scheme, rule))
    assert history.contacts[0].end is not None
    assert history.energy.largest_gain < 1e-12
    assert history.energy.largest_loss < 1e-12


def test_long_flights_between_many_contacts_take_a_bounded_number_of_samples() -> None:
    """The search for missed contacts took 512 samples of each round trip: sixty times as long as the exact solution."""
    flights, lasts, taken = 4000, 20.0, 0

    def gap(t: Array) -> Array:
        nonlocal taken
        taken += t.size
        return np.asarray(np.abs(np.sin(np.pi * t / lasts)))

    spans = tuple(ContactSpan("a|b", lasts * n, lasts * n + 0.1, 1.0, 1.0) for n in range(flights))
    history = SyntheticHistory(
        lasts * flights, {"gap:a|b": gap}, contacts=spans, simulation=row_of_masses(2, Penalty(1e4), Newmark())
    )
    assert near_grazing(history, "a|b", RoundTrip(1.0, "a")) is None
    assert taken <= 2 * (MAX_RUN_SAMPLES + 32 * flights)  # for both signs; 8e7 without the bound
