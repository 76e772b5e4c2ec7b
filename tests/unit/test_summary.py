"""The summary has the keys of the contract, in plain finite JSON; the table has one line per method."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab import api
from impactlab.history import ContactSpan, Cost, EnergyBook, Event, Warned
from impactlab.history.extremes import extremes
from impactlab.plugins import kind_of
from impactlab.printing import plain
from impactlab.report import summary
from impactlab.report.comparison import cell, comparison, table, table_rows
from impactlab.report.console import summary_text
from impactlab.report.facts import method_facts, units_of
from impactlab.report.summary import describe, summarise
from impactlab.report.table import page_rows
from impactlab.scene import Probe
from impactlab.scene.method import Simulation
from impactlab.testing.scenes import UNIT, mass_on_rod
from impactlab.types import Relative
from tests.unit.synthetic import SyntheticHistory, SyntheticLaw

PAIR = "hammer|rod.left"
T = 2.0


@dataclasses.dataclass(frozen=True)
class SoftSpring(SyntheticLaw):
    """Stands for a law with options."""

    stiffness: float | Relative = 1.0
    damping: float = 0.0


@dataclasses.dataclass(frozen=True)
class ModalLike:
    """Stands for a model that steps."""

    elements: int | None = None
    modes: int | None = None


class WaveTrain(ModalLike):
    """Stands for a model that does not step."""


@dataclasses.dataclass(frozen=True)
class SlowNewmark:
    """Stands for an integrator."""

    beta: float = 0.25


def scene(model: Any) -> Simulation:
    law: Any = SoftSpring(Relative(0.8), 0.1)
    integrator: Any = SlowNewmark()
    probes = (Probe("rod", 0.0, "displacement"),)
    return mass_on_rod(model, law, integrator, segments=(UNIT,), probes=probes)


def history(model: Any = None, **changes: Any) -> SyntheticHistory:
    grid = np.linspace(0.0, 3 * T, 7)
    book = EnergyBook(
        grid,
        {"hammer": np.full(7, 1.5), "rod": np.array([0.5, 0.6, 0.4, 0.4, 0.4, 0.4, 0.4])},
        np.zeros(7),
        {"contact": np.array([0.0, 0.0, 0.1, 0.1, 0.1, 0.1, 0.1])},
        np.zeros(7),
    )
    given: dict[str, Any] = {
        "events": (Event(0.0, PAIR, "close"), Event(1.5 * T, PAIR, "open"), Event(1.6 * T, PAIR, "impulse", 0.25)),
        "contacts": (ContactSpan(PAIR, 0.0, 1.5 * T, 3.6, 2.0),),
        "energy": book,
        "dt": 0.01,
        "warnings": (Warned("near_grazing", "a touch was nearly missed"),),
        "cost": Cost(0.5, 0.25, 600),
    }
    signals: dict[str, Any] = {
        "position:hammer": np.sin,
        "velocity:hammer": np.cos,
        "displacement:rod@0": lambda t: np.where(t < T, t, 0.0),
        f"force:{PAIR}": lambda t: np.full_like(t, np.nan),
        "momentum:rod": np.zeros_like,
        "energy:rod": np.ones_like,
    }
    return SyntheticHistory(
        3 * T, signals, jumps={"displacement:rod@0": (T,)}, simulation=scene(model or ModalLike()), **(given | changes)
    )


def test_the_summary_holds_every_key_of_the_contract() -> None:
    summary = summarise("toy", history(ModalLike(100, 40)), ("itself", history()))
    expected = {"schema_version", "case", "status", "method", "events", "contacts", "final", "energy", "probes"}
    assert expected | {"errors", "cost", "warnings"} <= set(summary)
    assert (summary["schema_version"], summary["case"], summary["status"]) == (1, "toy", "completed")
    assert summary["method"] == {
        "models": {"rod": {"kind": "modal_like", "elements": 100, "modes": 40}},
        "laws": [{"kind": "soft_spring", "stiffness": {"relative": 0.8}, "damping": 0.1}],
        "integrator": {"kind": "slow_newmark", "beta": 0.25},
        "dt": 0.01,
    }
    assert summary["events"] == [
        {"time": 0.0, "contact": PAIR, "kind": "close"},
        {"time": 3.0, "contact": PAIR, "kind": "open"},
        {"time": 3.2, "contact": PAIR, "kind": "impulse", "impulse": 0.25},
    ]
    assert summary["contacts"] == [{"contact": PAIR, "start": 0.0, "end": 3.0, "impulse": 3.6, "peak_force": 2.0}]
    assert summary["final"] == {
        "time": 6.0,
        "bodies": {
            "hammer": {"position": np.sin(6.0), "velocity": np.cos(6.0)},
            "rod": {"momentum": 0.0, "energy": 1.0},
        },
    }
    assert summary["energy"]["booked"] == {"contact": 0.1, "unresolved": 0.0}
    assert summary["energy"]["initial"] == 2.0
    assert summary["energy"]["final"] == pytest.approx(1.9)
    assert summary["energy"]["largest_gain"] == pytest.approx(0.05)  # 0.1 J of 2 J
    assert summary["energy"]["largest_loss"] == 0.0  # it never falls below its start
    assert summary["errors"]["reference"] == "itself"
    assert summary["errors"]["mass_displacement"] == 0.0
    assert summary["errors"]["force"] is None
    spent = {"setup_s": 0.5, "solve_s": 0.25, "checks_s": 0.0}
    assert summary["cost"] == spent | {"steps": 600, "rhs_evaluations": None, "unknowns": None, "factorisations": None}
    assert summary["warnings"] == [{"code": "near_grazing", "text": "a touch was nearly missed"}]


def test_gains_are_shares_of_the_energy_in_play() -> None:
    # At rest at the start: weight puts in 500 J, of which 5 J get lost without a formula, 1 %.
    grid, work = np.linspace(0.0, 1.0, 3), np.array([0.0, 500.0, 300.0])
    book = EnergyBook(grid, {"bar": work - np.array([0.0, 0.0, 5.0])}, np.zeros(3), {}, work)
    assert (book.largest_gain, book.largest_loss) == (0.0, pytest.approx(0.01))
    assert EnergyBook(grid, {"bar": np.zeros(3)}, np.zeros(3), {}, np.zeros(3)).scale == 1.0


def test_a_run_without_an_exact_solution_has_no_errors() -> None:
    text = summary_text(summarise("toy", history()))
    assert "errors    not measured" in text


def test_times_of_rigid_bodies_are_in_seconds() -> None:
    """Step and opening were dashes, as there is no round trip, and no error was marked as the smallest."""
    ball, wall = il.Mass(1.0, velocity=1.0), il.Wall()
    contact = il.Contact("ball", "wall", {"kind": "hertz", "stiffness": 1e9})
    solve = {"duration": 5e-3, "integrator": {"kind": "midpoint"}, "step": {"dt": 1e-5}}
    case = il.Case(bodies={"ball": ball, "wall": wall}, contacts=[contact], solve=solve)
    document = il.compare(case.with_("methods", {"fine": {"solve.step": {"dt": 2e-6}}})).document
    text = table(document)
    assert "dt [s]" in text
    assert "first opening [s]" in text
    assert [row["dt"] for row in table_rows(document)] == [1e-5, 2e-6]
    assert [cell.best for row in page_rows(document) for cell in row["cells"][:1]] == [False, True]


def test_a_comparison_without_errors_gives_the_reason() -> None:
    """Its columns of errors held dashes, without a word."""
    summary = summarise("toy", history())
    text = table(comparison("toy", None, [("base", summary), ("other", summary)]))
    assert text.count("errors not measured: no exact solution") == 1


def test_the_summary_is_strict_json() -> None:
    spans = (ContactSpan(PAIR, np.float64(0.0), None, np.float64(np.inf), float("nan")),)
    text = json.dumps(summarise("toy", history(contacts=spans)), allow_nan=False)
    assert json.loads(text)["contacts"] == [
        {"contact": PAIR, "start": 0.0, "end": None, "impulse": None, "peak_force": None}
    ]
    assert json.loads(text)["errors"] is None


def test_an_impulse_law_reports_its_kicks() -> None:
    spans = (ContactSpan(PAIR, 0.0, 2.0, 3.6, None, 0.1, 37),)
    entry = summarise("toy", history(contacts=spans))["contacts"][0]
    assert (entry["first_impulse"], entry["kicks"], entry["peak_force"]) == (0.1, 37, None)


def test_an_integrator_that_was_not_used_is_not_reported() -> None:
    exact = history(WaveTrain(), dt=None)
    exact.integrator_used = False
    used = summarise("toy", exact)["method"]
    assert (used["integrator"], used["dt"]) == (None, None)
    assert used["models"]["rod"]["kind"] == "wave_train"


def test_kinds_are_class_names_in_snake_case() -> None:
    assert [kind_of(part) for part in (SoftSpring(), ModalLike(), SlowNewmark())] == [
        "soft_spring",
        "modal_like",
        "slow_newmark",
    ]
    assert describe(SoftSpring(2.0)) == {"kind": "soft_spring", "stiffness": 2.0, "damping": 0.0}


def test_extremes_see_the_value_just_before_a_jump() -> None:
    jump = 1.2345678
    ramp = SyntheticHistory(3 * T, {"a": lambda t: np.where(t < jump, t, 0.0)}, jumps={"a": (jump,)})
    assert extremes(ramp, "a") == (0.0, pytest.approx(jump, rel=1e-12))


def test_plain_values_are_of_python_and_finite() -> None:
    mixed = {"a": np.float64(1.5), "b": np.int64(2), "c": (np.bool_(True), float("-inf")), "d": np.array([1.0, np.nan])}
    assert plain(mixed) == {"a": 1.5, "b": 2, "c": [True, None], "d": [1.0, None]}
    assert type(plain(np.int64(2))) is int
    assert type(plain(np.float64(2.0))) is float


def two_rows() -> dict[str, Any]:
    good = summarise("toy", history(ModalLike(100, 40)), ("itself", history()))
    failed = {"schema_version": 1, "case": "toy", "status": "refused", "error": {"text": "no such pair"}}
    return comparison("toy", "itself", [("base", good), ("hopeless", failed)])


def test_a_failed_row_names_the_key() -> None:
    """'this key is missing' alone does not say which."""
    error = {"path": "contacts.0.law", "text": "this key is missing"}
    failed = {"schema_version": 1, "case": "toy", "status": "refused", "error": error}
    (row,) = table_rows(comparison("toy", None, [("mesh", failed)]))
    assert row["failure"] == "refused: contacts.0.law: this key is missing"


def test_a_comparison_keeps_its_failed_rows() -> None:
    both = two_rows()
    assert list(both) == ["schema_version", "case", "reference", "collisions", "rows"]
    assert [row["name"] for row in both["rows"]] == ["base", "hopeless"]
    base, hopeless = table_rows(both)
    assert hopeless["failure"] == "refused: no such pair"
    assert base["model"] == "modal_like 100/40"
    assert base["first opening"] == pytest.approx(1.5)
    assert base["dt"] == pytest.approx(0.005)
    assert base["gain"] == pytest.approx(5.0)
    assert (base["contacts"], base["steps"], base["solve"], base["warnings"]) == (1, 600, 250.0, "near_grazing")


def test_the_text_table_is_aligned_and_whole() -> None:
    lines = table(two_rows()).splitlines()
    assert lines[0] == "toy: 2 methods against the exact solution"
    head, rule, base, hopeless = lines[2:]
    assert head.index("model") == rule.index("-", head.index("model")) == base.index("modal_like 100/40")
    assert base.split()[0] == "base"
    assert "1.5000" in base
    assert hopeless.split(maxsplit=1) == ["hopeless", "refused: no such pair"]


def test_the_text_table_leaves_columns_out_on_a_narrow_terminal() -> None:
    lines = table(two_rows(), width=60).splitlines()
    assert max(map(len, lines[2:5])) <= 60
    assert "impulse [%]" in lines[2]
    assert lines[-1].startswith("left out because the terminal is narrow: loss, first opening, dt, ")


def test_warnings_stand_below_where_the_terminal_is_too_narrow_for_their_column() -> None:
    both = two_rows()
    calm = {**both["rows"][0]["summary"], "warnings": []}
    both["rows"].append({"name": "calm", "summary": calm})
    lines = table(both, width=60).splitlines()
    assert "warnings" not in lines[2]
    assert "base: near_grazing" in lines
    assert "warnings" not in lines[-1]
    assert not any(line.startswith("calm:") for line in lines)


def test_a_warning_of_all_methods_is_shown_once() -> None:
    both = two_rows()
    both["rows"].append({**both["rows"][0], "name": "again"})
    lines = table(both).splitlines()
    assert lines[-1] == "all methods: near_grazing"
    assert sum("near_grazing" in line for line in lines) == 1


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (0.0, "0"),
        (12, "12"),
        (0.123456, "0.123"),
        (1.23456, "1.23"),
        (12.3456, "12.3"),
        (123.456, "123"),
        (2.5e-7, "2.5e-7"),
        (123456.0, "1.2e+5"),
        (-0.5, "-0.500"),
    ],
)
def test_cells_are_short(value: Any, text: str) -> None:
    assert cell(value) == text


def test_a_stepped_delay_line_is_not_described_as_solved_from_event_to_event() -> None:
    case = il.load_case("axial_impact").method("continuous")
    hertz = case.with_settings(
        {"contacts.0.law": {"kind": "hertz", "stiffness": 1e10}, "solve.step": {"points_per_period": 20}}
    )
    stepped = summarise("stepped", il.run(hertz))
    assert stepped["method"]["stepping"] == "stepped delay line"
    assert "; stepped delay line; dt " in summary_text(stepped)
    facts = dict(method_facts(stepped))
    assert facts["integrator"] == "none: stepped delay line"
    assert facts["model of rod"] == "continuous, stepped delay line"
    exact = summarise("exact", il.run(case))
    assert "stepping" not in exact["method"]
    assert dict(method_facts(exact))["integrator"] == "none: solved from event to event"
    assert dict(method_facts(exact))["model of rod"] == "continuous"


def test_models_are_given_in_words_and_alike_ones_together():
    models = {f"bar_{number}": {"kind": "finite_element", "elements": 20, "mass": "lumped"} for number in range(5)}
    summary = il.run(il.load_case("axial_impact")).summary()
    assert "\n  method    rod: modal, 40 modes of 100 elements, consistent mass; wave_id" in summary_text(summary)
    summary["method"]["models"] |= models
    assert "mass; 5 bodies: finite_element, 20 elements, lumped mass; wave_id" in summary_text(summary)


@pytest.mark.parametrize(
    ("law", "words"),
    [
        ({"kind": "bilinear", "stiffness": 1e9, "restitution": 0.8}, "bilinear (stiffness 1 GN/m, restitution 0.8)"),
        ({"kind": "hertz", "stiffness": 2e8}, "hertz (stiffness 200 MN/m^1.5, exponent 1.5)"),
        ({"kind": "penalty", "stiffness": 1e4, "damping": 5.0}, "penalty (stiffness 10 kN/m, damping 5 N·s/m)"),
        (
            {
                "kind": "specimen",
                "length": "8 mm",
                "area": 5e-5,
                "young": "70 GPa",
                "flow": {"yield_stress": "300 MPa"},
            },
            "specimen (length 8 mm, area 5e-05 m², young 70 GPa, "
            "flow linear_flow (yield_stress 300 MPa, hardening 0 Pa), tension false)",
        ),
        (
            {"kind": "smith", "capacity": "2 kN", "quake": "2.5 mm", "damping": 0.2, "tension": False},
            "smith (capacity 2 kN, quake 2.5 mm, damping 0.2 s/m, rule smith, tension false, set 0 m)",
        ),
    ],
)
def test_options_of_laws_have_their_units(law: dict[str, Any], words: str) -> None:
    case = falling(0.03, law, 0.0, gap=0.0).with_("solve.integrator", {"kind": "midpoint"})
    history = il.run(case)
    shown = dict(method_facts(summarise("falling", history), units_of(history)))
    assert shown["contact law"].replace("\N{NO-BREAK SPACE}", " ") == words


def falling(duration: float, law: dict[str, Any], gravity: float, gap: float | None = None) -> il.Case:
    """Return a mass of 1 kg at 1 m/s before a wall, in steps of 0.03 s."""
    apart = gap if gap is not None else 0.1 if gravity == 0.0 else 1.0
    return il.Case(
        bodies={"ball": il.Mass(1.0, velocity=1.0), "wall": il.Wall()},
        contacts=[il.Contact("ball", "wall", law, **({"gap": apart} if apart else {}))],
        solve={"duration": duration, "step": {"dt": 0.03}},
        gravity=gravity,
    )


def test_energy_and_work_end_with_the_run_and_not_with_its_last_step() -> None:
    """The last step ends at 0.12 s; a run of 0.1 s gave 2.42 J, beside a speed of 2 m/s of 1 kg."""
    case = falling(0.1, {"kind": "penalty", "stiffness": 1e4}, gravity=10.0)
    summary = api.summarised(case, il.run(case))[0]
    assert summary["final"]["bodies"]["ball"]["velocity"] == pytest.approx(2.0, rel=1e-12)
    assert summary["energy"]["final"] == pytest.approx(2.0, abs=0.02)  # linear in the step
    assert summary["energy"]["work"] == pytest.approx(summary["energy"]["final"] - 0.5, rel=1e-12)


def test_faces_that_meet_after_the_end_of_the_run_have_not_touched() -> None:
    """They meet in the part of the last step beyond 0.1 s; the check of overlaps divided by a travel of zero."""
    case = falling(0.1, {"kind": "impulse_momentum", "restitution": 0.5}, gravity=0.0)
    history = il.run(case)
    assert not history.events
    assert "overlap" not in {warned.code for warned in history.warnings}


@pytest.mark.parametrize("method", ["newmark", "central_difference", "adaptive"])
def test_the_loss_of_each_contact_is_given_beside_their_sum(method: str, tmp_path: Path) -> None:
    """Two dampers take the same motion from both sides, one of them twice as strong; a third does not act."""
    law = {"kind": "penalty", "stiffness": 1e6, "damping": 100.0}
    bodies = {
        "left": il.Wall(), "one": il.Mass(1.0, velocity=-1.0), "two": il.Mass(2.0, velocity=1.0), "right": il.Wall(),
        "far": il.Mass(1.0), "end": il.Wall(),
    }  # fmt: skip
    twice = {"kind": "penalty", "stiffness": 2e6, "damping": 200.0}
    contacts = [
        il.Contact("left", "one", law),
        il.Contact("two", "right", twice),
        il.Contact("far", "end", law, gap=1.0),
    ]
    steps = {"integrator": {"kind": method}} | ({} if method == "adaptive" else {"step": {"dt": 1e-6}})
    solve = {"duration": 0.60037e-3} | steps
    history = il.run(il.Case(bodies=bodies, contacts=contacts, solve=solve))
    energy = summary.energy(history)
    lost = energy["booked_by_contact"]
    assert sorted(lost) == ["left|one", "two|right"]
    assert lost["two|right"] == pytest.approx(2.0 * lost["left|one"], rel=1e-9)
    assert sum(lost.values()) == pytest.approx(energy["booked"]["contact"], rel=1e-12)
    # m u'' + d u' + k u = 0 from u = 0: the power d u'^2 up to the end, by the exact motion
    rate, omega = 50.0, math.sqrt(1e6 - 50.0**2)
    t = np.linspace(0.0, 0.60037e-3, 20001)
    speed = np.exp(-rate * t) * (np.cos(omega * t) - rate / omega * np.sin(omega * t))
    assert lost["left|one"] == pytest.approx(np.trapezoid(100.0 * speed**2, t), rel=2e-3)
    if method == "newmark":  # the file keeps them
        history.to_netcdf(tmp_path / "run.nc")
        assert summary.energy(il.open_netcdf(tmp_path / "run.nc"))["booked_by_contact"] == pytest.approx(lost)


def test_the_exact_solver_gives_the_loss_of_each_contact() -> None:
    """The damper at the far end acts from the arrival of the wave on, after the run of a part."""
    rod = il.Rod(length=0.3, area=1e-4, material={"young": 2e11, "density": 8000.0})
    law = {"kind": "penalty", "stiffness": 1e8, "damping": 1e3}
    contacts = [il.Contact("hammer", "rod.left", law), il.Contact("rod.right", "wall", law)]
    case = il.Case(
        bodies={"hammer": il.Mass(1.0, velocity=1.0), "rod": rod, "wall": il.Wall()},
        contacts=contacts,
        solve={"duration": 5e-5, "model": {"kind": "continuous"}},
    )
    assert list(summary.energy(il.run(case))["booked_by_contact"]) == ["hammer|rod.left"]
    energy = summary.energy(il.run(case.with_("solve.duration", 2e-4)))
    lost = energy["booked_by_contact"]
    assert list(lost) == ["hammer|rod.left", "rod.right|wall"]
    assert min(lost.values()) > 1e-3
    assert sum(lost.values()) == pytest.approx(energy["initial"] - energy["final"], rel=1e-9)
