"""Rows of beads take the steps of the contact solve: same motion, forces, events, energies and refusals."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz, HuntCrossley
from impactlab.errors import StepError
from impactlab.history.base import AbstractHistory
from impactlab.integrators.central_difference import CentralDifference
from impactlab.models.finite_element import FiniteElement
from impactlab.scene.bodies import Mass, Rod, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import prepare, run
from impactlab.simulate.stepped_run import walk
from impactlab.simulate.stepping import loop
from impactlab.simulate.stepping.arrays import REST
from impactlab.simulate.stepping.results.history import RecordedHistory
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.simulate.stepping.setup.bead_rows import bead_rows
from impactlab.testing.scenes import FREE, UNIT, in_a_row, simulation, touching

STEP = StepRule(dt=1e-3)
ROUNDING = 1e-9  # of the largest value: sums in another order, over a thousand steps of a chain of collisions


def solved(given: Simulation, with_beads: bool) -> RecordedHistory:
    """Return a run with or without rows of beads."""
    plan = prepare(*given)
    assert plan.dt is not None
    assert plan.integrator is not None
    assembly = Assembly(plan, plan.integrator, plan.dt, with_beads)
    history = RecordedHistory(assembly, plan.integrator)
    loop.start(assembly.memory, plan.dt)
    assert walk(assembly, history, None) in (loop.DONE, loop.RECORDS_FULL, loop.EVENTS_FULL)
    history.finish()
    return history


def tapered(law: Hertz | Penalty, **others: Any) -> Simulation:
    """Return seven masses between two walls: gaps, an overlap, gravity."""
    masses = [Mass(f"m{i}", 1.0 - 0.1 * i, (2.0, 0.0, -1.0, 0.5, 0.0, 0.0, 1.0)[i]) for i in range(7)]
    gaps = [0.01, 0.0, -0.001, 0.02, 0.0, 0.0, 0.03, 0.01]
    bodies = [Wall("near"), *masses, Wall("far")]
    return in_a_row(bodies, None, law, CentralDifference(), STEP, gaps=gaps, duration=1.6, gravity=0.3, **others)


def same(ours: AbstractHistory, theirs: AbstractHistory, points: int = 1001) -> None:
    assert ours.channels() == theirs.channels()
    t = np.linspace(0.0, ours.duration, points)
    for channel in ours.channels():
        found, wanted = ours.evaluate(t, channel), theirs.evaluate(t, channel)
        assert np.max(np.abs(found - wanted)) <= ROUNDING * max(1e-3, np.abs(wanted).max()), channel
    one, other = (sorted((each.contact, each.time, each.kind) for each in run.events) for run in (ours, theirs))
    assert [(contact, kind) for contact, _, kind in one] == [(contact, kind) for contact, _, kind in other]
    assert [time for _, time, _ in one] == pytest.approx([time for _, time, _ in other], abs=1e-9)
    spans = [sorted(run.contacts, key=lambda each: (each.contact, each.start)) for run in (ours, theirs)]
    for mine, its in zip(*spans, strict=True):
        assert (mine.contact, mine.end is None) == (its.contact, its.end is None)
        assert mine.impulse == pytest.approx(its.impulse, rel=1e-7, abs=1e-12)
        assert mine.peak_force == pytest.approx(its.peak_force, rel=1e-7)
    assert np.max(np.abs(ours.energy.stored - theirs.energy.stored)) <= 1e-9
    assert np.max(np.abs(ours.energy.balance - theirs.energy.balance)) <= 1e-9


@pytest.mark.parametrize("law", [Hertz(300.0), Hertz(300.0, 2.0), Penalty(100.0)], ids=["3/2", "2", "1"])
def test_rows_between_walls_move_as_contacts_that_are_solved(law: Hertz | Penalty) -> None:
    given = tapered(law)
    ours, theirs = solved(given, True), solved(given, False)
    assert len(ours.assembly.layout.rows.contacts) == 8
    assert len(theirs.assembly.contacts) == 8
    assert len(ours.events) > 20
    same(ours, theirs)


@pytest.mark.parametrize(
    ("walls", "count"),
    [
        *itertools.product(["near", "far", "both"], [1, 6, 7, 8, 9, 15, 16, 17]),
        *(("both", count) for count in (126, 127, 128, 129)),
    ],
)
def test_rows_of_any_length_are_stepped_by_eight(walls: str, count: int) -> None:
    random = np.random.default_rng(count)
    masses, speeds = random.uniform(0.5, 2.0, count), random.normal(size=count)
    bodies: list[Any] = [Mass(f"m{i}", float(m), float(v)) for i, (m, v) in enumerate(zip(masses, speeds, strict=True))]
    bodies = [Wall("near")] * (walls != "far") + bodies + [Wall("far")] * (walls != "near")
    gaps = random.uniform(-0.002, 0.01, len(bodies) - 1).tolist()
    given = in_a_row(bodies, None, Hertz(300.0), CentralDifference(), STEP, gaps=gaps, duration=0.2, gravity=0.3)
    ours, theirs = solved(given, True), solved(given, False)
    assert ours.assembly.layout.rows.rows
    same(ours, theirs, points=201)


def test_rows_side_by_side_do_not_reach_into_each_other() -> None:
    first = [Mass(f"m{i}", 1.0, 1.0 if i == 0 else 0.0) for i in range(5)]
    second = [Mass(f"n{i}", 2.0, -1.0 if i == 2 else 0.0) for i in range(3)]
    bodies = [*first, Wall("middle"), *second]
    scheme = CentralDifference()
    given = in_a_row(bodies, None, Hertz(300.0), scheme, STEP, gaps=0.0, duration=1.0, gravity=0.5)
    ours = solved(given, True)
    assert len(ours.assembly.layout.rows.rows) == 2
    same(ours, solved(given, False))


def test_copies_of_the_arrays_begin_with_lines_of_memory_too() -> None:
    plan = prepare(*tapered(Hertz(300.0)))
    assert plan.dt is not None
    assert plan.integrator is not None
    made = Assembly(plan, plan.integrator, plan.dt)
    for each in (made, made.again()):
        for array in (each.memory.beads, each.memory.bead_contacts):
            assert array.ctypes.data % 64 == 0
            assert array.strides[0] % 64 == 0
            assert np.array_equal(array, getattr(made.memory, "beads" if len(array) == 5 else "bead_contacts"))


def test_records_of_means_over_several_steps_are_the_same() -> None:
    """Rows are read with the velocities of their beads between records: compared are the records themselves."""
    given = tapered(Hertz(300.0), records=90)
    ours, theirs = solved(given, True), solved(given, False)
    assert ours.channels() == theirs.channels()
    for name in ours.channels():
        found, wanted = ours.recorded[name].values, theirs.recorded[name].values
        assert np.max(np.abs(found - wanted)) <= ROUNDING * max(1e-3, np.abs(wanted).max()), name


def test_other_laws_and_bodies_beside_a_row_are_solved_with_it() -> None:
    """A rod at the left end, a damped contact inside, a second row behind it with another exponent."""
    rod = Rod("rod", (UNIT,), FREE, FREE, velocity=1.0)
    bodies = [rod, *(Mass(f"m{i}", 0.5) for i in range(8))]
    laws = [
        Penalty(50.0),
        *[Hertz(200.0)] * 3,
        HuntCrossley(200.0, restitution=0.7),
        Hertz(200.0),
        Hertz(200.0, 2.0),
        Hertz(200.0, 2.0),
    ]
    given = in_a_row(bodies, FiniteElement(10, mass="lumped"), laws, CentralDifference(), STEP, gaps=1e-4, duration=1.5)
    ours, theirs = solved(given, True), solved(given, False)
    assert sorted(len(row.contacts) for row in ours.assembly.layout.rows.rows) == [1, 1, 3]
    assert len(ours.events) > 8
    same(ours, theirs)


def test_order_of_bodies_and_contacts_changes_no_motion() -> None:
    masses = {f"m{i}": Mass(f"m{i}", 1.0, 1.0 if i == 0 else 0.0) for i in range(6)}
    contacts = [touching(masses[f"m{i}"], masses[f"m{i + 1}"]) for i in range(5)]
    fields: dict[str, Any] = {"duration": 0.5, "integrator": CentralDifference(), "step": STEP, "law": Hertz(300.0)}
    straight = run(*simulation("x", masses, contacts, **fields))
    shuffled = {name: masses[name] for name in ("m3", "m0", "m5", "m1", "m4", "m2")}
    mixed = run(*simulation("x", shuffled, [contacts[i] for i in (4, 1, 3, 0, 2)], **fields))
    for name in masses:
        at = np.linspace(0.0, 0.5, 51)
        assert mixed.evaluate(at, f"velocity:{name}").tolist() == straight.evaluate(at, f"velocity:{name}").tolist()


def test_a_mass_between_three_others_has_one_contact_of_a_row_on_each_side() -> None:
    masses = {name: Mass(name, 1.0, 1.0 if name in "ab" else 0.0) for name in "abcd"}
    contacts = [touching(masses[left], masses[right]) for left, right in (("a", "c"), ("b", "c"), ("c", "d"))]
    given = simulation("x", masses, contacts, 0.5, CentralDifference(), STEP, law=Hertz(300.0))
    found = bead_rows(prepare(*given))
    assert [row.contacts for row in found.rows] == [[0, 2]]
    same(solved(given, True), solved(given, False))


def test_the_names_of_a_row_are_listed_once_however_often_they_are_read() -> None:
    # Listed anew for each channel, they would make the files of a chain take the square of its length.
    found = bead_rows(prepare(*tapered(Hertz(7.0e9))))
    assert found.contacts is found.contacts
    assert found.beads is found.beads


@pytest.mark.parametrize("law", [Hertz(300.0), Hertz(300.0, 2.0)], ids=["3/2", "2"])
def test_blocks_at_rest_of_a_long_row_are_woken_from_either_side(law: Hertz) -> None:
    """Struck at both ends and before a boundary of blocks, with gaps; a rod strikes the last bead."""
    speeds = {0: 1.0, 129: 2.0, 250: -1.0}
    beads = [Mass(f"m{i}", 0.5 + 0.5 * (i % 3), speeds.get(i, 0.0)) for i in range(550)]
    rod = Rod("rod", (UNIT,), FREE, FREE, velocity=-1.0)
    gaps = [0.0 if i % 5 else 1e-3 for i in range(550)]
    laws: Any = [*[law] * 549, Penalty(50.0)]
    mesh = FiniteElement(10, mass="lumped")
    fields: dict[str, Any] = {"gaps": gaps, "duration": 1.0, "records": 1000}
    given = in_a_row([*beads, rod], mesh, laws, CentralDifference(), STEP, **fields)
    ours, theirs = solved(given, True), solved(given, False)
    assert len(ours.events) > 40  # of all three waves
    same(ours, theirs, 51)
    rest = ours.assembly.memory.bead_contacts[REST]
    assert rest.sum() >= 1.0  # of the blocks that no wave has reached


def test_a_row_alone_is_stepped_without_the_loop_and_gives_its_snapshots() -> None:
    given = tapered(Hertz(300.0), snapshots=(0.0, 0.4003, 1.0, 1.6))
    ours, theirs = solved(given, True), solved(given, False)
    assert ours.assembly.clock.only_beads == 1
    for name, velocities in itertools.product(("m0", "m3", "m6"), (False, True)):
        found, wanted = (each.motions(np.arange(4), name, velocities) for each in (ours, theirs))
        assert found == pytest.approx(wanted, abs=1e-9)


def test_a_step_beyond_the_limit_of_the_law_is_refused_as_before() -> None:
    given = tapered(Hertz(5e7))
    with pytest.raises(
        StepError, match="at this overlap the tangent stiffness of the power law exceeds the stability limit"
    ):
        run(*given)


def test_coarse_steps_are_counted_as_before() -> None:
    given = tapered(Hertz(2e6))
    ours, theirs = solved(given, True), solved(given, False)
    counts = [[int(each[3]) for each in history.memories()] for history in (ours, theirs)]
    assert sum(counts[0]) > 100
    assert sum(counts[0]) == pytest.approx(sum(counts[1]), rel=0.02)  # the motion is chaotic at this step


def test_cut_steps_and_other_schemes_have_no_rows() -> None:
    rods = tapered(Hertz(300.0))
    assert bead_rows(prepare(*rods)).contacts
    assert not bead_rows(prepare(*rods.but(law=HuntCrossley(300.0, restitution=0.5)))).contacts
