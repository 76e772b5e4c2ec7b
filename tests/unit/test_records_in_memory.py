"""Records of the step loop: the same memory by name and in the form of compiled code."""

from __future__ import annotations

from impactlab.numerics.addresses import COMPILED
from impactlab.numerics.records import copied_records, records
from impactlab.simulate.stepping.arrays import ContactRecord, EventRecord
from impactlab.types import Port


def test_records_begin_as_zeros_and_share_their_memory() -> None:
    by_name, for_loop = records(Port, 3)
    assert len(by_name) == len(for_loop) == 3
    assert not any(bytes(port).strip(b"\0") for port in by_name)
    by_name[1].dt, by_name[2].parameters[1] = 0.5, 7.0
    assert not COMPILED or for_loop["dt"].tolist() == [0.0, 0.5, 0.0]
    again = copied_records(Port, for_loop)[0] if COMPILED else for_loop
    by_name[0].dt = 1.0  # a copy does not see it
    assert not COMPILED or (again[1].dt, again[2].parameters[1], again[0].dt) == (0.5, 7.0, 0.0)


def test_each_call_has_memory_of_its_own() -> None:
    first, other = records(ContactRecord, 1)[0], records(ContactRecord, 1)[0]
    first[0].force = 1.0
    assert other[0].force == 0.0


def test_no_records_are_an_empty_sequence() -> None:
    for kind in (EventRecord, Port):
        by_name, for_loop = records(kind, 0)
        assert len(by_name) == len(for_loop) == 0
    if COMPILED:
        assert records(EventRecord, 0)[1].dtype != records(Port, 0)[1].dtype
