"""Every file in cases/ and every variant in it: says why it exists, has a reference, keeps its numbers, runs."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from impactlab.api import physics_of
from impactlab.cite import entries, source_key
from impactlab.history import AbstractHistory
from impactlab.refine.references.reference_record import Reference
from impactlab.scene.method import laws_of
from impactlab.scene.problem import Contact
from studies import cases as study
from studies.pages import DOCS, same_to_printed_digits
from tests.cases.known_numbers import KNOWN
from tests.cases.same_bits import bits, bits_of, rewritten, shuffled
from tests.cases.support import CASES, NAMES, case_of, compared, is_measured, labels, mechanical, rows

LABELS = labels()
DRAWN = ("axial_impact", "drill_string", "step_loaded_rod", "damped_rod")


def answer(label: str) -> AbstractHistory:
    """Return the history that the case as written is measured against; of a mechanism its method `fine`."""
    found = compared(label)
    return found.histories["fine"] if mechanical(label) else found.references["base"]


def of_links(history: AbstractHistory) -> Iterator[tuple[Contact, float]]:
    """Give the links of a run with their impulses, which are no periods of contact."""
    for contact, law in zip(history.scene.contacts, laws_of(history.scene, history.method), strict=True):
        if law.two_sided:
            yield contact, history.impulse_of(contact.name)


def test_no_case_is_forgotten() -> None:
    assert set(KNOWN) == set(LABELS)
    read = [(name, variant) for name in NAMES for variant in case_of(name).variant_names]
    assert list(LABELS) == [name if variant == "base" else f"{name}/{variant}" for name, variant in read]
    assert len(NAMES) >= 16


@pytest.mark.parametrize("name", NAMES)
def test_a_case_states_its_purpose_and_its_source(name: str) -> None:
    text = (CASES / f"{name}.yaml").read_text(encoding="utf-8")
    head = text[: text.index("schema_version")]
    assert "# Why it exists:" in head
    assert re.search(r"^# What is (exact|known)|the exact solution is", head, re.MULTILINE)
    case = case_of(name)
    assert case.title
    assert source_key(case.source) in entries(), case.source
    assert case.scene().probes or mechanical(name)


@pytest.mark.parametrize("label", LABELS)
def test_the_numbers_in_the_file_are_those_of_the_reference(label: str) -> None:
    """To half a unit of the last digit printed, and they stand in the file's own words."""
    text = (CASES / f"{label.partition('/')[0]}.yaml").read_text(encoding="utf-8")
    head = text[: text.index("schema_version")]
    history, trip = answer(label), case_of(label).scene().round_trip
    assert KNOWN[label]
    for known in KNOWN[label]:
        assert re.search(rf"(?<![0-9.]){re.escape(known.text)}(?![0-9])", head), known.text
        unit = trip if known.unit == "T" else float(known.unit)
        seen = known.reading(history) / unit
        digits = len(known.text.partition(".")[2])
        within = 1e-9 if "/" in known.text else 0.5 * 10.0**-digits * (1.0 + 1e-6)
        assert seen == pytest.approx(float(Fraction(known.text)), abs=max(within, 1e-9)), known.text


@pytest.mark.parametrize("label", LABELS)
def test_all_methods_complete_with_errors_against_the_reference(label: str) -> None:
    summaries, case = rows(label), case_of(label)
    assert set(summaries) == set(case.method_names)
    assert len(summaries) >= 3
    for method, summary in summaries.items():
        assert summary["status"] == "completed", (method, summary)
        if mechanical(label):
            errors = summary["errors"]
            assert (errors is not None) == is_measured(label, *physics_of(case.method(method))), method
            if errors is not None:
                assert errors["reference"] == "converged"
                assert errors["impulse"] < 1e-3, method
            assert summary["energy"]["largest_gain"] < 1e-4, method
            continue
        assert summary["errors"]["reference"] in ("st_venant", "kelvin_voigt", "branches", "converged")
        assert summary["errors"]["face_displacement"] is not None
        # Shares of the reference energy; what has no bound is warned of.
        told = "constraint_energy" in {warned["code"] for warned in summary["warnings"]}
        assert summary["energy"]["largest_gain"] < 0.06 or told, method
    if not mechanical(label) and summaries["base"]["errors"]["reference"] != "converged":
        exact = summaries.get("continuous", summaries["base"])
        assert exact["errors"]["face_displacement"] == 0.0


@pytest.mark.parametrize("label", LABELS)
def test_the_reference_keeps_its_energy_and_momentum(label: str) -> None:
    """A free body gains what contacts, weight and end forces gave it; energy stays, of an exact answer to 1e-11."""
    history, scene = answer(label), case_of(label).scene()
    converged = mechanical(label) or rows(label)["base"]["errors"]["reference"] == "converged"
    within = 1e-5 if converged else 1e-11  # a converged answer is told to 1e-6, its means and sums to a few of these
    assert np.all(np.isfinite(history.energy.balance))
    assert max(history.energy.largest_gain, history.energy.largest_loss) < within
    for name, body in scene.bodies.items():
        if body.is_held or body.softening:  # the centrifugal force changes the momentum
            continue
        changed = float(np.diff(history.evaluate([0.0, history.duration], f"momentum:{name}"))[0])
        signs = {c.name: float(c.right.body == name) - float(c.left.body == name) for c in scene.contacts}
        given = sum(signs[each.contact] * each.impulse for each in history.contacts)
        given += sum(signs[contact.name] * impulse for contact, impulse in of_links(history) if signs[contact.name])
        mass = body.moving_mass
        given += (mass * scene.gravity + body.end_force) * history.duration
        whole = np.array(history.duration)
        given += sum(float(load.sampled(history.duration).impulse(whole)) for _, load in body.loads)
        size = sum(abs(each.impulse) for each in history.contacts) + abs(given) + abs(mass * body.velocity)
        assert changed == pytest.approx(given, abs=10.0 * within * size), name


def line_of(label: str) -> study.Line:
    """Return a case with its answer, as the study that writes docs/cases.md has it."""
    case = case_of(label)
    reference = Reference("`fine`", answer(label)) if mechanical(label) else compared(label).rows[0].reference
    assert reference is not None
    return study.Line(case, *case.simulation(), reference)


@pytest.mark.parametrize("label", LABELS)
def test_the_line_of_the_page_is_that_of_the_reference(label: str) -> None:
    """What `python -m studies cases` would write, each number to two units of its last printed digit."""
    page = (DOCS / "cases.md").read_text(encoding="utf-8")
    head, *kept = page[page.index("<!-- table: cases -->") : page.index("\n<!-- end of table -->")].splitlines()[1:]
    assert head == f"{len(NAMES)} cases, {len(LABELS)} scenes."
    assert len(kept) == len(LABELS) + 3  # an empty line, and two of the head of the table
    old, new = (
        study.STUDY.comparable(text) for text in (kept[3 + LABELS.index(label)], f"| {study.row(line_of(label))} |")
    )
    assert same_to_printed_digits(old, new), (
        f"docs/cases.md:\n- {old}\n+ {new}\nWrite it again: python -m studies cases"
    )


def test_the_sheet_of_the_page_is_drawn() -> None:
    """A panel of one line, one of several, one of loaded ends, and one whose force has no bound at first."""
    groups = {name: [line_of(label) for label in LABELS if label.partition("/")[0] == name] for name in DRAWN}
    assert len(study.sheet(groups).axes) == study.COLUMNS


@pytest.mark.parametrize("name", NAMES[::-1])
def test_a_run_gives_the_same_bits_whatever_ran_before_and_in_whatever_order_keys_stand(
    name: str, tmp_path: Path
) -> None:
    """Each of two runs of all cases comes before the other once; the second time from JSON with its keys shuffled.

    One method of the case or of one of its variants runs again, drawn by the name of the case; of the case that exists
    for its methods a half of them.
    """
    draw = random.Random(name)
    variant = draw.choice(case_of(name).variant_names)
    read = rewritten(tmp_path, lambda data: shuffled(data, draw))
    histories = compared(name if variant == "base" else f"{name}/{variant}").histories
    for method in draw.sample(sorted(histories), len(histories) // 2 if name == "all_methods" else 1):
        first = bits_of(histories[method])
        again = bits(read((CASES / f"{name}.yaml", variant, method)))
        assert set(again) == set(first)
        assert [channel for channel in first if again[channel] != first[channel]] == [], method
