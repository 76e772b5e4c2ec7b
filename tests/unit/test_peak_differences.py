"""Largest forces beside a jump: a tolerance does not bound them, and the run warns where they are far off."""

import math

import pytest

import impactlab as il

STEEL = {"young": 210e9, "density": 7850.0}
AREA, SPEED = 5.8e-4, 0.787


def struck(law: dict[str, float | str] | None, **solve: object) -> il.Case:
    return il.Case(
        bodies={
            "hammer": il.Mass(0.0445, velocity=SPEED),
            "rod": il.Rod(length=0.4141, area=AREA, material=STEEL, damping={"mass": 957.0}),
        },
        contacts=[{"between": ["hammer", "rod.left"], "gap": 2e-7, **({"law": law} if law else {})}],
        solve={"duration": 6e-4, **solve},
    )


def warned(history) -> list[str]:
    return [note.text for note in history.warnings if note.code == "peak_not_converged"]


def test_a_largest_force_at_the_front_of_a_hard_impact_is_warned_of():
    found = il.run(struck(None, tolerance=1e-2))
    assert found.choice.met
    first = math.sqrt(STEEL["young"] * STEEL["density"]) * AREA * SPEED  # N: impedance times speed, before any damping
    assert found.contacts[0].peak_force < 0.8 * first  # far beyond the tolerance of 1e-2
    assert [text for text in warned(found) if "hammer|rod.left" in text]


def test_a_smaller_tolerance_brings_it_closer():
    first = math.sqrt(STEEL["young"] * STEEL["density"]) * AREA * SPEED
    peaks = [il.run(struck(None, tolerance=error)).contacts[0].peak_force for error in (1e-2, 3e-4)]
    assert abs(peaks[1] - first) < 0.25 * abs(peaks[0] - first)


def test_a_smooth_largest_force_is_not_warned_of():
    hertz = {"kind": "hertz", "stiffness": 3e9}
    found, fine = (il.run(struck(hertz, tolerance=error)) for error in (1e-2, 1e-4))
    assert found.contacts[0].peak_force == pytest.approx(fine.contacts[0].peak_force, rel=1.01e-2)
    assert not warned(found)


def test_no_word_where_peak_forces_do_not_count():
    found = il.run(struck(None, tolerance=1e-2, tolerance_on=["displacements", "impulses"]))
    assert not warned(found)
