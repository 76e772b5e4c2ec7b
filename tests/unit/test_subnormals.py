"""Numbers too small for full speed are zero in the steps of bodies, and only there."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from impactlab.contact.power_law import Hertz
from impactlab.integrators.newmark import Newmark
from impactlab.models.modal import Modal
from impactlab.numerics.addresses import COMPILED
from impactlab.numerics.subnormals import ON_X86, flush_subnormals, restore_subnormals
from impactlab.scene import Contact, Mass, Rayleigh, Rod, Segment
from impactlab.scene.method import StepRule
from impactlab.testing.scenes import FREE, face, simulation
from impactlab.testing.trace import begun, walk_to

LEAST = np.finfo(float).tiny
needs_it = pytest.mark.skipif(not (COMPILED and ON_X86), reason="only compiled code on processors of the x86 family")


@numba.njit
def halve(values: np.ndarray) -> None:
    for i in range(values.size):
        values[i] *= 0.5


@numba.njit
def halve_inside(values: np.ndarray) -> None:
    before = flush_subnormals()
    for i in range(values.size):
        values[i] *= 0.5
    restore_subnormals(before)


@needs_it
def test_a_tiny_result_is_zero_inside_alone() -> None:
    for function, expected in ((halve, 0.5 * LEAST), (halve_inside, 0.0), (halve, 0.5 * LEAST)):
        values = np.full(9, LEAST)
        function(values)
        assert np.all(values == expected)


@needs_it
def test_modes_that_have_faded_away_are_at_rest() -> None:
    """Once the mass has left, the highest of 40 modes loses a factor of e in some 0.5 us."""
    rod = Rod("rod", (Segment(0.3, 9e-4, 2.1e11, 7850.0),), FREE, FREE, damping=Rayleigh(stiffness=1e-7))
    bodies = {"mass": Mass("mass", 0.1, 1.0), "rod": rod}
    contact = Contact(face(bodies["mass"]), face(rod), 0.0)
    step = StepRule(dt=1e-7)
    struck = simulation("faded", bodies, (contact,), 6e-3, Newmark(), step, model=Modal(None, 40), law=Hertz(1e10))
    _, assembly, history = begun(struck)
    walk_to(assembly, history, assembly.steps, assembly.sample_stride)
    state = np.abs(assembly.memory.state)
    assert np.count_nonzero(state == 0.0) > 40
    assert state[state > 0.0].min() >= LEAST
