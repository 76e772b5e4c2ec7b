"""Numbers in messages: a limit that is typed as it is printed is kept."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

import impactlab as il
from impactlab.printing import at_least, at_most


@given(st.floats(1e-12, 1e12), st.integers(2, 8))
def test_a_limit_is_printed_rounded_down(limit: float, digits: int) -> None:
    shown = float(at_most(limit, digits))
    assert limit * (1.0 - 10.0 ** (1 - digits)) <= shown <= limit
    assert at_most(shown, digits) == at_most(limit, digits)


@given(st.floats(1e-12, 1e12), st.integers(2, 8))
def test_a_least_value_is_printed_rounded_up(limit: float, digits: int) -> None:
    shown = float(at_least(limit, digits))
    assert limit <= shown <= limit * (1.0 + 10.0 ** (1 - digits))
    assert at_least(shown, digits) == at_least(limit, digits)


def test_the_rate_of_a_message_is_accepted_as_it_is_printed() -> None:
    """Records every 6.9 us are 144927.536 per second, to six digits 144928."""
    soft = il.load_case("axial_impact").with_("contacts.0.law", {"kind": "penalty", "stiffness": 1e8})
    case = soft.with_(
        "solve",
        {
            "duration": "0.2 ms",
            "model": {"kind": "finite_element", "elements": 10, "mass": "lumped"},
            "integrator": {"kind": "newmark"},
            "step": {"dt": "6.9 us"},
        },
    )
    probe = il.Probe("rod", 0.1, "strain", rate="1 MHz")
    with pytest.raises(il.CaseError, match=r"Allowed: up to (\S+) Hz") as refused:
        il.run(case.with_("probes", [probe]))
    allowed = re.search(r"Allowed: up to (\S+) Hz", refused.value.text)[1]  # type: ignore[index]
    assert float(allowed) == pytest.approx(1.0 / 6.9e-6, rel=1e-5)
    il.run(case.with_("probes", [il.Probe("rod", 0.1, "strain", rate=float(allowed))])).measured(0)


@pytest.mark.parametrize("elements", [30, 70, 90, 110])
def test_the_step_of_a_message_is_accepted_as_it_is_printed(elements: int) -> None:
    hard = il.load_case("axial_impact").with_("contacts.0.law", {"kind": "addition_deletion"})
    case = hard.with_(
        "solve",
        {
            "duration": {"round_trips": 1},
            "model": {"kind": "finite_element", "elements": elements, "mass": "lumped"},
            "integrator": {"kind": "central_difference"},
            "step": {"dt": 1e-4},
        },
    )
    with pytest.raises(il.CaseError, match="beyond the stability limit") as raised:
        il.run(case)
    step = float(raised.value.remedy.split("Give dt: ")[1].split()[0])
    assert il.run(case.with_("solve.step", {"dt": step})).dt <= step
