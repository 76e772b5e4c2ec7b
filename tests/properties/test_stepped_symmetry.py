"""The same case gives the same bits; seen from behind or in other units it gives the same physics."""

from __future__ import annotations

import dataclasses

from hypothesis import assume, given, settings
from hypothesis import strategies as st

from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.penalty import Penalty
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.bar_elements import elements_per_segment
from impactlab.models.modal import Modal
from impactlab.scene import Rod
from impactlab.scene.method import Simulation
from impactlab.simulate.stepping.results.history import RecordedHistory
from impactlab.testing.invariants import mirror_difference, records_difference, same_bits, scaling_difference
from impactlab.testing.strategies import in_other_units, laws, mirrored, scenes
from impactlab.testing.trace import run_in_cuts
from impactlab.types import Relative


def whole(scene: Simulation) -> RecordedHistory:
    return run_in_cuts(scene, lambda step: 10**9)


def before_first_opening(
    one: RecordedHistory, other: RecordedHistory, force: float, length: float, time: float
) -> float:
    """Difference of two runs up to the step before the first opening of either.

    Where a trial force is zero to rounding, a hard contact may open a step earlier or later: what follows may differ.
    """
    openings = [event.time for event in one.events if event.kind == "open"]
    openings += [event.time / time for event in other.events if event.kind == "open"]
    steps = one.assembly.clock.n_records if not openings else int(min(openings) / one.assembly.dt) - 1
    if steps < 2:
        return 0.0
    for history in (one, other):
        history.assembly.clock.n_records = min(history.assembly.clock.n_records, steps)
    return records_difference(one, other, force, length, time)


@settings(max_examples=25)
@given(scenes(), st.integers(1, 97), st.integers(1, 5))
def test_same_case_same_bits_whatever_the_cuts(scene: Simulation, first: int, second: int) -> None:
    one = whole(scene)
    assert same_bits(one, whole(scene))
    assert same_bits(one, run_in_cuts(scene, lambda step: step + first))
    assert same_bits(one, run_in_cuts(scene, lambda step: step + 1 + (step * second) % 7))


@settings(max_examples=15)
@given(
    scenes(integrators=st.just(ExactModal()), laws=st.just(Penalty(stiffness=Relative(1.0))), gravity=False),
    st.integers(1, 31),
)
def test_same_bits_where_events_are_located(scene: Simulation, stride: int) -> None:
    scene = scene.but(events="located")
    assert same_bits(whole(scene), run_in_cuts(scene, lambda step: step + stride))


def shared_alike(rod: Rod, model: AbstractRodModel) -> bool:
    """Return whether the mirrored rod has the mirrored mesh: an odd element goes to the first of two equal segments."""
    assert isinstance(model, FiniteElement)
    there = elements_per_segment(rod.segments, model.elements)
    return there == elements_per_segment(rod.segments[::-1], model.elements)[::-1]


@settings(max_examples=25)
@given(
    scenes(
        laws=laws().filter(lambda law: not law.holds_position),
        models=st.builds(FiniteElement, st.integers(2, 40), st.just("lumped")),
        turned=False,
    )
)
def test_mirrored_scene_has_the_mirrored_solution_to_rounding(scene: Simulation) -> None:
    assume(
        all(
            shared_alike(body, scene.method.models[body.name])
            for body in scene.scene.bodies.values()
            if isinstance(body, Rod)
        )
    )
    # Without addition_deletion, which holds a gap at zero and then reads its sign: rounding decides.
    # Masses, springs and forces are the same numbers; a mirrored sweep rounds otherwise: 300 steps of a stable scheme,
    # whose rounding grows no faster than the square of their number, 9e4 eps = 2e-11, in each of 80 coordinates.
    assert before_first_opening(whole(scene), whole(mirrored(scene)), 1.0, 1.0, 1.0) < 2e-9


@settings(max_examples=20)
@given(
    scenes(
        laws=st.sampled_from([Penalty(stiffness=Relative(1.0)), ImpulseMomentum(0.5)]),
        integrators=st.sampled_from([Newmark(), ExactModal()]),
        models=st.builds(Modal, st.none(), st.integers(1, 30)),
        turned=False,
    )
)
def test_mirrored_modal_scene_has_the_mirrored_solution(scene: Simulation) -> None:
    assert before_first_opening(whole(scene), whole(mirrored(scene)), 1.0, 1.0, 1.0) < 2e-9


@settings(max_examples=25)
@given(scenes(laws=laws()), st.integers(-4, 4), st.integers(-4, 4), st.integers(-4, 4))
def test_results_scale_with_units(scene: Simulation, mass: int, length: int, time: int) -> None:
    # Units that differ by powers of four change exponents only, so no digit of the answer may change, except for the
    # eigenvectors, which a library scales for itself: those agree to rounding until a hard contact decides.
    factors = 4.0**mass, 4.0**length, 4.0**time
    one, other = whole(scene), whole(in_other_units(scene, *factors))
    exact = all(isinstance(model, FiniteElement) for model in scene.method.models.values())
    scale = factors[0] * factors[1] / factors[2] ** 2, factors[1], factors[2]
    if exact:
        assert scaling_difference(one, other, *factors) == 0.0
        return
    assert before_first_opening(one, other, *scale) < 2e-9


def test_mirror_difference_sees_a_difference() -> None:
    scene = None

    @settings(max_examples=1, database=None)
    @given(scenes(laws=st.just(Penalty(stiffness=Relative(1.0))), integrators=st.just(Newmark()), gravity=False))
    def one_scene(drawn: Simulation) -> None:
        nonlocal scene
        scene = drawn

    one_scene()
    assert scene is not None
    softer = scene.but(law=Penalty(stiffness=Relative(0.5)))
    assert mirror_difference(whole(scene), whole(softer)) > 1e-3


SOFT = st.builds(Penalty, stiffness=st.builds(Relative, st.floats(0.05, 5.0)), damping=st.just(Relative(0.2)))


@settings(max_examples=25)
@given(scenes(laws=SOFT, far=("free", "mass"), kinds=("mass_on_rod", "two_rods")), st.floats(-5.0, 5.0))
def test_free_bodies_meet_alike_in_a_moving_frame(scene: Simulation, share: float) -> None:
    speed = share * max(abs(body.velocity) for body in scene.scene.bodies.values())
    bodies = {
        name: dataclasses.replace(body, velocity=body.velocity + speed) for name, body in scene.scene.bodies.items()
    }
    assert records_difference(whole(scene), whole(scene.but(bodies=bodies)), 1.0, 1.0, 1.0) < 1e-7
