"""Hard contacts along a chain, against a direct solve of their complementarity problem.

The velocities after plastic contacts are those closest to the free ones, in kinetic energy, that separate no more:
isotonic regression, solved by pooling adjacent violators. The percussions follow from the momentum of the beads before.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import isotonic_regression

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.velocity_complementarity import VelocityComplementarity
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.integrators.newmark import Newmark
from impactlab.scene.bodies import Mass
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import prepare
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.testing.scenes import in_a_row, simulation, touching
from impactlab.testing.trace import trace
from impactlab.types import Array

DT, APART = 1e-3, 10.0
SCHEMES = [CentralDifference(), MoreauJean()]


def chain(masses: Array, speeds: Array, touches: Array, law: AbstractContactLaw, scheme: object) -> Simulation:
    beads = [Mass(f"b{i}", float(m), float(v)) for i, (m, v) in enumerate(zip(masses, speeds, strict=True))]
    gaps = [0.0 if touch else APART for touch in touches]
    return in_a_row(beads, None, law, scheme, StepRule(dt=DT), gaps=gaps, duration=DT)  # type: ignore[arg-type]


def direct(masses: Array, speeds: Array, touches: Array) -> tuple[Array, Array]:
    """Return velocities after the contacts [m/s] and their percussions [N s]."""
    ends = [0, *(np.flatnonzero(~touches) + 1).tolist(), masses.size]
    after = np.concatenate([isotonic_regression(speeds[a:b], weights=masses[a:b]).x for a, b in pairwise(ends)])
    return after, np.cumsum(masses * (speeds - after))[:-1]


def check(masses: Array, speeds: Array, touches: Array, scheme: object, tolerance: float) -> None:
    found = trace(chain(masses, speeds, touches, VelocityComplementarity(), scheme))
    velocities = np.array([found.velocities(f"b{i}")[1, 0] for i in range(masses.size)])
    percussions = found.forces[0] * DT
    after, given_to = direct(masses, speeds, touches)
    size = np.abs(speeds).max() + 1e-3
    assert velocities == pytest.approx(after, abs=tolerance * size)
    assert percussions == pytest.approx(given_to, abs=tolerance * size * masses.sum())
    assert percussions.min(initial=0.0) >= 0.0
    assert np.diff(velocities)[touches].min(initial=0.0) >= -tolerance * size


@settings(deadline=None, max_examples=30)
@given(st.data(), st.integers(2, 40), st.sampled_from(SCHEMES))
def test_any_chain_of_hard_contacts_has_the_direct_solution(data: st.DataObject, count: int, scheme: object) -> None:
    numbers = st.floats(0.1, 10.0), st.floats(-3.0, 3.0), st.booleans()
    masses, speeds = (np.array(data.draw(st.lists(each, min_size=count, max_size=count))) for each in numbers[:2])
    touches = np.array(data.draw(st.lists(numbers[2], min_size=count - 1, max_size=count - 1)))
    check(masses, speeds, touches, scheme, 1e-10)


@pytest.mark.parametrize("kind", ["random", "struck on the left", "struck on the right", "pressed together"])
def test_a_thousand_hard_contacts_have_the_direct_solution(kind: str) -> None:
    random = np.random.default_rng(5)
    masses, place = random.uniform(0.5, 2.0, 1001), np.linspace(0.0, 1.0, 1001)
    speeds = {
        "random": random.normal(size=1001),
        "struck on the left": np.where(place == 0.0, 1.0, 0.0),
        "struck on the right": np.where(place == 1.0, -1.0, 0.0),
        "pressed together": 1.0 - place,
    }[kind]
    check(masses, speeds, np.ones(1000, bool), CentralDifference(), 1e-9)


@pytest.mark.parametrize("law", [VelocityComplementarity(), AdditionDeletion()])
def test_memory_is_linear_in_the_contacts(law: AbstractContactLaw) -> None:
    sizes = []
    for count in (100, 200):
        masses = np.ones(count + 1)
        plan = prepare(*chain(masses, 0.0 * masses, np.ones(count, bool), law, Newmark()))
        assert plan.integrator is not None
        assembly = Assembly(plan, plan.integrator, DT)
        sizes.append(sum(np.asarray(each).nbytes for each in assembly.memory))
        assert assembly.clock.reach == 1
    assert sizes[1] < 2.1 * sizes[0]


def test_contacts_listed_in_any_order_stand_in_a_narrow_band() -> None:
    count, random = 60, np.random.default_rng(3)
    masses = {f"b{i}": Mass(f"b{i}", 1.0, 1.0 - i / count) for i in range(count + 1)}
    contacts = [touching(masses[f"b{i}"], masses[f"b{i + 1}"]) for i in random.permutation(count)]
    law, scheme = VelocityComplementarity(), CentralDifference()
    given_to = simulation("x", masses, contacts, DT, scheme, StepRule(dt=DT), law=law)
    plan = prepare(*given_to)
    assert Assembly(plan, scheme, DT).clock.reach == 1
    after = [trace(given_to).velocities(name)[1, 0] for name in ("b0", "b30", "b60")]
    assert after == pytest.approx([0.5, 0.5, 0.5], abs=1e-12)
