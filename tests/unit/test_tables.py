"""Compiled functions of a table of arrays are called as they were compiled: all tables of a kind have one form."""

from collections.abc import Callable

import numpy as np
import pytest

import impactlab as il
from impactlab.numerics.addresses import COMPILED, entered, entered_with_table, type_of
from impactlab.simulate.plan import prepare
from impactlab.simulate.stepping.loop import advance_dated, start
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.types import Array
from tests.support import CASES

ARM, SPHERE = "two_link_arm", "sphere_on_beam"


def assembled(name: str, method: str | None = None) -> Assembly:
    case = il.load_case(CASES / f"{name}.yaml")
    plan = prepare(*(case.method(method) if method else case).simulation())
    return Assembly(plan, plan.integrator, plan.dt)


@pytest.mark.skipif(not COMPILED, reason="numba is switched off")
@pytest.mark.parametrize("name", [SPHERE, "granular/solitary_wave", "smith_pile", "several_masses", "all_methods"])
def test_tables_of_all_kinds_of_scenes_have_one_form(name: str):
    assert type_of(assembled(name).memory) == type_of(assembled(ARM).memory)


def test_a_function_of_a_table_gives_the_same_bits_as_through_numba():
    def record(call: Callable[..., object]) -> Array:
        assembly = assembled(SPHERE)
        call(start, assembly.memory, assembly.dt)
        for last in (3, 100):  # the first call loads the function, the second one goes straight to it
            call(advance_dated, assembly.memory, assembly.dt, last, assembly.stride, assembly.sample_stride)
        return np.array(assembly.memory.record)

    assert np.array_equal(record(entered_with_table), record(entered))


@pytest.mark.skipif(not COMPILED, reason="numba is switched off")
def test_no_bit_depends_on_where_arrays_stand_in_memory():
    """Compiled loops test whether arrays overlap; one that stores near what it reads takes another way."""

    def record(between: int) -> Array:
        assembly = assembled("all_methods", "striker_attached")
        maps, backup = assembly.memory.maps, assembly.memory.backup
        room = np.zeros(maps.size + between + backup.size)
        room[: maps.size] = maps
        memory = assembly.memory._replace(maps=room[: maps.size], backup=room[maps.size + between :])
        start(memory, assembly.dt)
        advance_dated(memory, assembly.dt, assembly.steps, assembly.stride, assembly.sample_stride)
        assert assembly.clock.n_maps > 0
        return np.array(memory.record)

    assert np.array_equal(record(8), record(1000))
