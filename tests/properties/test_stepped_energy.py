"""Energy: lossless pairings keep it to rounding, the others stay within the bound that they declare."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from impactlab.bases.craig_bampton import CraigBampton
from impactlab.bases.substructured import Substructured
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.penalty import Penalty
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.integrators.bathe import Bathe
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.contact_stabilised_newmark import ContactStabilisedNewmark
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.generalised_alpha import GeneralisedAlpha
from impactlab.integrators.hht_alpha import HhtAlpha
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.integrators.newmark import Newmark
from impactlab.integrators.nonsmooth_generalised_alpha import NonsmoothGeneralisedAlpha
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import End, Rod, Segment, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import prepare
from impactlab.simulate.planning.pairing import energy_bound
from impactlab.testing.scenes import CLAMPED, FREE, STEEL, UNIT, in_a_row, mass_on_rod, simulation
from impactlab.testing.strategies import log_uniform, scenes
from impactlab.testing.trace import run_sampled, trace
from impactlab.types import Relative

penalties = st.builds(
    Penalty,
    stiffness=st.builds(Relative, log_uniform(1e-2, 10.0)),
    damping=st.one_of(st.just(0.0), st.builds(Relative, log_uniform(1e-2, 10.0))),
)
impulses = st.builds(ImpulseMomentum, restitution=st.floats(0.0, 1.0))

# Each contact and 300 steps: a few hundred roundings of energies of the size of the initial one, and as many of the
# work of gravity. Seen: 2e-13.
ROUNDING = 2e-12


@settings(max_examples=20)
@given(scenes(laws=st.one_of(penalties, impulses), integrators=st.sampled_from([Newmark(), ExactModal()])))
def test_lossless_pairings_gain_no_energy(scene: Simulation) -> None:
    book = run_sampled(scene).energy
    assert book.largest_gain < ROUNDING * book.rounding


@settings(max_examples=15)
@given(scenes(laws=st.just(Penalty(stiffness=Relative(1.0))), integrators=st.sampled_from([Newmark(), ExactModal()])))
def test_undamped_penalty_neither_gains_nor_loses(scene: Simulation) -> None:
    book = run_sampled(scene).energy
    assert max(book.largest_gain, book.largest_loss) < 2.0 * ROUNDING * book.rounding


@settings(max_examples=20)
@given(scenes())
def test_booked_losses_never_fall(scene: Simulation) -> None:
    book = run_sampled(scene).energy
    for values in book.booked.values():
        assert (values[1:] >= values[:-1]).all()
        assert (values >= 0.0).all()


@settings(max_examples=20)
@given(
    scenes(
        laws=st.builds(Penalty, stiffness=st.builds(Relative, log_uniform(1e-3, 1.0))),
        integrators=st.just(CentralDifference()),
    )
)
def test_central_difference_gains_within_its_bound(scene: Simulation) -> None:
    traced = trace(scene)
    ports = traced.history.assembly.memory.ports
    # The contact is an oscillator of its own: its step (w dt)^2 must be small, or it gains (docs/bounds.md).
    assume(ports["gap_per_force"][0] * ports["parameters"][0, 0] < 0.02)
    assert traced.history.energy.largest_gain <= energy_bound(*scene, CentralDifference())


def models_of_bars() -> st.SearchStrategy[AbstractRodModel]:
    """Return models of 2-node bars, and modes that are not Ritz vectors."""
    mass, elements = st.sampled_from(["consistent", "lumped"]), st.integers(2, 40)
    bases = st.sampled_from([CraigBampton(), Substructured(pieces=2, others=1)])
    return st.one_of(
        st.builds(FiniteElement, elements, mass),
        elements.flatmap(lambda n: st.builds(Modal, st.just(n), st.one_of(st.none(), st.integers(1, n - 1)), mass)),
        st.builds(Modal, st.none(), st.integers(1, 40)),
        st.builds(Modal, st.integers(10, 40), st.integers(4, 9), basis=bases),
    )


# Measured on uniform rods of 2-node bars. With two segments on two elements, on spectral elements (gains up to 1.1
# seen) or on four Ritz vectors (2.2 seen), a gain beyond the bound ends the run as failed.
@settings(max_examples=20)
@given(
    scenes(
        laws=st.just(WaveIdentification()),
        integrators=st.sampled_from([Newmark(), ExactModal()]),
        models=models_of_bars(),
        gravity=False,
        most_segments=1,
    )
)
def test_wave_identification_gains_within_its_bound(scene: Simulation) -> None:
    assert scene.method.integrator is not None
    assert run_sampled(scene).energy.largest_gain <= energy_bound(*scene, scene.method.integrator)


@settings(max_examples=15)
@given(
    scenes(
        laws=st.just(AdditionDeletion()),
        integrators=st.just(CentralDifference()),
        gravity=False,
        far=("free", "clamped"),
    )
)
def test_hard_contact_under_central_difference_gains_nothing(scene: Simulation) -> None:
    book = run_sampled(scene).energy
    assert book.largest_gain < ROUNDING * book.rounding


def struck(
    model: AbstractRodModel, law: AbstractContactLaw, alpha: float, far: str, points: float, trips: float = 3.0
) -> Simulation:
    step, right = StepRule(points_per_period=points), End(far)  # type: ignore[arg-type]
    return mass_on_rod(model, law, Newmark(), step, right=right, mass_ratio=1.0 / alpha, round_trips=trips)


@pytest.mark.parametrize("far", ["clamped", "free"])
@pytest.mark.parametrize("alpha", [1e-3, 1e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0])
@pytest.mark.parametrize(
    "model", [Modal(None, 10), Modal(None, 40), Modal(100, 10), Modal(100, 40), Modal(40, 20), Modal(40, 40)]
)
def test_wave_identification_with_ten_modes_gains_less_than_one_percent(
    model: AbstractRodModel, alpha: float, far: str
) -> None:
    for points in (10.0, 20.0):
        assert run_sampled(struck(model, WaveIdentification(), alpha, far, points)).energy.largest_gain < 0.01


def periodic_bar(elements: int, courant: float) -> Simulation:
    rod = Rod("rod", (UNIT,), FREE, CLAMPED, displacement=lambda x: (1.0 - x) / 2.0)
    # Its free motion takes four transits for a period; with the wall at rest position it returns after three.
    step = StepRule(courant=courant)
    return in_a_row((Wall("wall"), rod), FiniteElement(elements), AdditionDeletion(), Newmark(), step, duration=12.0)


@pytest.mark.parametrize("elements", [25, 50, 100])
def test_newmark_with_a_hard_constraint_is_the_known_exception(elements: int) -> None:
    scene = periodic_bar(elements, 0.25)
    assert run_sampled(scene).energy.largest_gain > 1.0
    assert math.isinf(energy_bound(*scene, Newmark()))
    assert [warned.code for warned in prepare(*scene).warnings] == ["constraint_energy"]


@pytest.mark.parametrize("alpha", [0.1, 0.3])
def test_wave_identification_with_as_many_modes_as_elements_gains_more_where_they_are_few(alpha: float) -> None:
    # The stress of the first element stands for that at the messenger: measured 1.9 % at 10/10 and 0.95 % at 20/20.
    gains = [
        run_sampled(struck(Modal(n, n), WaveIdentification(), alpha, "clamped", 10.0)).energy.largest_gain
        for n in (10, 20)
    ]
    assert gains[0] < 0.02
    assert gains[1] < 0.0105


def test_touch_late_in_a_step_under_a_damped_penalty_gains_no_energy() -> None:
    scene = struck(FiniteElement(30), Penalty(Relative(1.0), Relative(0.3)), 1.0, "clamped", 20.0)
    # Energies of 2000 steps, each rounded once.
    assert run_sampled(scene).energy.largest_gain < 2000 * 2.3e-16


def test_strongly_damped_contact_that_lets_go_while_pressed_gains_no_energy() -> None:
    piece = Segment(6.5, 7e-5, 1.2e8, 850.0)
    rods = [Rod(name, (piece,), FREE, FREE, velocity) for name, velocity in (("striker", 0.45), ("rod", 0.0))]
    models = {"striker": Modal(None, 1), "rod": Modal(2, 1)}
    law, step = Penalty(Relative(0.4), Relative(3.0)), StepRule(points_per_period=8.9)
    scene = in_a_row(rods, models, law, Newmark(), step)
    # Once it gained 7e-4 here. Some hundred steps, each rounded a few times.
    assert run_sampled(scene).energy.largest_gain < 1e-13


def test_free_rod_far_from_home_keeps_its_energy() -> None:
    # Springs must act on differences: with K u of the whole travel 5e-10 of the energy was lost in rounding.
    rod = Rod("rod", (STEEL,), FREE, FREE, velocity=1.0, displacement=lambda x: 1e-5 * x**2)
    mesh, step, duration = FiniteElement(100, "lumped"), StepRule(courant=0.5), 20.0 * rod.round_trip
    for integrator in (Newmark(), CentralDifference()):
        scene = simulation("far", {"rod": rod}, (), duration, integrator, step, model=mesh)
        book = run_sampled(scene).energy
        # 4000 steps, 100 coordinates; rounding of the energy's own sum, 100 eps, and a walk of 4000 steps.
        assert max(book.largest_gain, book.largest_loss) < 4e-13 * book.rounding


thetas = st.builds(MoreauJean, theta=st.floats(0.5, 1.0))
conserving = st.sampled_from([Midpoint(), ContactStabilisedNewmark(), NonsmoothGeneralisedAlpha(1.0), HhtAlpha(0.0)])
composite = st.builds(Bathe, first_part=st.floats(0.2, 0.8))


@settings(max_examples=20)
@given(scenes(laws=st.one_of(penalties, impulses), integrators=st.one_of(conserving, thetas, composite)))
def test_these_gain_nothing_with_springs_dashpots_and_kicks(scene: Simulation) -> None:
    # A step that never gains energy under a constant load, taken about the load's own rest, gives F times the path.
    book = run_sampled(scene).energy
    assert book.largest_gain < ROUNDING * book.rounding


@settings(max_examples=20)
@given(scenes(laws=st.just(Penalty(Relative(1.0))), integrators=conserving))
def test_conserving_schemes_lose_nothing_either(scene: Simulation) -> None:
    book = run_sampled(scene).energy
    assert book.largest_loss < 2.0 * ROUNDING * book.rounding


@settings(max_examples=15)
@given(
    scenes(
        laws=st.just(AdditionDeletion()),
        integrators=st.one_of(thetas, st.just(NonsmoothGeneralisedAlpha(1.0))),
        gravity=False,
    )
)
def test_hard_contact_whose_force_holds_the_jump_gains_nothing(scene: Simulation) -> None:
    # The gap ends at zero and began open, so that the force takes energy or gives none.
    book = run_sampled(scene).energy
    assert book.largest_gain < ROUNDING * book.rounding


@settings(max_examples=20)
@given(
    scenes(
        laws=st.one_of(penalties, impulses),
        integrators=st.one_of(
            st.builds(HhtAlpha, alpha=st.floats(-1.0 / 3.0, 0.0)),
            st.builds(NonsmoothGeneralisedAlpha, rho_inf=st.floats(0.0, 1.0)),
        ),
        gravity=False,
    )
)
def test_damping_schemes_gain_within_their_bound(scene: Simulation) -> None:
    assert scene.method.integrator is not None
    assert run_sampled(scene).energy.largest_gain <= energy_bound(*scene, scene.method.integrator)


@settings(max_examples=15)
@given(
    scenes(
        laws=st.builds(Penalty, stiffness=st.builds(Relative, log_uniform(1e-3, 1.0))),
        integrators=st.builds(GeneralisedAlpha, rho_inf=st.floats(0.0, 1.0)),
        gravity=False,
    )
)
def test_generalised_alpha_gains_within_its_bound(scene: Simulation) -> None:
    traced = trace(scene)
    ports = traced.history.assembly.memory.ports
    # As under central difference, the step must resolve the contact's own oscillation.
    assume(ports["gap_per_force"][0] * ports["parameters"][0, 0] < 0.25)
    assert traced.history.energy.largest_gain <= energy_bound(*scene, GeneralisedAlpha())
