"""The report of a bench: what it tells is what the table holds, and nothing of the table is lost."""

from __future__ import annotations

import base64
import csv
import gzip
import itertools
import json
import os
import re
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import pytest

from impactlab.bench.report import pages
from impactlab.bench.report.automatic import automatic_sheet, choices
from impactlab.bench.report.findings import certainty_words, findings
from impactlab.bench.report.fronts import front_of
from impactlab.bench.report.live import bench_data
from impactlab.bench.report.method_styles import leaders, power, styles_of, within
from impactlab.bench.report.overview import SHADES
from impactlab.bench.report.precision import precision
from impactlab.bench.report.ranking import comparable, profile, ranking
from impactlab.bench.report.read import read_table
from impactlab.bench.report.scene_sheets import convergence_sheet, families_sheet, front_sheet, unfinished
from impactlab.bench.report.sheets import Heading, Sheet, escaped, latex, markdown, short
from impactlab.bench.report.special import pairs, special_grids, special_summary
from impactlab.bench.report.summary_sheets import excluded, ranking_sheet, winners
from impactlab.bench.report.views import BOTH, NORMS, SceneRows, error, gathered
from impactlab.bench.report.write import write_bench
from impactlab.bench.schema import FIELDS, Row
from impactlab.errors import CaseError
from impactlab.report.output import DRAFT, new_draft
from tests.support import invoke
from tests.unit.test_report import Links

ENDED = {
    "status": "completed",
    "suite": "standard",
    "variant": "base",
    "reference": "st_venant",
    "reference_uncertainty": 1e-13,
    "setup_s": 1e-3,
    "setup_spread_s": 1e-5,
    "solve_spread_s": 1e-5,
    "repeats": 5,
    "steps": 100,
    "unknowns": 10,
    "round_trips": 3.0,
    "energy_gain": 1e-4,
    "energy_loss": 1e-3,
    "force_oscillation": 0.1,
    "force_away_from_jumps": 0.05,
    "machine": "a machine",
    "code": "1.0+abc",
}


def made(case: str, method: str, level: int, solve_ms: float, both: float, **cells: Any) -> dict[str, Any]:
    """A row that ended: displacement and impulse with the same error."""
    told = {"case": case, "method": method, "level": level, "solve_s": 1e-3 * solve_ms}
    return ENDED | told | {"displacement": both, "impulse": both, "integrator": "newmark"} | cells


def lost(case: str, method: str, level: int, status: str, reason: str) -> dict[str, Any]:
    """A row without a result."""
    return {"case": case, "variant": "base", "method": method, "level": level, "status": status, "reason": reason}


# Three scenes: on a and b numbers are chosen by hand, c has no reference.
HAND = [
    made("a", "exact", 0, 0.5, 0.0, steps=None, integrator="", unknowns=None),
    made("a", "slow", 0, 4.0, 5e-3),
    made("a", "slow", 1, 8.0, 5e-4),
    made("a", "quick", 0, 1.0, 9e-3),
    made("a", "quick", 1, 2.0, 2e-3),
    lost("a", "shy", 0, "refused", "no mode 100 % & more"),
    made("b", "slow", 0, 3.0, 8e-3),
    made("b", "slow", 1, 6.0, 9e-4),
    made("b", "quick", 0, 1.0, 3e-2),
    lost("b", "quick", 1, "failed", "lost | at_sea"),
    lost("b", "shy", 0, "hung", "killed after 60 s"),
    made("c", "slow", 0, 1.0, 0.0, reference="none", displacement=None, impulse=None),
]


def written(folder: Path, rows: list[dict[str, Any]], name: str = "table.csv") -> Path:
    """Write rows as a table with all its columns."""
    file = folder / name
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, [*FIELDS, "exit_velocity"], lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: "" if value is None else value for key, value in row.items()} for row in rows)
    return file


def scenes_of(folder: Path, rows: list[dict[str, Any]]) -> tuple[SceneRows, ...]:
    return gathered(read_table(written(folder, rows)))


# Reading


def test_a_table_is_read_plain_and_compressed_with_types_and_empty_cells(tmp_path: Path) -> None:
    rows = read_table(written(tmp_path, [HAND[0] | {"exit_velocity": "0.7"}, HAND[5]]))
    assert (rows[0].solve_s, rows[0].steps, rows[0].level, rows[0].displacement) == (5e-4, None, "0", 0.0)
    assert rows[1].solve_s is None
    packed = tmp_path / "table.csv.gz"
    packed.write_bytes(gzip.compress((tmp_path / "table.csv").read_bytes()))
    assert read_table(packed) == rows


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a,b\n1,2\n", "has no column case, method, status"),
        ("", "is not the table of a bench"),
        ("case,method,status,displacement,impulse,solve_s,setup_s,steps,unknowns\n", "holds no row"),
        (
            "case,method,status,displacement,impulse,solve_s,setup_s,steps,unknowns\na,b,completed,x,,,,,\n",
            "'x' is not a",
        ),
        (
            "case,method,status,displacement,impulse,solve_s,setup_s,steps,unknowns\na,b,lost,,,,,,\n",
            "'lost' is not one",
        ),
        ("case,method,status,displacement,impulse,solve_s,setup_s,steps,unknowns\na,b\n", "line 2 has not one cell"),
    ],
)
def test_a_file_that_is_no_table_is_refused_with_words(tmp_path: Path, text: str, told: str) -> None:
    file = tmp_path / "other.csv"
    file.write_text(text)
    with pytest.raises(CaseError, match=re.escape(told)):
        read_table(file)


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match="cannot read"):
        read_table(tmp_path / "none.csv")
    (tmp_path / "image.csv").write_bytes(b"\xff\xfe\x00\xd8")
    with pytest.raises(CaseError, match="not text in UTF-8"):
        read_table(tmp_path / "image.csv")
    (tmp_path / "cut.csv.gz").write_bytes(gzip.compress(b"case" * 100)[:20])
    with pytest.raises(CaseError, match="cannot read"):
        read_table(tmp_path / "cut.csv.gz")


def test_a_setting_is_found_however_the_row_nests_it() -> None:
    for settings in (
        {"solve.step": {"courant": 0.9}},
        {"solve.step.courant": 0.9},
        {"solve": {"step": {"courant": 0.9}}},
    ):
        assert Row(settings=json.dumps(settings)).courant == 0.9
    assert Row(settings="{}").courant is None
    assert Row(settings="no json").courant is None


# Ranking


def test_the_ranking_of_a_small_table_is_that_by_hand(tmp_path: Path) -> None:
    scenes = scenes_of(tmp_path, HAND)
    loose = {each.method: each for each in ranking(scenes, BOTH, 1e-2)}
    # Scene a: exact 0.5 ms is best; quick 1 ms, slow 4 ms. Scene b: slow 3 ms is the only one; quick is 3 % off.
    assert loose["exact"].ratios == (1.0,)
    assert loose["quick"].ratios == (2.0,)
    assert loose["slow"].ratios == (8.0, 1.0)
    assert loose["slow"].ratios_stepped == (4.0, 1.0)  # in a the best with steps is quick
    assert [result.outcome for result in loose["shy"].results] == ["refused", "failed"]
    assert [result.outcome for result in loose["quick"].results] == ["met", "missed"]
    assert [result.outcome for result in loose["exact"].results] == ["met", "absent"]
    assert ranking(scenes, BOTH, 1e-2)[0].method == "slow"  # in both scenes
    sharp = {each.method: each for each in ranking(scenes, BOTH, 1e-3)}
    assert sharp["slow"].ratios == (16.0, 1.0)
    assert sharp["quick"].ratios == ()
    # With set-up, 1 ms each: 9 ms over 1.5 ms.
    assert ranking(scenes, BOTH, 1e-3, "total")[0].ratios == pytest.approx((6.0, 1.0))


def test_the_sheet_of_a_ranking_shows_the_same_numbers(tmp_path: Path) -> None:
    sheet = ranking_sheet(scenes_of(tmp_path, HAND), BOTH)
    rows = {row[0]: row[1:] for row in sheet.rows}
    assert rows["slow"][:8] == ("2", "4.5", "8", "2.5", "2", "8.5", "16", "1")
    assert rows["quick"][:4] == ("1", "2", "2", "1")
    assert rows["quick"][-2:] == ("0", "1")
    assert rows["shy"][-2:] == ("1", "1")  # refused on a, hung on b
    assert rows["shy"][:4] == ("0", "–", "–", "–")


def test_scenes_without_a_sure_reference_are_left_out_and_named(tmp_path: Path) -> None:
    rows = [*HAND, made("d", "slow", 0, 1.0, 1e-3, reference="converged", reference_uncertainty=2e-4)]
    scenes = scenes_of(tmp_path, rows)
    assert [scene.name for scene in comparable(scenes, BOTH, 1e-3).scenes] == ["a", "b", "d"]
    assert [scene.name for scene in comparable(scenes, BOTH, 1e-4).scenes] == ["a", "b"]
    [untold] = scenes_of(tmp_path, [made("e", "slow", 0, 1.0, 1e-3, reference="converged", reference_uncertainty=None)])
    assert comparable([untold], BOTH, 1e-2).scenes == ()
    told = excluded(scenes, BOTH)
    assert ("all tolerances", "c", "no reference to measure errors against") in told
    assert (power(1e-4), "d", "the uncertainty of the reference is 0.0002") in told
    words = " ".join(certainty_words(read_table(written(tmp_path, rows)), scenes))
    assert "not ranked: c." in words
    assert "1 refused" in words


def test_no_error_counts_as_smaller_than_its_reference_is_sure(tmp_path: Path) -> None:
    rows = [made("a", "m", 0, 1.0, 1e-9, reference_uncertainty=1e-6, force_away_from_jumps=1e-9)]
    [scene] = scenes_of(tmp_path, rows)
    assert error(scene.rows[0], BOTH, scene) == 1e-6
    assert error(scene.rows[0], NORMS[2], scene) == 1e-9  # the uncertainty is that of displacement and impulse


def test_a_scene_without_impulse_is_ranked_by_displacement(tmp_path: Path) -> None:
    [scene] = scenes_of(tmp_path, [made("a", "m", 0, 1.0, 1e-4, impulse=None)])
    assert error(scene.rows[0], BOTH, scene) == 1e-4
    # Where others have one, a method without any has not shown that it meets both.
    [scene] = scenes_of(tmp_path, [made("a", "m", 0, 1.0, 1e-4, impulse=None), made("a", "n", 0, 1.0, 1e-4)])
    assert error(scene.rows[0], BOTH, scene) is None


def test_methods_of_a_case_are_shown_and_never_ranked(tmp_path: Path) -> None:
    [scene] = scenes_of(tmp_path, [*HAND[:5], made("a", "own.base", 0, 0.01, 1e-6)])
    assert "own.base" not in [each.method for each in ranking([scene], BOTH, 1e-2)]
    assert ranking([scene], BOTH, 1e-2)[0].ratios[0] == 1.0
    assert "own.base" in [row[0] for row in families_sheet(scene).rows]
    assert not [p for p in front_of(scene.stepped, NORMS[0], scene) if p.row.method == "own.base"]


def test_a_profile_never_reaches_one_for_a_method_that_fails_somewhere(tmp_path: Path) -> None:
    loose = {each.method: each for each in ranking(scenes_of(tmp_path, HAND), BOTH, 1e-2)}
    assert profile(loose["slow"]) == [(1.0, 0.5), (8.0, 1.0)]
    assert profile(loose["quick"]) == [(2.0, 0.5)]
    assert profile(loose["shy"]) == []


def test_without_times_a_tolerance_is_met_all_the_same(tmp_path: Path) -> None:
    rows = [row | {"solve_s": None} for row in HAND if row["status"] == "completed"]
    loose = {each.method: each for each in ranking(scenes_of(tmp_path, rows), BOTH, 1e-2)}
    assert [result.outcome for result in loose["slow"].results] == ["met", "met"]
    assert loose["slow"].ratios == ()


def test_winners_name_methods_off_the_special_grid(tmp_path: Path) -> None:
    grid = {"settings": json.dumps({"solve.step": {"courant": 1.0}})}
    rows = [*HAND[:5], made("a", "tuned", 0, 0.8, 1e-5, **grid)]
    [row] = winners(scenes_of(tmp_path, rows)).rows
    assert row[1] == "0.500"
    assert row[2].replace("\N{NO-BREAK SPACE}", " ") == "tuned† 0.800; quick 1.00"
    assert row[4].replace("\N{NO-BREAK SPACE}", " ") == "tuned† 0.800; no other"


def test_findings_leave_special_grids_out(tmp_path: Path) -> None:
    grid = {"settings": json.dumps({"solve.step.courant": 1.0})}
    words = " ".join(findings(scenes_of(tmp_path, [*HAND, made("a", "tuned", 0, 0.1, 1e-5, **grid)])))
    assert "tuned" not in words
    assert "Most reliable at 10⁻³: slow, within it in 2 of 2 scenes" in words


@pytest.mark.parametrize("count", [1, 2], ids=["one scene", "two scenes"])
def test_without_times_no_method_is_fastest(tmp_path: Path, count: int) -> None:
    rows = [row | {"solve_s": None} for row in HAND if row["case"] in ("a", "b")[:count]]
    scenes = scenes_of(tmp_path, rows)
    words = " ".join(findings(scenes))
    assert "fast" not in words
    assert f"A solution without steps exists{' in 1 of 2 scenes' if count == 2 else ''}. The other findings" in words
    assert "10⁻³: slow" in words
    assert {cell for row in winners(scenes).rows for cell in row[1:]} <= {"-", "–", "—", "none"}


# Fronts


def test_the_front_leaves_out_methods_without_steps(tmp_path: Path) -> None:
    scene = scenes_of(tmp_path, HAND)[0]
    found = [(p.row.method, p.row.level) for p in front_of(scene.stepped, NORMS[0], scene)]
    assert found == [("quick", "0"), ("quick", "1"), ("slow", "1")]
    assert leaders(scene, NORMS[0]) == ["quick", "slow"]
    lines = front_sheet(scene).rows
    assert [line[0] for line in lines] == ["exact", "quick", "quick", "slow"]
    assert {line[-1] for line in lines[1:]} == {"time, with and without set-up"}


def test_the_rates_of_convergence_are_those_of_the_errors_over_the_steps(tmp_path: Path) -> None:
    rows = [made("a", "m", n, 1.0, 0.3 * 4.0**-n, steps=100 * 2**n, impulse=1e-3 * 2.0**n) for n in range(3)]
    [scene] = scenes_of(tmp_path, [*rows, made("a", "one", 0, 1.0, 1e-3, steps=5)])
    sheet = convergence_sheet(scene)
    assert [(line[0], line[3], line[5], line[7]) for line in sheet.rows] == [
        ("m", "100", "–", "–"),
        ("m", "200", "2.00", "\N{MINUS SIGN}1.00"),
        ("m", "400", "2.00", "\N{MINUS SIGN}1.00"),
    ]


def test_methods_that_differ_by_rounding_do_not_beat_each_other(tmp_path: Path) -> None:
    rows = [made("a", "one", 0, 1.0, 1e-3), made("a", "same", 0, 1.1, 1e-3 * (1.0 - 1e-9))]
    [scene] = scenes_of(tmp_path, rows)
    assert [p.row.method for p in front_of(scene.rows, NORMS[0], scene)] == ["one"]


def test_event_times_of_a_run_that_missed_events_are_no_error(tmp_path: Path) -> None:
    rows = [
        made("a", "m", 0, 1.0, 1e-3, event_times=1e-9, events_missed=2),
        made("a", "m", 1, 1.0, 1e-3, event_times=1e-3),
    ]
    [scene] = scenes_of(tmp_path, rows)
    norm = next(norm for norm in NORMS if norm.name == "event_times")
    assert [error(row, norm, scene) for row in scene.rows] == [None, 1e-3]
    assert "1e-9" not in families_sheet(scene).rows[0]


# Special grids


def test_special_grids_stand_beside_their_siblings_and_rods_that_are_not_uniform(tmp_path: Path) -> None:
    def row(case: str, courant: float, both: float) -> dict[str, Any]:
        name = "explicit" if courant == 1.0 else "explicit_0.9"
        settings = json.dumps({"solve.step": {"courant": courant}})
        return made(case, name, 0, 1.0, both, settings=settings, elements=100, model="finite_element", law="penalty")

    rows = [
        row("a", 1.0, 1e-6),
        row("a", 0.9, 1e-3),
        row("two_material_rod", 1.0, 0.011),
        row("two_material_rod", 0.9, 0.02),
    ]
    scenes = scenes_of(tmp_path, rows)
    [(method, [pair])] = pairs(scenes[0])
    assert method == "explicit"
    assert pair.ordinary is not None
    assert pair.ordinary.method == "explicit_0.9"
    sheet = special_grids(scenes)
    assert sheet.rows == (("explicit", "a", "100", "1e-6", "1.00", "0.001", "1.00", "1000", "0.011", "0.02"),)
    assert sheet.headings[-1].group == "two_material_rod"
    [row_of_all] = special_summary(scenes).rows
    assert row_of_all == ("explicit", "100", "1", "1e-6", "0.001", "1000", "1000 a", "0.011", "0.02")


def test_a_special_grid_without_a_sibling_shows_the_hole(tmp_path: Path) -> None:
    settings = json.dumps({"solve.step": {"courant": 1.0}})
    [row] = special_summary(scenes_of(tmp_path, [made("a", "alone", 0, 1.0, 1e-6, settings=settings)])).rows
    assert row == ("alone", "–", "1", "1e-6", "–", "–", "–")


# The automatic choice


def test_misses_of_the_automatic_choice_come_first_and_are_marked(tmp_path: Path) -> None:
    def asked(level: int, tolerance: float, **cells: Any) -> dict[str, Any]:
        told = {"tolerance_asked": tolerance, "expected_error": tolerance / 2.0, "choosing_s": 4e-3}
        return made("a", "automatic", level, 2.0, 4e-3) | told | cells

    rows = [*HAND[:5], asked(0, 1e-2), asked(1, 1e-3)]
    rows.append(lost("a", "automatic", 2, "refused", "cannot be met") | {"tolerance_asked": 1e-4})
    scenes = scenes_of(tmp_path, rows)
    kept, missed, declined = choices(scenes)
    assert (kept.verdict, missed.verdict, declined.verdict) == ("kept", "missed", "declined")
    assert kept.over_best == pytest.approx(4.0)  # 2 ms over the exact answer's 0.5 ms
    assert kept.choosing == pytest.approx(2.0)
    sheet = automatic_sheet(scenes)
    assert [row[2] for row in sheet.rows] == ["missed", "declined", "kept"]
    assert sheet.wrong == {0}
    assert sheet.rows[1][5] == "cannot be met"
    assert "automatic" not in [each.method for each in ranking(scenes, BOTH, 1e-2)]
    assert "It missed in a at 0.001." in findings(scenes)


# Tables


def test_latex_escapes_special_characters(tmp_path: Path) -> None:
    assert (
        escaped("a_b & 5 % of {x} ^~ \\")
        == r"a\_b \& 5 \% of \{x\} \textasciicircum{}\textasciitilde{} \textbackslash{}"
    )
    assert escaped("1.2e-4") == r"$1.2\cdot 10^{-4}$"
    assert escaped("10⁻³ †") == r"10$^{-3}$ \textdagger{}"
    sheet = Sheet("x_y", "50 % & more", "n_o", (Heading("a_b", numeric=False), Heading("t", "ms")), (("[x]", "1"),))
    text = latex(sheet)
    assert r"\toprule" in text
    assert r"{}[x] & 1 \\" in text  # else \\ would take [x] for its option
    assert r"\label{tab:x-y}" in text


def test_every_table_is_valid_in_both_languages(tmp_path: Path) -> None:
    scenes = scenes_of(tmp_path, HAND)
    sheets = [winners(scenes), ranking_sheet(scenes, BOTH), special_grids(scenes), automatic_sheet(scenes)]
    for sheet in [*sheets, families_sheet(scenes[0]), front_sheet(scenes[0]), convergence_sheet(scenes[0])]:
        lines = markdown(sheet).split("\n\n")[0].splitlines()
        assert len({len(re.findall(r"(?<!\\)\|", line)) for line in lines}) == 1
        text = latex(sheet)
        assert text.isascii()
        assert re.sub(r"\\[{}]", "", text).count("{") == re.sub(r"\\[{}]", "", text).count("}")
        body = text.split(r"\midrule")[1].split(r"\bottomrule")[0].strip().splitlines()
        for line in body:
            assert len(re.findall(r"(?<!\\)&", line)) == len(sheet.headings) - 1
            assert not re.search(r"(?<!\\)[%#_]", line)


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "–"), (0.0, "0"), (1.0e-12, "1e-12"), (1.24e-4, "1.2e-4"), (0.0123, "0.012"), (352.0, "350")],
)
def test_numbers_are_short(value: float | None, text: str) -> None:
    assert short(value) == text


def test_names_beside_lines_stay_apart_and_in_reach() -> None:
    placed = within([1.0] * 9, 0.1)
    assert placed == sorted(placed)
    assert max(placed) <= 1.02 + 1e-12
    assert min(b - a for a, b in itertools.pairwise(placed)) >= 0.1 - 1e-12


# The page


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report of the small table, made once: pages are only looked at."""
    folder = tmp_path_factory.mktemp("report")
    write_bench(folder, written(folder, HAND), command="impactlab bench a.yaml --out DIR")
    return folder


def test_all_figures_are_drawn_where_formats_are_given(tmp_path: Path) -> None:
    write_bench(tmp_path, written(tmp_path, HAND[:6]), formats=("pdf",))
    names = {path.name for path in (tmp_path / "figures").iterdir()}
    assert {"precision_a_displacement.svg", "precision_a_impulse.pdf", "energy_a.pdf", "oscillation_a.pdf"} <= names
    assert {name.partition(".")[2] for name in names - {"precision_a_displacement.svg"}} == {"pdf"}


def test_the_live_diagram_holds_every_completed_run_to_three_digits(tmp_path: Path) -> None:
    scenes = scenes_of(tmp_path, HAND)
    data = json.loads(zlib.decompress(base64.b64decode(bench_data(scenes, styles_of(scenes)))))
    methods = [method["name"] for method in data["methods"]]
    assert [title for title, _ in data["upwards"]][: data["errors"]] == [BOTH.title, *(norm.title for norm in NORMS)]
    for scene, shown in zip(scenes, data["scenes"], strict=True):
        runs = [row for row in scene.all_rows if row.completed]
        assert [(methods[m], level) for m, level in zip(shown["method"], shown["level"], strict=True)] == [
            (row.method, row.level) for row in runs
        ]
        for row, both, time in zip(runs, shown["up"][0], shown["right"][0], strict=True):
            assert both == (None if (known := error(row, BOTH, scene)) is None else pytest.approx(known, rel=5e-3))
            assert time == (None if row.solve_s is None else pytest.approx(row.solve_s, rel=5e-3))


def test_a_table_without_times_opens_on_steps(tmp_path: Path) -> None:
    """It opened on the time to solve, where no run has a number."""
    keys = ("solve_s", "setup_s", "repeats")
    write_bench(tmp_path, written(tmp_path, [{**row, **dict.fromkeys(keys)} for row in HAND]))
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "Error against steps, run by run" in text
    assert "fastest methods" not in Links(text).text.lower()
    assert "Front of" not in Links(text).text
    assert "data.sideways.findIndex((_, k) => known(k))" in text  # the axis that the page opens on


def test_every_row_without_a_result_is_on_the_page(report: Path, tmp_path: Path) -> None:
    page = Links((report / "index.html").read_text(encoding="utf-8"))
    for row in HAND:
        if row["status"] != "completed":
            assert f"{row['case']} {row['method']} {row['level']} {row['status']} {row['reason']}" in page.text
    assert [len(unfinished(scene)) for scene in scenes_of(tmp_path, HAND)] == [1, 2, 0]


def test_a_report_is_whole_and_needs_no_network(report: Path) -> None:
    text = (report / "index.html").read_text(encoding="utf-8")
    found = Links(text)
    assert len(found.ids) == len(set(found.ids))
    assert {"a", "b", "c"} <= set(found.ids)
    for address in set(found.addresses) - {"data:,"}:  # an empty icon
        file, _, anchor = address.partition("#")
        assert (report / file).exists(), address
        assert not anchor or anchor in found.ids
    assert "impactlab bench a.yaml --out DIR" in found.text
    figures = {path.name for path in (report / "figures").iterdir()}  # of three scenes no map and no profiles
    assert figures == {
        f"precision_{name}.svg" for name in ("a_displacement", "b_displacement", "c_force_away_from_jumps")
    }
    assert {"winners.md", "winners.tex", "a.md", "a.tex", "ranking_both_solve.tex"} <= {
        path.name for path in (report / "tables").iterdir()
    }
    assert not list(report.glob(".report*"))


def test_several_scenes_have_a_map_and_profiles_whose_ramp_the_page_sets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pages, "MIN_SCENES", 3)
    write_bench(tmp_path, written(tmp_path, HAND))
    assert {"map_0.001", "profiles_solve"} <= {path.stem for path in (tmp_path / "figures").iterdir()}
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    style, body = text.split("</style>")
    assert "var(--shade0)" in style
    assert SHADES[0][1] not in body
    assert style.count("--shade0:") == 3  # light, dark, printed


def test_a_report_replaces_the_last_one_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    table = written(tmp_path, [row for row in HAND if row["case"] == "b"][2:])
    other = written(tmp_path, [lost("b", "shy", 0, "hung", "no"), made("z", "one", 0, 1.0, 1e-3)], "other.csv")
    (tmp_path / "notes.txt").write_text("mine")
    write_bench(tmp_path, other)
    assert (tmp_path / "tables" / "z.md").exists()
    write_bench(tmp_path, table)
    first = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert not (tmp_path / "tables" / "z.md").exists()
    assert (tmp_path / "notes.txt").read_text() == "mine"
    write_bench(tmp_path, table)
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == first
    with pytest.raises(CaseError):
        write_bench(tmp_path, tmp_path / "notes.txt")
    assert (tmp_path / "index.html").read_bytes() == first[tmp_path / "index.html"]


def test_remains_of_a_killed_report_are_deleted(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, text=True)
    alive = new_draft(tmp_path, "report")
    dead = tmp_path / alive.name.replace(str(os.getpid()), done.stdout.strip())
    elsewhere = tmp_path / f".report{DRAFT}elsewhere-{done.stdout.strip()}.x"  # a process of another machine
    dead.mkdir()
    elsewhere.mkdir()
    write_bench(tmp_path, written(tmp_path, HAND[:1]))
    assert not dead.exists()
    assert alive.exists()
    assert elsewhere.exists()


def test_a_report_never_replaces_the_work_of_others(tmp_path: Path) -> None:
    table = written(tmp_path, HAND[:1])
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "mine.yaml").write_text("work")
    with pytest.raises(CaseError, match=re.escape("would replace 'figures/mine.yaml'")):
        write_bench(tmp_path, table)
    assert (tmp_path / "figures" / "mine.yaml").read_text() == "work"
    with pytest.raises(CaseError, match="there is no folder"):
        write_bench(tmp_path / "none", table)


@pytest.mark.slow
@pytest.mark.parametrize(
    "rows",
    [
        [lost("a", "m", 0, "refused", "no"), lost("a", "n", 0, "crashed", "gone")],
        [made("a", "m", 0, 1.0, 1e-3) | dict.fromkeys(("steps", "unknowns", "solve_s", "energy_gain", "round_trips"))],
        [made("a", "m", 0, 1.0, 1e-3) | dict.fromkeys(("displacement", "impulse", "force_oscillation", "setup_s"))],
        [made("a", "m", i, 1.0, 10.0**-i) | dict.fromkeys(("solve_s", "setup_s", "repeats")) for i in range(3)],
        [made("a", "m", 0, 1.0, 50.0)],
        [made("a", "exact", 0, 1.0, 0.0, steps=0, integrator="")],
        [made("a", "automatic", 0, 1.0, 1e-3, tolerance_asked=None)],
    ],
    ids=["nothing ended", "no costs", "no errors", "no times", "all far off", "only exact", "only automatic"],
)
def test_tables_with_holes_are_reported_all_the_same(tmp_path: Path, rows: list[dict[str, Any]]) -> None:
    write_bench(tmp_path, written(tmp_path, rows))
    assert "against error" in (tmp_path / "index.html").read_text(encoding="utf-8")


def test_a_figure_names_its_leaders_and_only_them(tmp_path: Path) -> None:
    rows = [*HAND, *(made("a", f"crowd_{i}", 0, 20.0 + i, 0.5) for i in range(25))]
    scenes = scenes_of(tmp_path, rows)
    figure = precision(scenes[0], NORMS[0], styles_of(scenes))
    words = {text.get_text() for axis in figure.axes for text in axis.texts}
    assert {"quick", "slow", "exact"} <= words
    assert not any(word.startswith("crowd") for word in words)


LEVELS = [("few", 10, 9e-3), ("few", 20, 2e-3), ("many", 40, 5e-3), ("many", 80, 5e-4)]  # method, steps, error


def test_a_figure_of_a_table_without_times_shows_errors_over_steps_with_the_names(tmp_path: Path) -> None:
    untimed = dict.fromkeys(("solve_s", "setup_s", "repeats"))
    rows = [made("a", name, i, 1.0, both, steps=steps) | untimed for i, (name, steps, both) in enumerate(LEVELS)]
    scenes = scenes_of(tmp_path, rows)
    upper, lower = precision(scenes[0], NORMS[0], styles_of(scenes)).axes
    assert (upper.get_xlabel(), lower.get_xlabel()) == ("steps", "unknowns")
    assert {"few", "many"} <= {text.get_text() for text in upper.texts}


def test_the_command_draws_a_report_from_a_table_alone(tmp_path: Path) -> None:
    table = written(tmp_path, HAND[:1])
    out = tmp_path / "new" / "report"
    done = invoke("bench", "--from", str(table), "--out", str(out), "--json")
    assert done.exit_code == 0
    assert json.loads(done.stdout)["report"] == str(out / "index.html")
    assert (out / "index.html").exists()
    for name in ("nothing.csv", "."):  # what is not there, and what is no file
        asked = ["bench", "--from", str(tmp_path / name), "--out", str(tmp_path / "a" / "b")]
        none = invoke(*asked)
        assert none.exit_code == 2
        assert str(tmp_path / name) in none.stderr
        assert not (tmp_path / "a").exists()
    wrong = invoke("bench", "--from", str(out / "index.html"), "--out", str(out))
    assert wrong.exit_code == 2
    assert "is not the table of a bench" in wrong.stderr
