"""Numbers that are each in range and together beyond double precision: refused with body, ratio and limit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab import simulate
from impactlab.errors import CaseError
from impactlab.scene.precision import check_finite, in_precision
from impactlab.scene.ranges import RANGES
from tests.support import CASES

PENALTY = ("contacts.0.law", {"kind": "penalty", "stiffness": 1e9})
FREE = ("bodies.rod.ends.right", "free")
MODES = ("solve.model", {"kind": "modal", "elements": 50, "modes": 20})
HELD = ("solve.model", {"kind": "modal", "elements": 50, "modes": 20, "basis": "craig_bampton"})
MESH = ("solve.model", {"kind": "finite_element", "elements": 50})
STEEL = {"young": 2.1e11, "density": 7900}
APART = [
    {"length": 0.1, "area": 1e-4, "material": {"young": 1e-6, "density": 7900}},
    {"length": 0.1, "area": 1e-4, "material": STEEL},
]


@pytest.mark.parametrize(
    ("settings", "path", "text"),
    [
        (
            [PENALTY, MODES, ("solve.step", {"points_per_period": 1.5e-12})],
            "solve.step",
            "times 1/omega of the highest frequency of 'rod'. Allowed: up to 1e+06",
        ),
        ([PENALTY, FREE, MESH, ("solve.step", {"dt": 1e4})], "solve.step", "Allowed: up to 1e+06"),
        (
            [PENALTY, MODES, ("bodies.rod.ends.right", {"spring": 1e-23})],
            "bodies.rod.ends.right",
            "the static compliance of 'rod' cannot be computed in double precision; furthest from the body's own is "
            "the spring at the right end: 1.59e-32 times. Allowed: about 1e-12 to 1e+12",
        ),
        (
            [PENALTY, HELD, ("bodies.rod.ends.right", {"mass": 1e23})],
            "bodies.rod.ends.right",
            "the mass at the right end: 4.69e+22 times",
        ),
        (
            [PENALTY, ("bodies.other", {"kind": "rod", "segments": APART})],
            "bodies.other.segments",
            "the stiffnesses EA/L of its segments differ by a factor of 2.1e+17. Allowed: up to 1e+12",
        ),
        (
            [PENALTY, ("bodies.rod.material", {"young": 1e-9, "density": 1e20})],
            "bodies.rod.material",
            "the wave speed sqrt(E/rho) is 3.16228e-15 m/s. Allowed: 1e-06 to 1e+12 m/s",
        ),
    ],
)
def test_a_singular_matrix_is_refused(settings: list[tuple[str, Any]], path: str, text: str) -> None:
    case = il.load_case(CASES / "axial_impact.yaml")
    with pytest.raises(CaseError) as caught:
        simulate.prepare(*case.with_settings(settings).simulation())
    assert caught.value.path == path
    assert text in caught.value.text


def test_overflow_division_by_zero_and_memory_are_refused_and_other_errors_pass() -> None:
    for error in (OverflowError(), ZeroDivisionError(), MemoryError(), np.linalg.LinAlgError("singular")):
        with pytest.raises(CaseError, match="the step cannot be computed"), in_precision("the step", "solve.step"):
            raise error
    with pytest.raises(ValueError, match="a fault of ours"), in_precision("the step", "solve.step"):
        raise ValueError("a fault of ours")


def test_a_matrix_that_is_not_finite_is_refused() -> None:
    with pytest.raises(CaseError, match="the matrices of 'rod' cannot be computed in double precision"):
        check_finite("the matrices of 'rod'", "bodies.rod", None, np.zeros(3), np.array([1.0, np.nan]))


@pytest.mark.parametrize(("unit", "sizes"), sorted(RANGES.items()))
def test_no_product_of_allowed_numbers_overflows(unit: str, sizes: tuple[float, float]) -> None:
    least, most = sizes
    assert least**4 > 0.0, unit
    assert most**8 < np.inf, unit


@pytest.mark.parametrize("basis", ["eigenvectors", "craig_bampton"])
def test_a_pinned_beam_of_one_element_has_its_modes(basis: str) -> None:
    case = il.load_case(CASES / "sphere_on_beam.yaml")
    case = case.with_("solve.model", {"kind": "modal", "elements": 1, "modes": 2, "basis": basis})
    beam = simulate.prepare(*case.simulation()).built["beam"]
    assert beam.system.stiffness.shape[1] == 2
    assert np.all(np.isfinite(beam.system.stiffness))


@pytest.mark.parametrize(("unit", "sizes"), sorted(RANGES.items()))
def test_the_page_of_conventions_lists_the_ranges(unit: str, sizes: tuple[float, float]) -> None:
    page = (CASES.parent / "docs" / "conventions.md").read_text(encoding="utf-8")
    assert f"| {unit} | {sizes[0]:g} | {sizes[1]:g} |\n" in page


def test_a_rod_that_meets_a_beam_by_a_spring_has_no_exact_solution() -> None:
    from impactlab.exact.solve import serves

    case = il.load_case(CASES / "rod_on_beam.yaml")
    case = case.with_("contacts.0.law", {"kind": "penalty", "stiffness": 1e8})
    assert "meets a beam" in str(serves(*case.simulation()))
