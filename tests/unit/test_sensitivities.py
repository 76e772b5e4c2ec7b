"""Sensitivities of exact runs: against high-precision references, differences of runs, scaling laws and edges."""

from __future__ import annotations

import math
import re
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import impactlab as il
from impactlab import api
from impactlab.derivatives.stencil import slopes
from impactlab.errors import CaseError
from tests.reference.waves_mp import Struck, log_derivatives

pytestmark = pytest.mark.slow  # the march with tangents takes most of a minute to compile

MASS, AREA, YOUNG = "bodies.hammer.mass", "bodies.rod.area", "bodies.rod.material.young"
GAP, STIFFNESS, DAMPING = "contacts.0.gap", "contacts.0.law.stiffness", "contacts.0.law.damping"
HARD = {"kind": "wave_identification"}


def struck(
    mass: float = 0.5, law: dict[str, Any] = HARD, far_end: str = "clamped", duration: float = 3.0
) -> dict[str, Any]:
    """Return a case in units of the rod: E = rho = A = v0 = 1, L = 1/2, T = 1."""
    return {
        "schema_version": 1,
        "bodies": {
            "hammer": {"kind": "mass", "mass": mass, "velocity": 1.0},
            "rod": {
                "kind": "rod",
                "length": 0.5,
                "area": 1.0,
                "material": {"young": 1.0, "density": 1.0},
                "ends": {"right": far_end},
            },
        },
        "contacts": [{"between": ["hammer", "rod.left"], "gap": 0.0, "law": law}],
        "solve": {"duration": duration, "model": {"kind": "continuous"}},
    }


def random_case(draw: Any) -> dict[str, Any]:
    """Return a mass, two or three rods and perhaps a wall, with hard contacts and springs."""
    number = st.floats(0.3, 3.0)
    bodies: dict[str, Any] = {"hammer": {"kind": "mass", "mass": draw(number), "velocity": draw(number)}}
    contacts, before = [], "hammer"
    for k in range(draw(st.integers(1, 2))):
        bodies[f"rod{k}"] = {
            "kind": "rod",
            "length": draw(number),
            "area": draw(number),
            "material": {"young": draw(number), "density": draw(number)},
        }
        spring = {
            "kind": "penalty",
            "stiffness": draw(st.floats(2.0, 20.0)),
            "damping": draw(st.sampled_from([0.0, 0.3])),
        }
        law = draw(st.sampled_from([HARD, spring]))
        contacts.append({"between": [before, f"rod{k}.left"], "gap": draw(st.sampled_from([0.0, 0.1])), "law": law})
        before = f"rod{k}.right"
    end = draw(st.sampled_from(["free", "clamped", "spring", "dashpot"]))
    if end == "clamped":
        bodies[before.split(".")[0]]["ends"] = {"right": "clamped"}
    elif end != "free":
        bodies[before.split(".")[0]]["ends"] = {"right": {end: draw(number)}}
    return {
        "schema_version": 1,
        "bodies": bodies,
        "contacts": contacts,
        "solve": {"duration": 5.0, "model": {"kind": "continuous"}},
    }


random_cases = st.composite(random_case)()


PAPER = Struck()
REFERENCES = {
    "paper": PAPER,
    "spring": Struck(stiffness=6, damping="0.2"),
    "wall": Struck(mass=1, wall="0.35", duration=4),
    "overdamped": Struck(mass=2, stiffness=9, damping="2.5", velocity="1.4", duration=7),
    "closes_overlapped": Struck(mass="0.58", stiffness="4.31", damping="3.94", wall="0.12", duration=5),
    "many_contacts": Struck(mass="3.3", velocity="1.7", gap="0.1", modulus="1.9", wall="0.2", duration=4),
}
NAMES = {  # of the numbers of the reference
    MASS: "mass",
    "bodies.hammer.velocity": "velocity",
    AREA: "area",
    YOUNG: "modulus",
    "bodies.rod.material.density": "density",
    GAP: "gap",
    STIFFNESS: "stiffness",
    DAMPING: "damping",
    "contacts.1.gap": "wall",
}


def as_case(scene: Struck) -> il.Case:
    """Return a scene of the reference in fifty digits as a case."""
    law: dict[str, Any] = HARD
    if scene.stiffness is not None:
        law = {"kind": "penalty", "stiffness": float(scene.stiffness), "damping": float(scene.damping)}
    case = struck(float(scene.mass), law, "clamped" if scene.wall is None else "free", float(scene.duration))
    case["bodies"]["hammer"]["velocity"] = float(scene.velocity)
    rod, material = case["bodies"]["rod"], {"young": float(scene.modulus), "density": float(scene.density)}
    rod |= {"length": float(scene.length), "area": float(scene.area), "material": material}
    case["contacts"][0]["gap"] = float(scene.gap)
    if scene.wall is not None:
        case["bodies"]["wall"] = {"kind": "wall"}
        case["contacts"].append({"between": ["rod.right", "wall"], "gap": float(scene.wall), "law": HARD})
    return il.Case.from_dict(case)


@pytest.mark.parametrize("name", REFERENCES)
def test_derivatives_agree_with_a_second_program_in_fifty_digits(name):
    scene = REFERENCES[name]
    paths = [path for path, field in NAMES.items() if getattr(scene, field)]
    found = il.sensitivities(as_case(scene), paths, ["first_opening", "final_velocity", "impulse", "peak_force"])
    for path in paths:
        expected = log_derivatives(NAMES[path], scene)
        for quantity, label in (
            ("first_opening", "hammer|rod.left"),
            ("final_velocity", "hammer"),
            ("impulse", "hammer|rod.left"),
            ("peak_force", "hammer|rod.left"),
        ):
            row = found.find(quantity, path, label)
            assert row.logarithmic == pytest.approx(float(expected[quantity]), rel=1e-9, abs=1e-9), row


def test_faces_that_touch_have_a_derivative_by_the_gap_from_above():
    row = il.sensitivities(il.Case.from_dict(struck()), [GAP], ["first_opening"]).rows[0]
    assert row.derivative == pytest.approx(1.0, rel=1e-8)  # 1/v0: everything comes later
    assert math.isnan(row.below)
    assert "from above" in row.reason


def resting_rods(hammer: dict[str, Any]) -> il.Case:
    """Return a hammer that strikes a rod, on whose other end another rod rests: c = Z = 1."""
    rod = {"kind": "rod", "area": 1.0, "material": {"young": 1.0, "density": 1.0}}
    if hammer["kind"] == "rod":
        hammer = {**rod, **hammer}
    bodies = {"hammer": hammer, "middle": {**rod, "length": 1.0}, "last": {**rod, "length": 2.0}}
    struck_by = "hammer.right" if hammer["kind"] == "rod" else "hammer"
    contacts = [{"between": [struck_by, "middle.left"], "law": HARD},
                {"between": ["middle.right", "last.left"], "gap": 0.0, "law": HARD}]  # fmt: skip
    solve = {"duration": 2.5, "model": {"kind": "continuous"}}
    return il.Case.from_dict({"schema_version": 1, "bodies": bodies, "contacts": contacts, "solve": solve})


def test_a_gap_between_faces_at_rest_parts_their_closing_from_the_front():
    """Until a gap g is crossed at the velocity 1, the end is free: the contact lacks the time g and a force of 1/2."""
    case = resting_rods({"kind": "rod", "length": 0.5, "velocity": 1.0})
    found = il.sensitivities(case, ["contacts.1.gap"], ["impulse", "time_in_contact", "final_velocity"])
    for quantity, label, slope in (
        ("impulse", case.scene().contacts[1].name, -0.5),
        ("time_in_contact", case.scene().contacts[1].name, -1.0),
        ("final_velocity", "last", -0.25),
        ("impulse", case.scene().contacts[0].name, 0.0),
    ):
        row = found.find(quantity, "contacts.1.gap", label)
        assert row.derivative == pytest.approx(slope, rel=1e-6, abs=1e-6), row
        assert math.isnan(row.below)


def test_a_gap_that_adds_an_opening_leaves_no_derivative():
    """A gap leaves a short tension in the middle rod, which opens the contact with a mass for as long."""
    case = resting_rods({"kind": "mass", "mass": 1.0, "velocity": 1.0})
    row = il.sensitivities(case, ["contacts.1.gap"], ["impulse"]).rows[0]
    assert row.found == "withheld"
    assert "sequence of contacts" in row.reason
    assert row.lower == row.upper == 0.0


def test_faces_that_touch_without_a_force_are_at_an_edge():
    """A hammer of the impedance Z = 1 rests on the rod after its pulse: I = Z/(1 + Z) below, and a second pulse above.

    A rod that moves away at u is met later by u, at 1 - u: I = (1 - u)^2/2; one that moves up is pressed at once.
    """
    case = resting_rods({"kind": "rod", "length": 0.5, "velocity": 1.0})
    paths = ["bodies.hammer.area", "bodies.last.velocity"]
    found, (first, second) = il.sensitivities(case, paths, ["impulse"]), case.scene().contacts
    row = found.find("impulse", "bodies.hammer.area", first.name)
    assert row.derivative == row.below == pytest.approx(0.25, rel=1e-6)
    assert math.isnan(row.above)
    assert row.lower < row.upper == 1.0
    row = found.find("impulse", "bodies.last.velocity", second.name)
    assert row.derivative == row.above == pytest.approx(-1.0, rel=1e-6)
    assert math.isnan(row.below)
    assert row.lower == 0.0 < row.upper
    column = il.run(case).jacobian(f"force:{first.name}", [0.5, 1.5], ["bodies.hammer.area"])
    assert np.isnan(column).all()


@pytest.mark.parametrize("power", [4 / 3, 3 / 2, 2, 3])
def test_the_stated_error_of_a_one_sided_derivative_holds_for_broken_powers(power):
    """Faces pressed together from rest meet later by a broken power of the gap, so values have such a term, too."""
    found = slopes(lambda x: None if x < 0.0 else np.array([1.0 + 2.0 * x + 3.0 * x**power]), np.ones(1), 1e-3)
    assert abs(found.middle[0] - 2.0) <= 3.0 * found.error[0]
    assert found.error[0] < 3.0 * power * 1e-3 ** (power - 1.0)  # the slope of the last term where the stencil begins


@pytest.mark.parametrize(("alpha", "distance", "within"), [(1.0, 0.010701206637, 0.1), (1.0105, 0.000201206637, 0.02)])
def test_the_distance_to_the_vanishing_second_contact(alpha, distance, within):
    row = il.sensitivities(il.Case.from_dict(struck(0.5 / alpha)), [MASS], ["final_velocity"]).rows[0]
    assert 0.5 / row.lower - alpha == pytest.approx(distance, rel=within)


def test_the_exit_velocity_has_a_kink_where_the_second_contact_vanishes():
    slopes = []
    for alpha in (1.010701206637 - 1e-4, 1.010701206637 + 1e-4):
        row = il.sensitivities(il.Case.from_dict(struck(0.5 / alpha)), [MASS], ["final_velocity"]).rows[0]
        slopes.append(row.derivative * -0.5 / alpha**2)
    assert slopes[0] > 0.5
    assert slopes[1] == pytest.approx(-0.0912, abs=1e-4)


def test_a_hammer_that_just_grazes_the_rod_is_at_an_edge():
    """The second contact vanishes here, to the last digit: the velocity has a derivative on one side alone."""
    low, high = 1.0107, 1.0108  # of the mass of the rod over that of the hammer: two contacts, and one
    while (middle := 0.5 * (low + high)) not in (low, high):
        touches = len(il.run(il.Case.from_dict(struck(0.5 / middle))).contacts)
        low, high = (middle, high) if touches == 2 else (low, middle)
    for alpha in (low, high):
        row = il.sensitivities(il.Case.from_dict(struck(0.5 / alpha)), [MASS], ["final_velocity"]).rows[0]
        assert math.isnan(row.below) or math.isnan(row.above)
        assert "one-sided" in row.reason
        assert 0.5 / alpha == pytest.approx(row.lower if math.isnan(row.below) else row.upper, abs=1e-11)


def degrees(document: dict[str, Any], scale: str) -> dict[str, float]:
    """Return the powers of each number under a change of the scale of mass, time or length along the axis."""
    mass, time, length = ({"mass": (1.0, 0.0, 0.0), "time": (0.0, 1.0, 0.0), "length": (0.0, 0.0, 1.0)})[scale]
    stiffness, dashpot = mass - 2.0 * time, mass - time
    found = {MASS: mass, "bodies.hammer.velocity": length - time, "solve.duration": time}
    for name, body in document["bodies"].items():
        if body["kind"] == "rod":
            found[f"bodies.{name}.area"] = mass  # forces and masses go with the section
            found[f"bodies.{name}.length"] = length
            found[f"bodies.{name}.material.density"] = -length
            found[f"bodies.{name}.material.young"] = length - 2.0 * time
            end = body.get("ends", {}).get("right")
            if isinstance(end, dict):
                [kind] = end
                found[f"bodies.{name}.ends.right.{kind}"] = stiffness if kind == "spring" else dashpot
    for number, contact in enumerate(document["contacts"]):
        if contact["gap"]:
            found[f"contacts.{number}.gap"] = length
        if contact["law"]["kind"] == "penalty":
            found[f"contacts.{number}.law.stiffness"] = stiffness
            if contact["law"]["damping"]:
                found[f"contacts.{number}.law.damping"] = dashpot
    return {path: power for path, power in found.items() if power}


ANSWERS = {  # powers of mass, time and length
    "first_opening": (0.0, 1.0, 0.0),
    "final_velocity": (0.0, -1.0, 1.0),
    "peak_force": (1.0, -2.0, 1.0),
    "impulse": (1.0, -1.0, 1.0),
    "final_energy": (1.0, -2.0, 2.0),
    "restitution": (0.0, 0.0, 0.0),
}


@settings(max_examples=5, deadline=None, derandomize=True, phases=[Phase.generate])
@given(document=random_cases)
def test_scales_of_mass_time_and_length(document):
    """A change of scale: the sum of powers times logarithmic derivatives is the power of the quantity."""
    scales = {scale: degrees(document, scale) for scale in ("mass", "time", "length")}
    paths = sorted(set().union(*scales.values()))
    found = il.sensitivities(il.Case.from_dict(document), paths, list(ANSWERS))
    for (place, powers), (name, answer) in product(enumerate(scales.values()), ANSWERS.items()):
        for label in {row.label for row in found if row.quantity == name}:
            rows = [found.find(name, path, label) for path in powers]
            if any(row.found != "tangent" for row in rows) or not abs(rows[0].value) > 1e-6:
                continue
            size = max(1.0, *(abs(row.logarithmic) for row in rows))
            total = sum(powers[row.parameter] * row.logarithmic for row in rows)
            assert total == pytest.approx(answer[place], abs=1e-9 * size), (place, name, label)


@settings(max_examples=12, deadline=None, derandomize=True, phases=[Phase.generate])
@given(document=random_cases, data=st.data())
def test_tangents_are_the_limits_of_differences_of_runs(document, data):
    case = il.Case.from_dict(document)
    rods = [name for name, body in document["bodies"].items() if body["kind"] == "rod"]
    rod = data.draw(st.sampled_from(rods))
    path = data.draw(
        st.sampled_from([MASS, "bodies.hammer.velocity", f"bodies.{rod}.length", f"bodies.{rod}.material.density"])
    )
    rows = [
        row
        for row in il.sensitivities(case, [path], ["first_opening", "final_velocity", "impulse"])
        if not math.isnan(row.derivative)
    ]
    if not rows:
        return
    value = rows[0].parameter_value
    if min(value - rows[0].lower, rows[0].upper - value) < 2e-2 * value:
        return
    width = 2e-4 * value
    weights = {-3: -1 / 60, -2: 3 / 20, -1: -3 / 4, 1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
    beside = {
        place: il.sweep(
            case, {path: [value + place * width]}, quantities=["first_opening", "final_velocity", "impulse"]
        )
        for place in weights
    }
    for row in rows:
        truth = (
            sum(weight * float(np.ravel(_value(beside[place], row))[0]) for place, weight in weights.items()) / width
        )
        assert row.derivative == pytest.approx(truth, rel=1e-6, abs=1e-8 * (abs(row.value) / value + 1.0)), row


def _value(found: Any, row: Any) -> Any:
    each = found[row.quantity]
    over = next((dim for dim in each.dims if dim in ("contact", "pair", "body")), None)
    return each.sel({over: row.label}).values if over else each.values


def test_fronts_that_arrive_together_and_part_have_differences_of_runs():
    """Two segments of equal travel time: the echoes of both meet; their lengths move them apart."""
    document = struck()
    rod = document["bodies"]["rod"]
    material = rod.pop("material")
    del rod["length"], rod["area"]
    rod["segments"] = [
        {"length": 0.25, "area": 1.0, "material": material},
        {"length": 0.25, "area": 2.0, "material": material},
    ]
    path = "bodies.rod.segments.0.length"
    case = il.Case.from_dict(document)
    row = il.sensitivities(case, [path], ["first_opening"]).rows[0]
    width = 1e-4
    runs = [il.run(case.with_(path, 0.25 + step * width)).contacts[0].end for step in (-2, -1, 1, 2)]
    truth = (8 * (runs[2] - runs[1]) - (runs[3] - runs[0])) / (12 * width)
    assert row.derivative == pytest.approx(truth, rel=1e-7)


def test_the_derivative_of_a_signal_at_given_times():
    case = il.Case.from_dict(struck())
    history = il.run(case)
    times = np.array([0.2, 0.7, 1.2, 1.7])
    found = history.jacobian("force:hammer|rod.left", times, [MASS, "bodies.hammer.velocity"])
    assert found.shape == (4, 2)
    # Until the wave returns the force is v0 exp(-t/M): its derivative by M is t/M^2 of it.
    assert found[:2, 0] == pytest.approx(times[:2] / 0.25 * np.exp(-times[:2] / 0.5), rel=1e-10)
    assert found[:, 1] == pytest.approx(history.evaluate(times, "force:hammer|rod.left"), rel=1e-9, abs=1e-12)


def test_counts_have_no_derivative():
    row = il.sensitivities(il.Case.from_dict(struck()), [MASS], ["contacts"]).rows[0]
    assert row.found == "withheld"
    assert math.isnan(row.derivative)


@pytest.mark.parametrize(
    ("paths", "said"),
    [
        (["bodies.hammer.weight"], "mass"),
        ([MASS, MASS], "twice"),
        (["contacts.0.law.kind"], "not a number"),
        ([], "no parameter"),
        (["solve.step.dt"], "the step is fixed"),
        ("solve.step.courant, bodies.hammer.mass", "the step is fixed"),
        (["solve.step.points_per_period"], "the step is fixed"),
        (["solve.tolerance"], "the tolerance chooses a method"),
        (["schema_version"], "the version of the format"),
        (["solve.model.modes"], "a whole number: it changes in steps"),
        (["solve.records"], "a whole number: it changes in steps"),
    ],
)
def test_wrong_parameters_are_refused_by_name(paths, said, monkeypatch):
    monkeypatch.setattr(api, "run", lambda *_: pytest.fail("a run was started"))
    scene = struck(law={"kind": "penalty", "stiffness": 10.0})
    if "modes" in "".join(paths):
        scene["solve"] = {"duration": 3.0, "model": {"kind": "modal", "modes": 20}}
        scene["solve"] |= {"integrator": {"kind": "exact_modal"}, "step": {"dt": 0.01}}
    with pytest.raises(CaseError, match=said) as raised:
        il.sensitivities(il.Case.from_dict(scene), paths)
    assert raised.value.remedy


def of_section(**section: Any) -> il.Case:
    scene = struck()
    del scene["bodies"]["rod"]["area"]
    scene["bodies"]["rod"] |= section
    return il.Case.from_dict(scene)


@pytest.mark.parametrize(
    ("section", "power"),
    [({"diameter": "50 cm"}, 2.0), ({"width": 0.5, "height": 0.25}, 1.0)],
    ids=("circle", "rectangle"),
)
def test_a_number_that_the_case_turns_into_others_is_a_parameter(section, power):
    """F = Z v0 at the touch, and Z grows as the area: as the square of a diameter, as a width or a height."""
    for key in section:
        (row,) = il.sensitivities(of_section(**section), [f"bodies.rod.{key}"], ["peak_force"])
        assert row.parameter_unit == "m"
        (of_area,) = il.sensitivities(
            il.Case.from_dict(with_area(of_section(**section).resolved()["bodies"]["rod"]["area"])),
            ["bodies.rod.area"],
            ["peak_force"],
        )
        assert row.logarithmic == pytest.approx(power * of_area.logarithmic, rel=1e-6)


def with_area(area: float) -> dict[str, Any]:
    scene = struck()
    scene["bodies"]["rod"]["area"] = area
    return scene


def test_a_number_that_the_case_makes_from_others_is_refused_with_a_remedy(monkeypatch):
    """Both sides of an area beside a diameter were refused: the sequence of contacts was said to change there."""
    monkeypatch.setattr(api, "run", lambda *_: pytest.fail("a run was started"))
    with pytest.raises(CaseError, match="cannot change this number alone") as raised:
        il.sensitivities(of_section(diameter=0.5), ["bodies.rod.area"])
    assert "a diameter in place of its area" in raised.value.remedy
    assert raised.value.path == "bodies.rod.area"


def test_the_python_of_the_page_runs(monkeypatch):
    root = Path(__file__).parents[2]
    monkeypatch.chdir(root)
    page = (root / "docs" / "sensitivities.md").read_text(encoding="utf-8")
    derivatives, optimum = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict[str, Any] = {}
    exec(derivatives, names)
    assert names["row"].logarithmic == pytest.approx(1.328847400921, rel=1e-9)
    exec(optimum, names)
    assert names["best"].fun == pytest.approx(1.402, rel=1e-3)  # 14.02 kN, as its last line says
    assert names["start"] * names["best"].x == pytest.approx([1.937, 120.5e6], rel=1e-2)


def test_a_delay_of_the_whole_impact_brings_no_edge():
    """A gap that is closed later moves all events alike: only the end of the run cuts the sequence of contacts."""
    case = il.Case.from_dict(struck(duration=3.5)).with_(GAP, 0.05)
    row = il.sensitivities(case, [GAP], ["first_opening"]).rows[0]
    last = il.run(case).contacts[-1].end
    assert last is not None
    assert row.upper == pytest.approx(0.05 + (3.5 - last), rel=1e-6)
    assert row.lower == -math.inf


def test_a_kink_beside_the_value_spoils_no_difference_of_runs() -> None:
    """A front that passes the end of a contact at 0.1 % more of a length: found 7 % off, with an error of 1 %."""
    aluminium, steel, soft = ({"young": y, "density": d} for y, d in ((7e10, 2700), (2.1e11, 7850), (3e9, 1200)))
    pieces = [
        {"length": 0.14977, "area": 3.822e-4, "material": aluminium},
        {"length": 0.16171, "area": 1.1605e-4, "material": steel},
    ]
    others = [
        {"length": 0.42439, "area": 3.3705e-4, "material": soft},
        {"length": 0.10165, "area": 3.2621e-4, "material": aluminium},
    ]
    pushed = {"t": [3.7777e-05, 9.2906e-05, 1.3199e-4, 1.4517e-4], "f": [0.0, -11122.0, 17328.0, 0.0]}
    case = il.Case(
        bodies={
            "one": il.Rod(segments=pieces, velocity=2.8474, ends={"left": {"force": pushed}}),
            "between": il.Mass(0.15295), "two": il.Rod(segments=others), "last": il.Mass(5.8358), "wall": il.Wall(),
        },
        contacts=[
            il.Contact("one.right", "between", {"kind": "addition_deletion"}),
            il.Contact("between", "two.left", {"kind": "penalty", "stiffness": 3.7864e8}),
            il.Contact("two.right", "last", {"kind": "addition_deletion"}, gap=1e-4),
            il.Contact("last", "wall", {"kind": "penalty", "stiffness": 6.2875e7, "damping": 3403.1}),
        ],
        solve={"duration": 7.047e-4, "model": {"kind": "continuous"}},
    )  # fmt: skip
    path, length = "bodies.one.segments.1.length", 0.16171

    def impulse(value: float) -> float:
        return il.run(case.with_(path, value)).impulse_of("one.right|between")

    step = 1e-6 * length
    row = il.sensitivities(case, [path], ["impulse"]).find("impulse", path, "one.right|between")
    assert row.derivative == pytest.approx((impulse(length + step) - impulse(length - step)) / (2.0 * step), rel=1e-6)
    assert row.error < 1e-6


def test_the_derivative_of_a_signal_beside_a_front_is_that_of_its_own_side() -> None:
    """The front reaches the middle at 150 us; a stiffer rod lets it pass earlier, by 0.75 us a hundredth."""
    rod = {"kind": "rod", "length": 0.5, "area": 2.5e-4, "material": {"young": 2e11, "density": 8000.0}}
    bodies = {"hammer": {"kind": "mass", "mass": 1.0, "velocity": 1.0}, "rod": rod}
    struck = {"between": ["hammer", "rod.left"], "law": {"kind": "addition_deletion"}}
    probe = {"body": "rod", "at": 0.25, "quantity": "velocity"}
    solve = {"duration": 2e-4, "model": {"kind": "continuous"}}
    blocks = {"schema_version": 1, "bodies": bodies, "contacts": [struck], "probes": [probe], "solve": solve}
    case, path, channel = il.Case.from_dict(blocks), "bodies.rod.material.young", "velocity:rod@0.25"
    for before, t in ((True, 150e-6 + np.array([-1e-7, -3e-8, -1e-9])), (False, 150e-6 + np.array([1e-9, 3e-8, 1e-7]))):
        found = il.run(case).jacobian(channel, t, [path])[:, 0] * 2e11
        sides = [il.run(case.with_(path, 2e11 * (1.0 + step))).evaluate(t, channel) for step in (-1e-6, 1e-6)]
        far = slice(0, 2) if before else slice(1, 3)  # the runs beside pass the front within 0.15 ns
        np.testing.assert_allclose(found[far], ((sides[1] - sides[0]) / 2e-6)[far], rtol=1e-4)
        assert np.ptp(found) < 1e-3 * np.abs(found).max()


def test_a_front_that_takes_all_of_the_force_is_at_an_edge():
    # Striker and rod have one impedance: as the rod's spring end sends the wave back, the force falls to 0 and rises
    # again. With a smaller rod the contact opens there, at 0.6 instead of 4.56: the faces part by as much as the square
    # of the difference, which counts from 1e-12 of the displacements on.
    rods = {
        "a": il.Rod(length=1.0, area=2.0, material={"young": 1.0, "density": 1.0}, velocity=1.0),
        "r": il.Rod(length=0.5, area=1.0, material={"young": 4.0, "density": 1.0}, ends={"right": {"spring": 1.85}}),
    }
    contact = il.Contact("a.right", "r.left", {"kind": "addition_deletion"}, gap=0.1)
    case = il.Case(bodies=rods, contacts=[contact], solve={"model": {"kind": "continuous"}, "duration": 6.0})
    area, speed = "bodies.r.area", "bodies.a.velocity"
    found = il.sensitivities(case, [area, speed], ["first_opening"])
    row = found.find("first_opening", area)
    opens = [il.run(case.with_(area, value)).spans("a.right|r.left")[0].end for value in (1.0 - 1e-5, 1.0, 1.0 + 1e-6)]
    assert opens[0] < 0.7 < 4.0 < opens[1]
    assert row.derivative == pytest.approx((opens[2] - opens[1]) / 1e-6, rel=1e-4)
    assert math.isnan(row.below)
    assert row.lower == 1.0
    assert "from above only" in row.reason
    assert not found.find("first_opening", speed).reason  # the speed scales the force, 0 stays 0


def test_a_signal_that_jumps_at_a_time_has_no_derivative_by_a_number_that_moves_the_front():
    bodies = {
        "m": il.Mass(1.0, velocity=1.0),
        "r": il.Rod(length=1.0, area=1.0, material={"young": 1.0, "density": 1.0}, ends={"right": "free"}),
    }
    contact = il.Contact("m", "r.left", {"kind": "addition_deletion"}, gap=0.1)
    probes = [{"body": "r", "at": 0.1, "quantity": "stress"}]
    solve = {"model": {"kind": "continuous"}, "duration": 3.0}
    case = il.Case(bodies=bodies, contacts=[contact], probes=probes, solve=solve)
    # the front is at x = 0.1 at 0.2, and comes back from the free end at 2.0: sooner if the mass is faster
    channel = il.Sampled("stress:r@0.1", [0.2, 1.0, 2.0])
    rows = il.sensitivities(case, ["bodies.m.velocity"], [channel]).rows
    assert [math.isnan(row.derivative) for row in rows] == [True, False, True]


def test_a_case_without_a_contact_lacks_its_contact_quantities_with_the_reason():
    case = il.load_case("step_loaded_rod")
    found = il.sensitivities(case, ["bodies.rod.material.young"], ["peak_force", "final_velocity"])
    lacking, own = found.rows
    assert (lacking.quantity, lacking.label, lacking.found) == ("peak_force", "", "withheld")
    assert lacking.reason == "the case has no contact"
    assert own.label == "rod"


def test_a_contact_by_number_and_by_name_is_one_parameter():
    scene = struck()
    scene["contacts"][0]["name"] = "cushion"
    with pytest.raises(CaseError, match=r"given twice: contacts\.0\.gap is the same number"):
        il.sensitivities(il.Case.from_dict(scene), ["contacts.0.gap", "contacts.cushion.gap"])


@pytest.mark.parametrize("model", ["continuous", "finite_element"])
def test_a_quantity_without_a_value_has_no_derivative_with_the_reason(model):
    scene = struck(law={"kind": "penalty", "stiffness": 10.0}, duration=0.3)
    scene["bodies"]["other"] = {"kind": "mass", "mass": 1.0}
    scene["contacts"].append({"between": ["other", "hammer"], "gap": 5.0, "law": scene["contacts"][0]["law"]})
    if model == "finite_element":
        scene["solve"]["model"] = {"kind": model, "elements": 20, "mass": "lumped"}
        scene["solve"]["integrator"] = {"kind": "central_difference"}
        scene["solve"]["step"] = {"courant": 0.5}
    found = il.sensitivities(il.Case.from_dict(scene), [MASS], ["first_opening", "restitution", "impulse"])
    opening, meeting = found.find("first_opening", MASS), found.find("restitution", MASS, "other|hammer")
    assert (opening.reason, opening.found) == ("the contact does not open in this run", "withheld")
    assert (meeting.reason, meeting.found) == (
        "in this run the two bodies do not meet and part without other influences",
        "withheld",
    )
    assert found.find("impulse", MASS).reason == ""
    assert "does not open" in str(found)


def test_a_gap_that_only_delays_all_fronts_changes_no_peak():
    """Three rods alike, the first moves: its gap to the second delays the motion, and every peak stays as it is.

    In the peak of the second contact fronts meet that have crossed one rod, two rods or three; a gap below zero is not
    allowed, so that its derivative has one side.
    """
    rod = {"length": 1.0, "area": 1.0, "material": {"young": 1.0, "density": 1.0}}
    bodies = {"a": il.Rod(velocity=1.0, **rod), "b": il.Rod(**rod), "c": il.Rod(**rod)}
    spring = {"kind": "penalty", "stiffness": 2.0}
    contacts = [il.Contact("a.right", "b.left", spring), il.Contact("b.right", "c.left", HARD)]
    case = il.Case(bodies=bodies, contacts=contacts, solve={"model": {"kind": "continuous"}, "duration": 5.0})
    found = il.sensitivities(case, [GAP], ["peak_force", "impulse", "first_opening"])
    for label in ("a.right|b.left", "b.right|c.left"):
        assert found.find("peak_force", GAP, label).derivative == pytest.approx(0.0, abs=1e-6)
        assert found.find("impulse", GAP, label).derivative == pytest.approx(0.0, abs=1e-6)
        assert found.find("first_opening", GAP, label).derivative == pytest.approx(1.0, abs=1e-6)  # at 1 m/s
