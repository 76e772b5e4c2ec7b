"""Energy under the implicit schemes: those that provably gain nothing, and the bounds of the others."""

from __future__ import annotations

from hypothesis import assume, given, settings
from hypothesis import strategies as st

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.penalty import Penalty
from impactlab.integrators.bathe import Bathe
from impactlab.integrators.contact_stabilised_newmark import ContactStabilisedNewmark
from impactlab.integrators.generalised_alpha import GeneralisedAlpha
from impactlab.integrators.hht_alpha import HhtAlpha
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.integrators.nonsmooth_generalised_alpha import NonsmoothGeneralisedAlpha
from impactlab.scene.method import Simulation
from impactlab.simulate.pairing import energy_bound
from impactlab.testing.strategies import log_uniform, scenes
from impactlab.testing.trace import trace
from impactlab.types import Relative

ROUNDING = 2e-12  # as in test_stepped_energy: a few hundred roundings of energies of the size of the initial one
penalties = st.builds(
    Penalty,
    stiffness=st.builds(Relative, log_uniform(1e-2, 10.0)),
    damping=st.one_of(st.just(0.0), st.builds(Relative, log_uniform(1e-2, 10.0))),
)
impulses = st.builds(ImpulseMomentum, restitution=st.floats(0.0, 1.0))
thetas = st.builds(MoreauJean, theta=st.floats(0.5, 1.0))
conserving = st.sampled_from([Midpoint(), ContactStabilisedNewmark(), NonsmoothGeneralisedAlpha(1.0), HhtAlpha(0.0)])
composite = st.builds(Bathe, first_part=st.floats(0.2, 0.8))


@settings(max_examples=40)
@given(scenes(laws=st.one_of(penalties, impulses), integrators=st.one_of(conserving, thetas, composite)))
def test_these_gain_nothing_with_springs_dashpots_and_kicks(scene: Simulation) -> None:
    # A step that never gains energy under a constant load, taken about the load's own rest, gives F times the path.
    book = trace(scene).history.energy
    assert book.largest_gain < ROUNDING * book.rounding


@settings(max_examples=20)
@given(scenes(laws=st.just(Penalty(Relative(1.0))), integrators=conserving))
def test_conserving_schemes_lose_nothing_either(scene: Simulation) -> None:
    book = trace(scene).history.energy
    assert book.largest_loss < 2.0 * ROUNDING * book.rounding


@settings(max_examples=30)
@given(
    scenes(
        laws=st.just(AdditionDeletion()),
        integrators=st.one_of(thetas, st.just(NonsmoothGeneralisedAlpha(1.0))),
        gravity=False,
    )
)
def test_hard_contact_whose_force_holds_the_jump_gains_nothing(scene: Simulation) -> None:
    # The gap ends at zero and began open, so that the force takes energy or gives none.
    book = trace(scene).history.energy
    assert book.largest_gain < ROUNDING * book.rounding


@settings(max_examples=40)
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
    assert trace(scene).history.energy.largest_gain <= energy_bound(*scene, scene.method.integrator)


@settings(max_examples=30)
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
