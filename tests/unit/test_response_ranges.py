"""Facts found in compiled code before the first step: ranges of responses, lone entries of faces, even momenta."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from impactlab.numerics.records import records
from impactlab.simulate.stepping.arrays import BodyRecord, FaceRecord
from impactlab.simulate.stepping.setup.response_ranges import MIN_EVEN, RESPONSE_TOL, describe, write_ranges

ENTRY = st.one_of(st.just(0.0), st.floats(-1.0, 1.0).map(lambda x: x * 1e-25), st.floats(-2.0, 2.0))


def range_of(part: np.ndarray) -> tuple[int, int]:
    """Return the range of entries that are not zero up to rounding, by numpy; (0, 0) of none."""
    size = np.abs(part)
    moved = np.flatnonzero(size > RESPONSE_TOL * size.max(initial=0.0))
    return (int(moved[0]), int(moved[-1]) + 1) if moved.size else (0, 0)


def body_of(n_dof: int, size: int, n_ports: int = 1) -> tuple[object, object]:
    """Return the record of one body by name and for the loop."""
    (body,), for_loop = records(BodyRecord, 1)
    body.n_dof, body.n_ports, body.state_end = n_dof, n_ports, size
    return body, for_loop


@given(st.integers(1, 6), st.integers(0, 4), st.data())
def test_ranges_hold_all_entries_beyond_rounding(n_dof: int, rest: int, data: st.DataObject) -> None:
    size = 2 * n_dof + rest
    response = np.array(data.draw(st.lists(ENTRY, min_size=size, max_size=size)))
    _, bodies = body_of(n_dof, size)
    (face,), faces = records(FaceRecord, 1)
    write_ranges(faces, 1, bodies, np.zeros(1, np.int64), response)
    for part, first in enumerate((0, n_dof, 2 * n_dof)):
        low, high = range_of(response[first : size if part == 2 else first + n_dof])
        assert (face.low[part], face.high[part]) == ((first + low, first + high) if high else (0, 0))


def test_a_body_that_changes_its_coordinates_has_whole_ranges() -> None:
    _, bodies = body_of(3, 6)
    (face,), faces = records(FaceRecord, 1)
    write_ranges(faces, 1, bodies, np.ones(1, np.int64), np.zeros(6))
    assert (face.low[:3], face.high[:3]) == ([0, 3, 0], [3, 6, 0])


def test_each_face_has_the_responses_of_its_own_port() -> None:
    _, bodies = body_of(2, 4, n_ports=2)
    found, faces = records(FaceRecord, 2)
    found[1].place = 1
    responses = np.zeros((3, 2, 4))  # to forces, impulses and projections at two ports
    responses[0, 1, 1], responses[1, 0, 2], responses[2, 1, 0] = 1.0, 2.0, 3.0
    write_ranges(faces, 3, bodies, np.zeros(1, np.int64), responses.ravel())
    assert found[0].low[:] == [0, 0, 0, 0, 2, 0, 0, 0, 0]
    assert found[0].high[:] == [0, 0, 0, 0, 3, 0, 0, 0, 0]
    assert found[1].low[:] == [1, 0, 0, 0, 0, 0, 0, 0, 0]
    assert found[1].high[:] == [2, 0, 0, 0, 0, 0, 1, 0, 0]


def described(
    momentum: np.ndarray, rows: list[dict[int, float]], phased: int = 0
) -> tuple[float, tuple[int, int], list[int]]:
    """Return the even momentum of a body, the entries of its one face whose two rows come first, and of its probes."""
    n_dof = momentum.size
    body, bodies = body_of(n_dof, 2 * n_dof)
    (face,), faces = records(FaceRecord, 1)
    start = np.cumsum([0, *map(len, rows)])
    index = np.array([each for row in rows for each in row], np.int64)
    value = np.array([each for row in rows for each in row.values()])
    whole = np.concatenate((np.zeros(n_dof), momentum))
    probe_at = np.full(len(rows) - 2, -1)
    describe(bodies, faces, np.array([phased]), whole, np.zeros(6 * n_dof), start, index, value, probe_at, 2)
    return body.even, (face.u_at, face.v_at), [*probe_at]


NODE = [{3: 1.0}, {23: 1.0}]


@pytest.mark.parametrize(
    ("rows", "entries"),
    [
        (NODE, (3, 23)),
        ([{3: 0.5, 4: 0.5}, {23: 0.5, 24: 0.5}], (-1, -1)),  # inside an element
        ([{3: 0.5}, {23: 0.5}], (-1, -1)),
        ([{}, {}], (-1, -1)),  # of a wall
        ([{3: 1.0}, {}], (-1, -1)),
    ],
)
def test_a_face_at_a_node_is_one_entry_of_the_state(rows: list[dict[int, float]], entries: tuple[int, int]) -> None:
    assert described(np.ones(20), rows)[1] == entries


def test_with_two_phases_no_entry_stands_alone() -> None:
    assert described(np.ones(20), [*NODE, {4: 1.0}], phased=1) == (0.0, (-1, -1), [-1])


def test_a_probe_at_a_node_is_one_entry_of_the_state() -> None:
    probes = [{4: 1.0}, {4: 0.5, 5: 0.5}, {7: 2.0}, {}]
    assert described(np.ones(20), [*NODE, *probes])[2] == [4, -1, -1, -1]


def test_momenta_that_differ_by_rounding_are_even() -> None:
    row = np.full(20, 0.3)
    row[0] = row[-1] = 0.15
    assert described(row, NODE)[0] == 0.3
    row[7] *= 1.0 + 2.0**-52
    assert described(row, NODE)[0] == 0.3
    row[7] *= 1.0 + 1e-12
    assert described(row, NODE)[0] == 0.0
    assert described(np.full(MIN_EVEN - 1, 0.3), [{3: 1.0}, {18: 1.0}])[0] == 0.0
