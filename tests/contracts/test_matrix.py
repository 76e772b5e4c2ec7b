"""Every law under every scheme on every model ends with finite numbers, or is refused with reason, place and remedy.

The cells are those of studies/matrix.py, which takes them from the registry: a new part joins by itself.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import pytest

from impactlab import simulate
from impactlab.errors import PairingError
from impactlab.scene.method import StepRule
from studies import matrix

TRIPS = 1.2  # of the wave: the touch, the loading twice over
LAW, SCHEME, MODEL = "penalty", "newmark", "modal 100/40"
BEAM, CRANK = "beam: modal 20/20", "slider-crank: modal 40/6"


SAMPLE = [
    *((MODEL, LAW, scheme) for scheme in matrix.schemes()),
    *((MODEL, law, SCHEME) for law in matrix.laws()),
    *((model, "addition_deletion", "midpoint, located") for model in matrix.models()),
    *((BEAM, "hertz", scheme) for scheme in matrix.schemes()),
    *((BEAM, law, SCHEME) for law in matrix.laws()),
    *((model, "hertz", SCHEME) for model in matrix.beam_models()),
    *((CRANK, "hertz", scheme) for scheme in matrix.schemes()),
    *((CRANK, law, "midpoint") for law in matrix.laws()),
]


def check(found: Any) -> None:
    """Assert that a cell completed, was refused with all that a user needs, or failed for a reason that is told."""
    if found.status == "completed":
        assert all(math.isfinite(value) for value in (found.mass, found.gain))
        assert found.face is None or math.isfinite(found.face)  # a link of a mechanism has its face among the masses
    elif found.status == "refused":
        assert found.text
        assert found.remedy
        assert found.path.startswith(("contacts.0.law", "solve.", "bodies.beam.rotation"))
    else:
        assert found.status == "failed", found.text
        assert found.text.startswith("energy grew by"), found.text
        assert found.remedy


@pytest.mark.parametrize(("model", "law", "scheme"), SAMPLE, ids=str)
def test_a_cell_completes_or_is_refused_with_reason_and_remedy(model: str, law: str, scheme: str) -> None:
    found = matrix.outcome(model, law, scheme, TRIPS, timed=False)
    check(found)
    # A multiplier kept from step to step is a hard contact, and on this beam none converges: it gains more than it had.
    hopeless = model == BEAM and law == "augmented_lagrangian"
    assert hopeless or found.status != "failed", found.text


def every_thirteenth() -> list[matrix.Cell]:
    """Return a thirteenth of the cells: each pair of model and law, of law and scheme, of model and scheme is met.

    `python -m studies matrix`, which writes docs/matrix.md, runs all of them.
    """
    axes = [list(each) for each in (matrix.models(), matrix.laws(), matrix.schemes())]
    return [
        cell
        for cell in matrix.cells()
        if sum(axis.index(part) for axis, part in zip(axes, cell, strict=True)) % 13 == 0
    ]


def test_a_thirteenth_of_the_cells_meets_every_pair() -> None:
    """Of cells that exist: a beam has no bases of rods, say."""
    for first, second in ((0, 1), (1, 2), (0, 2)):
        pairs = [{(cell[first], cell[second]) for cell in cells} for cells in (every_thirteenth(), matrix.cells())]
        assert pairs[0] == pairs[1]


def test_a_page_that_is_read_and_written_stays_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the cells of one reason can be run again, and all others stay."""
    few = {"models": ["one: 20"], "laws": ["hard", "soft, 2"], "schemes": ["newmark", "midpoint, located"]}
    for name, labels in few.items():
        monkeypatch.setattr(matrix, name, lambda labels=labels: dict.fromkeys(labels))
    monkeypatch.setattr(matrix, "alike", lambda text: text)
    outcomes = (
        matrix.Outcome("completed", 1e-3, None, True, 0.2, 1.5),
        matrix.Outcome("refused", text="no. It needs modes (a, b)", remedy="Use *modal*.", path="solve.model"),
        matrix.Outcome("failed", text="energy grew by 2"),
        matrix.Outcome("refused", text="another reason", remedy="Wait.", path="solve.step"),
    )
    page = matrix.page(dict(zip(matrix.cells(), outcomes, strict=True)))
    found, shown = matrix.read(page)
    assert matrix.page(found) == page
    assert shown["one: 20", "soft, 2", "midpoint, located"] == "r2"
    changed = matrix.page({**found, ("one: 20", "hard", "midpoint, located"): outcomes[0]})
    assert "no. It needs" not in changed
    assert "**r1** (1 cells, at `solve.step`): another reason. *Wait.*" in changed


@pytest.mark.slow
def test_no_cell_crashes_hangs_or_returns_a_number_that_is_not_finite() -> None:
    cells = every_thirteenth()
    found = matrix.run_all(cells, TRIPS, timed=False)
    assert set(found) == set(cells)
    for cell, each in found.items():
        try:
            check(each)
        except AssertionError as error:
            raise AssertionError(f"{cell}: {each}") from error
    counts = Counter(each.status for each in found.values())
    assert counts["completed"] > len(cells) // 2
    # Those are explicit, and the remedy they tell, a smaller step, is true.
    for cell in (cell for cell, each in found.items() if each.status == "failed"):
        if "no run may more than double it" in found[cell].text:
            # A hard position constraint under a scheme that is known to gain from it, or one without a declared bound.
            continue
        if cell[0].startswith((matrix.BEAM, matrix.TURNING)):
            # A multiplier kept from step to step is a hard contact, and on this beam none converges.
            assert cell[1] == "augmented_lagrangian", cell
            continue
        scene = matrix.scene_of(*cell, TRIPS)
        assert scene.method.step.courant == 0.5, cell
        simulate.run(*scene.but(step=StepRule(courant=0.3)))


# Remedies of refusals, tried: cell, words of its remedy, the cell that follows them.
REMEDIES = [
    (("finite_element 100", LAW, "exact_modal"), "Use model modal", (MODEL, LAW, "exact_modal")),
    (("finite_element 100", LAW, "exact_modal"), "newmark", ("finite_element 100", LAW, "newmark")),
    (
        ("finite_element 100", LAW, "central_difference"),
        "mass: lumped",
        ("finite_element 100, lumped", LAW, "central_difference"),
    ),
    ((MODEL, "wave_identification", "midpoint, located"), "penalty", (MODEL, "penalty", "midpoint, located")),
    (
        (MODEL, "paoli_schatzman", "exact_modal, located"),
        "addition_deletion",
        (MODEL, "addition_deletion", "exact_modal, located"),
    ),
    ((MODEL, "paoli_schatzman", "exact_modal, located"), "events: dated", (MODEL, "paoli_schatzman", "exact_modal")),
    ((MODEL, "addition_deletion", "adaptive"), "penalty", (MODEL, "penalty", "adaptive")),
    ((MODEL, "addition_deletion", "adaptive"), "exact_modal", (MODEL, "addition_deletion", "exact_modal")),
    (("continuous", "impulse_momentum", SCHEME), "wave_identification", ("continuous", "wave_identification", SCHEME)),
    (
        ("finite_element 100", "impedance_residual", SCHEME),
        "Use modal with basis eigenvectors and fewer modes",
        (MODEL, "impedance_residual", SCHEME),
    ),
    ((MODEL, "nitsche", SCHEME), "craig_bampton", ("modal 100/40, craig_bampton", "nitsche", SCHEME)),
    (
        ("finite_element 100, redistributed", "hertz", SCHEME),
        "Use addition_deletion",
        ("finite_element 100, redistributed", "addition_deletion", SCHEME),
    ),
    (
        ("modal 100/40, striker_attached", LAW, "hht_alpha"),
        "midpoint",
        ("modal 100/40, striker_attached", LAW, "midpoint"),
    ),
]


@pytest.mark.parametrize(("refused", "named", "instead"), REMEDIES, ids=lambda value: str(value))
def test_the_remedy_of_a_refusal_works(
    refused: tuple[str, str, str], named: str, instead: tuple[str, str, str]
) -> None:
    found = matrix.outcome(*refused, TRIPS, timed=False)
    assert found.status == "refused"
    assert named in found.remedy
    assert matrix.outcome(*instead, TRIPS, timed=False).status == "completed"


def test_a_refusal_comes_before_the_first_step() -> None:
    with pytest.raises(PairingError):
        simulate.prepare(*matrix.scene_of("finite_element 100", LAW, "exact_modal"))
