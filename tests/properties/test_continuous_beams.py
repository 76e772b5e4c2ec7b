"""Continuous beams under whatever ends, places, laws and steps: energy never grows, and goes nowhere unbooked."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.energy_conserving import EnergyConserving
from impactlab.contact.power_law import Hertz, HuntCrossley
from impactlab.models.continuous import Continuous
from impactlab.scene import Beam, BeamSegment, End
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import struck

LENGTH, AREA, INERTIA, YOUNG, RHO = 0.3, 1e-4, 1e-8 / 12.0, 2.1e11, 7900.0
KGA = 5.0 / 6.0 * YOUNG / 2.6 * AREA
FAST = settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])

sizes = st.floats(-1.5, 1.5).map(lambda power: 10.0**power)
ends = st.one_of(
    st.sampled_from([End("free"), End("clamped"), End("pinned"), End("infinite")]),
    st.builds(lambda a, b: End("spring", 1e5 * a, rotational=10.0 * b), sizes, sizes),
    st.builds(lambda a: End("mass", 0.1 * a), sizes),
    st.builds(lambda a: End("dashpot", 2e3 * a), sizes),
)
laws = st.sampled_from([AdditionDeletion(), EnergyConserving(), Hertz(stiffness=1e10), HuntCrossley(stiffness=1e10)])


def scene(left: End, right: End, share: float, law: Any, mass: float, cells: float, theory: str) -> Simulation:
    shears = theory == "timoshenko"
    segment = BeamSegment(
        LENGTH, AREA, YOUNG, RHO, inertia=INERTIA,
        shear_stiffness=KGA if shears else math.inf, rotary_inertia=RHO * INERTIA if shears else 0.0,
    )  # fmt: skip
    beam = Beam("beam", (segment,), left, right, theory=theory)  # type: ignore[arg-type]
    dt = LENGTH / math.sqrt(KGA / (RHO * AREA)) / cells
    return struck(beam, Continuous(), law, None, StepRule(dt=dt), mass=mass, x=share * LENGTH, duration=3e-4)


@FAST
@given(ends, ends, st.floats(0.05, 0.95), laws, sizes, st.floats(40.0, 400.0))
def test_the_energy_of_a_timoshenko_beam_is_kept_or_booked(
    left: End, right: End, share: float, law: Any, mass: float, cells: float
) -> None:
    history = run(*scene(left, right, share, law, 0.1 * mass, cells, "timoshenko"))
    book = history.energy
    assert book.largest_gain < 1e-9
    # A contact that lets go between two ends of steps loses what its spring then holds; nothing else does.
    assert book.largest_loss < (1e-9 if isinstance(law, AdditionDeletion) else 5e-2)


@FAST
@given(st.booleans(), st.floats(0.05, 0.95), laws, sizes, st.floats(40.0, 400.0))
def test_the_energy_of_an_infinite_beam_is_kept_or_booked(
    tip: bool, share: float, law: Any, mass: float, cells: float
) -> None:
    left = End("free") if tip else End("infinite")
    case = scene(left, End("infinite"), 0.0 if tip else share, law, 0.1 * mass, cells, "euler_bernoulli")
    book = run(*case).energy
    assert book.largest_gain < 1e-9
    assert book.largest_loss < (1e-9 if isinstance(law, AdditionDeletion) else 5e-2)
