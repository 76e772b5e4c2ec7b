"""The scene of the 1999 paper: its numbers, its methods, other mass ratios, and its mirror image."""

from __future__ import annotations

import math

import numpy as np
import pytest

import impactlab as il
from tests.cases.support import case_of, exact, rows, times
from tests.reference.st_venant_mp import events


def test_axial_impact() -> None:
    """PHYSICS 1, alpha = 1 (independently computed there to 15 digits)."""
    history = exact("axial_impact")
    period = 2 * 0.3 / (2.1e11 / 7900.0) ** 0.5
    times = [event.time / period for event in history.events]
    # The case gives m = 2.133 kg and rho A L = 2.133 kg to rounding, so alpha is 1 to 1e-16.
    assert times == pytest.approx([0.0, 1.53383382080915, 2.12462323494217, 2.16284275559957], abs=1e-10)
    velocities = [float(history.evaluate(t * period, "velocity:hammer")) for t in (1.8, 2.9)]
    assert velocities == pytest.approx([-0.687618939800652, -0.698875581996163], abs=1e-10)
    assert history.contacts[0].peak_force == pytest.approx(78276.57, rel=1e-6)
    warned = {w.code for w in il.run(case_of("axial_impact").method("continuous")).warnings}
    assert warned >= {"near_grazing", "integrator_unused"}


@pytest.mark.parametrize("law", ["nitsche", "velocity_complementarity", "addition_deletion", "wave_identification"])
def test_an_exact_run_warns_where_its_law_stands_for_the_hard_contact(law: str) -> None:
    history = il.run(case_of("axial_impact").method("continuous").with_("contacts.0.law", {"kind": law}))
    assert history.contacts[0].peak_force == pytest.approx(78276.57, rel=1e-6)
    approximates = law in ("nitsche", "velocity_complementarity")
    assert [w.text for w in history.warnings if w.code == "law_unused"] == [
        f"hammer|rod.left: the exact solver solves the hard contact itself, and does not use law '{law}'"
    ] * approximates


@pytest.mark.parametrize(
    ("method", "mass", "face", "impulse"),
    [
        # About twice what was seen; the paper's own targets stand in tests/reference.
        ("base", 0.015, 0.015, 0.01),
        ("finite_element", 0.0008, 0.004, 0.0007),
        ("penalty", 0.01, 0.04, 0.007),
        ("impulse_momentum", 0.02, 0.045, 0.01),
    ],
)
def test_axial_impact_methods(method: str, mass: float, face: float, impulse: float) -> None:
    errors = rows("axial_impact")[method]["errors"]
    assert errors["mass_displacement"] < mass
    assert errors["face_displacement"] < face
    assert errors["impulse"] < impulse


def test_axial_impact_kicks() -> None:
    """PHYSICS 6: e = 1, 40 analytic modes, exact_modal, ten points per period: total 1.706 M v0 in 103 kicks."""
    summary = rows("axial_impact")["impulse_momentum"]
    [entry] = summary["contacts"]
    assert entry["kicks"] == 103
    assert entry["impulse"] / 2.133 == pytest.approx(1.706, abs=5e-4)
    # First kick (1 + e) M v0/(1 + 2 N/alpha), to rounding.
    assert entry["first_impulse"] / 2.133 == pytest.approx(2.0 / 81.0, rel=1e-12)
    assert entry["peak_force"] is None
    assert summary["errors"]["force"] is None
    assert {"chatter"} <= {w["code"] for w in summary["warnings"]}


def test_several_masses() -> None:
    """Each mass sees half a rod, clamped in the middle: the paper's scene, twice."""
    history = exact("several_masses")
    period = 2 * 0.3 / (2.1e11 / 7900.0) ** 0.5
    for contact in ("left|rod.left", "rod.right|right"):
        seen = [t / period for t in times(history, contact)]
        assert seen == pytest.approx([0.0, 1.53383382080915, 2.12462323494217, 2.16284275559957], abs=1e-10)
    assert history.evaluate([1.8 * period], "velocity:right") == pytest.approx(0.687618939800652, abs=1e-10)


RATIOS = {
    "alpha_1_10": 0.1,
    "alpha_1_4": 0.25,
    "alpha_1_2": 0.5,
    "": 1.0,
    "alpha_3_2": 1.5,
    "alpha_3": 3.0,
    "alpha_10": 10.0,
}


@pytest.mark.parametrize("variant", RATIOS)
def test_mass_ratios(variant: str) -> None:
    """Polynomials times an exponential in 40 digits, and PHYSICS 1 in closed form where there is one."""
    label, alpha = "mass_ratios" + (f"/{variant}" if variant else ""), RATIOS[variant]
    history, case = exact(label), case_of(label)
    trip = case.scene().round_trip
    found = events(str(alpha), history.duration / trip)
    # A root is as exact as the gap or force is steep there: the flattest here turns 1e-14 into less than 1e-10.
    assert [e.time / trip for e in history.events] == pytest.approx([t for t, _, _ in found], abs=1e-9)
    assert [e.kind for e in history.events] == [kind for _, kind, _ in found]
    assert float(history.evaluate(history.duration, "velocity:hammer")) == pytest.approx(found[-1][2], abs=1e-10)
    if alpha >= 0.578592475741907:
        last = (1.0 + 0.5 * math.exp(-2.0 * alpha)) / (2.0 * alpha)
        assert found[1][0] == pytest.approx(1.0 + last, rel=1e-12)
        assert found[1][2] == pytest.approx(-2.0 * math.exp(-2.0 * alpha * last), rel=1e-12)
    if alpha >= 0.5:
        assert history.contacts[0].peak_force == pytest.approx(
            36657.74133794934 * (2.0 + math.exp(-2.0 * alpha)), rel=1e-12
        )


@pytest.mark.parametrize(("label", "alpha"), [("grazing_pair", "1.02"), ("grazing_pair/touches", "1")])
def test_grazing_pair(label: str, alpha: str) -> None:
    """The second contact is there, or not; both warn. The least gap from the closed form of the first two intervals."""
    history, trip = exact(label), case_of(label).scene().round_trip
    found = events(alpha, 3.0)
    assert len(found) == (4 if alpha == "1" else 2)
    assert [e.time / trip for e in history.events] == pytest.approx([t for t, _, _ in found], abs=1e-9)
    assert "near_grazing" in {w.code for w in history.warnings}
    if alpha == "1.02":
        # Units T, v0. In flight the face moves with -2 q, q = p one trip before; p = s - q, s the stress of PHYSICS 1.
        lam = 2.04
        late, opened = np.linspace(0.0, 1.0, 200001), found[1][0] - 1.0
        carried = np.exp(-lam * late)  # p on the first interval
        sent = np.where(  # p on the second: s - q while in contact, -q in flight
            late <= opened, carried * (1.0 + math.exp(-lam) - 2.0 * lam * late), -carried
        )
        step = late[1]
        face = np.where(late <= opened, 0.0, -2.0 * carried) - np.where(late <= opened, 0.0, found[1][2])
        first = np.sum(face) * step  # the gap at 2 T
        gap = first + np.cumsum(-2.0 * sent - found[1][2]) * step
        assert float(gap.min() * trip) == pytest.approx(5.92e-7, abs=2e-9)
        t = trip * np.linspace(2.0, 2.3, 3001)
        assert float(history.evaluate(t, "gap:hammer|rod.left").min()) == pytest.approx(5.92e-7, abs=1e-9)
