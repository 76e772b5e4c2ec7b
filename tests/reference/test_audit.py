"""Random scenes against independent programs: the programs against each other, and the package beside them."""

from __future__ import annotations

import copy
import functools
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impactlab as il
from studies.audit import answers, compare, families, measure, references, scenes, smooth, summary, truth

# The independent programs are compiled first.
pytestmark = pytest.mark.slow


def ball_on_wall(law: scenes.Doc, gap: float = 7.767e-5) -> scenes.Doc:
    """Return a ball of 1 kg at 1 m/s before a wall."""
    bodies = {"ball": {"kind": "mass", "mass": 1.0, "velocity": 1.0}, "wall": {"kind": "wall"}}
    return scenes.finished(bodies, [{"between": ["ball", "wall"], "gap": gap, "law": law}], 5e-3, 1e-8)


@pytest.mark.parametrize("zeta", [0.1, 0.6, 0.9])
def test_truth_has_the_closed_form_of_a_spring_and_dashpot(zeta: float) -> None:
    answer = truth.solve(ball_on_wall({"kind": "penalty", "stiffness": 1.0e6, "damping": 2000.0 * zeta}))
    exit_speed = math.exp(-2.0 * zeta * math.acos(zeta) / math.sqrt(1.0 - zeta**2))
    assert answer.impulses["ball|wall"] == pytest.approx(1.0 + exit_speed, rel=1e-10)
    assert len(answer.jumps["ball|wall"]) == 1
    assert answer.jumps["ball|wall"][0] == pytest.approx((7.767e-5, 2000.0 * zeta), rel=1e-9)


def test_truth_has_the_restitution_of_khulief_and_shabana() -> None:
    answer = truth.solve(ball_on_wall({"kind": "khulief_shabana", "stiffness": 1.0e6, "restitution": 0.37}))
    assert answer.impulses["ball|wall"] == pytest.approx(1.37, rel=1e-10)


def test_truth_agrees_with_an_integrator_of_order_eight() -> None:
    k, n, factor, gap = 3.0e8, 1.7, 0.45, 2e-4
    law = {"kind": "hunt_crossley", "stiffness": k, "exponent": n, "restitution": 1.0 - factor / 1.5}
    answer = truth.solve(ball_on_wall(law, gap))

    def rate(t: float, y: np.ndarray) -> list[float]:
        push = k * max(0.0, y[0]) ** n * (1.0 + factor * y[1])
        return [y[1], -max(0.0, push)]

    parted: Any = lambda t, y: y[0] + 1e-300 if t > 0.0 else 1.0  # noqa: E731
    parted.terminal, parted.direction = True, -1.0
    found = solve_ivp(rate, (0.0, 5e-3), [0.0, 1.0], method="DOP853", rtol=1e-12, atol=1e-18, events=parted)
    assert answer.impulses["ball|wall"] == pytest.approx(1.0 - found.y[1, -1], rel=1e-8)
    late = answer.displacements["position:ball"][-1]
    assert late == pytest.approx(gap + found.y[1, -1] * (answer.times[-1] - gap - found.t[-1]), rel=1e-7)


def ball_on_bar() -> scenes.Doc:
    """Return a ball that strikes a steel bar through Hunt and Crossley's law."""
    steel = {"young": 2.1e11, "density": 7900.0}
    bodies = {
        "ball": {"kind": "mass", "mass": 0.065, "velocity": 2.0},
        "bar": {"kind": "rod", "length": 0.5, "area": 1.13e-4, "material": steel},
    }
    law = {"kind": "hunt_crossley", "stiffness": 1.9e10, "restitution": 0.7}
    return scenes.finished(bodies, [{"between": ["ball", "bar.left"], "law": law}], 3.8e-4, 1e-3)


def test_two_programs_agree_on_a_bar() -> None:
    waves, modes = truth.solve(ball_on_bar()), smooth.solve(ball_on_bar())
    assert waves.impulses["ball|bar.left"] == pytest.approx(0.1706811, rel=1e-6)  # until the wave is back: cases/
    found = compare.errors(modes, waves, 1e-4)
    assert found["displacement"] < 3e-5
    assert found["impulse"] < 1e-6
    assert found["peak"] < 3e-4


def test_modes_have_the_impact_on_a_beam_of_timoshenko() -> None:
    steel = {"young": 2.157463e11, "density": 7960.0, "poisson": 0.3}
    beam = {"kind": "beam", "length": 0.1535, "section": {"width": 0.01, "height": 0.01}, "material": steel}
    bodies = {
        "sphere": {"kind": "mass", "mass": 0.0333427700300997, "velocity": 0.01},
        "beam": {**beam, "ends": {"left": "pinned", "right": "pinned"}},
    }
    law = {"kind": "hertz", "stiffness": 1.5805589743589745e10}
    contact = {"between": ["sphere", "beam.at(0.07675)"], "law": law}
    answer = smooth.solve(scenes.finished(bodies, [contact], 2e-4, 1e-3))
    assert answer.impulses["sphere|beam.at(0.07675)"] == pytest.approx(4.34231e-4, rel=2e-6)
    assert answer.peaks["sphere|beam.at(0.07675)"] == pytest.approx(4.97714, rel=1e-5)


def test_errors_do_not_hang_on_a_common_speed() -> None:
    doc, fast = ball_on_bar(), copy.deepcopy(ball_on_bar())
    fast["bodies"]["ball"]["velocity"] += 30.0
    fast["bodies"]["bar"]["velocity"] = 30.0
    slow_truth, fast_truth = truth.solve(doc), truth.solve(fast)
    for answer in (slow_truth, fast_truth):
        shifted = copy.deepcopy(answer)
        shifted.displacements["position:ball"] = shifted.displacements["position:ball"] + 1e-7
        answer.uncertainty = compare.errors(shifted, answer, 1e-4)
    assert fast_truth.uncertainty["displacement"] == pytest.approx(slow_truth.uncertainty["displacement"], rel=1e-3)
    assert fast_truth.uncertainty["displacement_ground"] < 0.1 * slow_truth.uncertainty["displacement_ground"]


def test_same_seed_gives_same_cases() -> None:
    for family in families.FAMILIES:
        one, same, other = (families.draw(family, seed, 4).doc for seed in (1, 1, 2))
        assert one == same != other
    assert len(list(scenes.scan())) == 369


def test_row_counts_silent_and_warned_apart() -> None:
    row = measure.measured(next(iter(scenes.scan())))
    assert row["status"] == "ran"
    assert str(row["known"]) == "1"
    silent = {**row, "true": 2.0 * row["tolerance"], "met": 1, "warned": ""}
    warned = {**silent, "met": 0, "warned": "tolerance_not_met"}
    cells = summary.line("scan", [silent, warned, {**row, "true": 0.0}])
    assert cells[4:6] == ["1", "1"]


@functools.cache
def of_masses_that_touch_at_rest() -> dict[str, Any]:
    """Return the first quarter of a scene: the touches at rest are at its beginning, and its truth takes seconds."""
    drawn = families.draw("rigid", 303, 38)
    drawn.doc["solve"]["duration"] *= 0.25
    return references.claimed(drawn)


def test_references_that_claim_too_much_are_counted() -> None:
    row = of_masses_that_touch_at_rest()
    assert references.is_judged(row)
    boast = {**row, "claimed": 1e-9, "true": 1e-4, "uncertainty": 1e-10}
    assert references.line("rigid", [boast])[4] == "0"


def exactly(doc: scenes.Doc) -> scenes.Doc:
    """Return a case under the exact solver."""
    del doc["solve"]["tolerance"]
    doc["solve"]["model"] = {"kind": "continuous"}
    for contact in doc["contacts"]:
        contact.setdefault("law", {"kind": "addition_deletion"})
    return doc


def test_fronts_pass_through_closed_contacts() -> None:
    doc = families.draw("exact", 5, 4).doc  # three rods in a row: a contact that grazes tells
    answer = truth.solve(doc)
    found = compare.errors(measure.seen(il.run(measure.case_for(exactly(doc))), answer), answer, 1e-4)
    assert found["displacement"] < 1e-5
    assert found["impulse"] < 1e-5


@pytest.mark.parametrize("number", range(0, 40, 3))  # in numbers 17 and 20 it stops
def test_exact_solver_and_truth_agree(number: int) -> None:
    doc = families.draw("exact", 20, number).doc
    doc["solve"]["tolerance"] = 1e-4
    answer = truth.solve(doc)
    found = compare.errors(measure.seen(il.run(measure.case_for(exactly(doc))), answer), answer, 1e-4)
    assert max(found.values()) <= 1e-6 + 3.0 * max(answer.uncertainty.values())
    assert max(answer.uncertainty.values()) <= 1e-5


def test_the_restitution_of_a_rod_with_a_mass_at_its_end_counts_that_mass_in_both_programs() -> None:
    """Khulief and Shabana's dashpot follows from the masses of both bodies."""
    titanium = {"young": 1.1e11, "density": 4430.0}
    bodies = {
        "one": {"kind": "rod", "length": 0.3, "area": 1.3e-4, "material": titanium, "velocity": 0.3},
        "two": {"kind": "rod", "length": 0.4, "area": 8e-4, "material": titanium, "ends": {"right": {"mass": 3.7}}},
    }
    law = {"kind": "khulief_shabana", "stiffness": 7.8e8, "restitution": 0.6}
    doc = scenes.finished(bodies, [{"between": ["one.right", "two.left"], "law": law}], 4e-4, 1e-3)
    waves, modes, history = truth.solve(doc), smooth.solve(doc), il.run(measure.case_for(exactly(doc)))
    found = compare.errors(measure.seen(history, waves), waves, 1e-3)
    assert max(found[name] for name in compare.JUDGED) < 1e-6
    assert compare.errors(modes, waves, 1e-3)["impulse"] < 1e-4


@pytest.mark.parametrize("family", ["power_law", "dashpot"])
def test_waves_and_modes_agree(family: str) -> None:
    agreed = 0
    for number in range(16):
        doc = families.draw(family, 21, number).doc
        held = [end for body in doc["bodies"].values() for end in body.get("ends", {}).values()]
        waves = any(body["kind"] == "rod" for body in doc["bodies"].values())
        # A mesh sends noise ahead of fronts, to which a second contact with hysteresis would answer.
        if waves and len(doc["contacts"]) == 1 and not any("dashpot" in end for end in held):
            found = compare.errors(smooth.walk(doc, 14, 800), answers.solve(doc), 1e-4)
            assert found["displacement"] < 3e-3
            assert found["impulse"] < 3e-4
            agreed += 1
    assert agreed >= 3


def test_truth_of_faces_at_rest_against_each_other_has_the_least_speed_of_approach() -> None:
    """Rods at rest, one against the other, under a law that divides its damping by a speed that is zero."""
    doc = families.draw("power_law", 303, 37).doc
    net = truth.read(doc)
    rough, fine = (truth.answer(doc, net, truth.walk(net, *level)[1]).impulses for level in truth.LEVELS[:2])
    assert len(rough) == 2
    assert rough == pytest.approx(fine, rel=1e-6)


def test_truths_that_do_not_come_nearer_to_each_other_are_less_well_known(monkeypatch: pytest.MonkeyPatch) -> None:
    impulses = iter([1.0, 1.01, 1.02, 1.03, 1.04])

    def drifting(*_: Any) -> truth.Truth:
        return truth.Truth(np.array([0.5]), {}, {}, {"a|b": next(impulses)}, {}, {}, {}, math.nan, 1)

    monkeypatch.setattr(truth, "walk", lambda *_: (None, None))
    monkeypatch.setattr(truth, "answer", drifting)
    found = truth.solve(ball_on_wall({"kind": "hertz", "stiffness": 1.0e6}))
    assert found.uncertainty["impulse"] > 0.09


def test_a_reference_ends_where_touches_at_rest_make_adaptive_steps_tiny() -> None:
    """Masses in a row that touch at rest: the damping of Flores, over the least speed, is stiff."""
    row = of_masses_that_touch_at_rest()
    assert row["uncertainty"] < 0.1 * row["claimed"]
    assert row["true"] < row["claimed"] < 1e-5


@pytest.mark.parametrize(("family", "number"), [("exact", 13), ("beam", 5)])
def test_references_of_the_first_order_do_not_claim_the_second(family: str, number: int) -> None:
    """Fronts on a mesh that disperses them; modes of a beam with shear: three levels show more by luck."""
    row = references.claimed(families.draw(family, 304, number))
    assert row["uncertainty"] < 0.2 * row["claimed"]
    assert 0.0 < row["true"] <= row["claimed"]


COSTLY = {"beam": 2, "damped": 3}  # scenes of families whose truth takes seconds


@pytest.mark.parametrize("family", list(families.FAMILIES))
def test_no_run_is_beyond_its_tolerance_in_silence(family: str) -> None:
    count = COSTLY.get(family, 12)
    rows = [measure.measured(families.draw(family, 22, number)) for number in range(count)]
    known = [row for row in rows if str(row["known"]) == "1"]
    assert len(known) >= count // 2
    assert not [row["number"] for row in known if summary.is_beyond(row) and not summary.is_warned(row)]


# A force that rises at the end of the run, one that a jump on its way lets be read at its steepest, long contacts.
@pytest.mark.parametrize(
    ("family", "number"), [("power_law", 98), ("damped", 107), ("rigid", 38), ("dashpot", 44), ("dashpot", 53)]
)
def test_no_peak_read_where_the_force_is_steep_is_beyond_its_tolerance(family: str, number: int) -> None:
    row = measure.measured(families.draw(family, 20261122, number))
    assert str(row["known"]) == "1"
    assert not summary.is_beyond(row)


def test_no_dashpot_that_touches_inside_a_step_is_beyond_its_tolerance() -> None:
    rows = [measure.measured(drawn) for drawn in list(scenes.scan())[::10]]
    assert not [row["number"] for row in rows if summary.is_beyond(row)]
