"""Power laws between drawn bodies: energy closes to rounding where the force acts inside the step, and never pulls."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.khulief_shabana import KhuliefShabana
from impactlab.contact.power_law import Flores, Hertz, HuntCrossley, LankaraniNikravesh
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.scene import Mass, Rod
from impactlab.scene.method import Simulation, StepRule, laws_of, sides
from impactlab.simulate import run
from impactlab.testing.scenes import in_a_row
from impactlab.testing.strategies import log_uniform, scenes
from impactlab.testing.trace import run_sampled, trace
from impactlab.types import Relative

# As for the springs (test_stepped_energy): some hundred roundings of energies of the size of the initial one, and as
# many of the work of gravity; a force that falls as a power makes no more of them.
ROUNDING = 4e-12

HYSTERETIC = (HuntCrossley, LankaraniNikravesh, Flores)


def with_power_law(
    scene: Simulation, share: float, exponent: float, restitution: float | None, kind: int
) -> Simulation:
    """Return a scene under a law as stiff as an element of its rod at an indentation that its impact can reach."""
    facts = sides(*scene, scene.scene.contacts[0])
    stiffness = share * min(side.element_stiffness for side in facts if side.kind == "rod")
    speed = max(abs(body.velocity) for body in scene.scene.bodies.values() if isinstance(body, (Rod, Mass)))
    k = stiffness * (1e-2 * speed * scene.scene.round_trip) ** (1.0 - exponent)
    law: AbstractContactLaw = Hertz(k, exponent)
    if restitution is not None:
        law = HYSTERETIC[kind](k, exponent, restitution, 1e-6 * speed)
    return scene.but(law=law)


scenes_of_power_laws = st.builds(
    with_power_law,
    scenes(laws=st.just(KhuliefShabana(Relative(1.0))), integrators=st.sampled_from([Newmark(), ExactModal()])),
    log_uniform(1e-3, 1e3),
    st.sampled_from([1.0, 1.5, 2.0, 3.5]),
    st.one_of(st.none(), st.floats(0.05, 1.0)),
    st.sampled_from([0, 1, 2]),
)


@settings(max_examples=25)
@given(scenes_of_power_laws)
def test_energy_closes_to_rounding(scene: Simulation) -> None:
    book = run_sampled(scene).energy
    assert max(book.largest_gain, book.largest_loss) < ROUNDING * book.rounding
    if isinstance(laws_of(*scene)[0], Hertz):
        # A lossless law books no loss except that of rounding.
        assert book.booked["contact"][-1] < ROUNDING * book.scale


@settings(max_examples=15)
@given(scenes_of_power_laws)
def test_it_never_pulls(scene: Simulation) -> None:
    assert (trace(scene).forces >= 0.0).all()


@settings(max_examples=15)
@given(
    scenes(
        laws=st.builds(KhuliefShabana, st.builds(Relative, log_uniform(1e-2, 10.0)), st.floats(0.05, 1.0)),
        integrators=st.sampled_from([Newmark(), ExactModal()]),
    )
)
def test_khulief_shabana_gains_nothing_and_loses_the_booked_energy(scene: Simulation) -> None:
    book = run_sampled(scene).energy
    assert book.largest_gain < ROUNDING * book.rounding


def test_between_two_masses_the_momentum_is_shared_as_it_must() -> None:
    law = HuntCrossley(1e9, restitution=0.5)
    bodies = Mass("a", 2.0, 1.0), Mass("b", 3.0, -0.5)
    history = run(*in_a_row(bodies, None, law, Newmark(), StepRule(dt=1e-7), gaps=1e-5, duration=4e-3))
    a, b = (float(history.evaluate(np.array([4e-3]), f"velocity:{name}")[0]) for name in "ab")
    # 1e4 forces of some rounding each; the restitution to second order in a few thousand steps of contact.
    assert abs(2.0 * a + 3.0 * b - 0.5) < 1e-12
    assert abs((b - a) / 1.5 - law.restitutions().true) < 1e-6
