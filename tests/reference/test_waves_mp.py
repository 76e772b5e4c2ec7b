"""The high-precision reference of derivatives: against the exact solver, and the numbers that it gives."""

from __future__ import annotations

import pytest
from mpmath import mp, mpf

from impactlab.exact.solve import solve
from tests.reference.exact_scenes import same_as
from tests.reference.waves_mp import NEVER, Struck, derivative, log_derivative, quantities

PAPER = Struck()
SPRUNG = Struck(stiffness=6, damping="0.2")
WALL = Struck(mass=1, wall="0.35", duration=4)
STEPPED = Struck(stiffness=20, gap="0.05", duration=2)
SCENES = {
    "paper": PAPER,
    "sprung": SPRUNG,
    "wall": WALL,
    "stepped": STEPPED,
    "free": Struck(
        mass="1.1", gap="0.2", length="0.9", area="1.3", modulus="0.7", density="2.1", wall=NEVER, duration=5
    ),
    "overdamped": Struck(mass=2, stiffness=9, damping="2.5", velocity="1.4", duration=7),
    "closes_overlapped": Struck(mass="0.58", stiffness="4.31", damping="3.94", wall="0.12", duration=5),
    "many_contacts": Struck(mass="3.3", velocity="1.7", gap="0.1", modulus="1.9", wall="0.2", duration=4),
}


@pytest.mark.parametrize("name", SCENES)
def test_the_exact_solver_agrees(name):
    scene = SCENES[name]
    expected = quantities(scene)
    history = solve(*same_as(scene))
    found = {"final_velocity": float(history.evaluate(history.duration, "velocity:hammer"))}
    for contact, prefix in (("hammer|rod.left", ""), ("rod.right|wall", "wall.")):
        spans = [span for span in history.contacts if span.contact == contact]
        for n, span in enumerate(spans):
            found |= {f"{prefix}closing.{n}": span.start, f"{prefix}opening.{n}": span.end}
            found |= {f"{prefix}impulse.{n}": span.impulse, f"{prefix}peak_force.{n}": span.peak_force}
    found = {key: value for key, value in found.items() if value is not None}
    several = {key for key in expected if key[-1].isdigit() and "nearest" not in key}
    assert several | {"final_velocity"} == set(found)
    assert found == pytest.approx({key: float(expected[key]) for key in found}, abs=1e-12)


@pytest.mark.parametrize(
    ("scene", "quantity", "parameter", "expected"),
    [
        (PAPER, "first_opening", "mass", "0.392155560966"),
        (PAPER, "final_velocity", "mass", "1.328847400921"),
        (PAPER, "impulse.1", "mass", "91.769350836"),
        (PAPER, "peak_force", "area", "0.873242123334"),
        (PAPER, "peak_force", "modulus", "0.500000000000"),
        (SPRUNG, "first_opening", "stiffness", "-0.175288167254"),
        (SPRUNG, "peak_force", "damping", "-0.081722438379"),
        (WALL, "final_velocity", "wall", "0.039958681784"),
        (WALL, "wall.closing.0", "wall", "0.306368895638"),
        (STEPPED, "final_velocity", "mass", "-0.2114"),
        (STEPPED, "first_opening", "mass", "0.3315"),
        (STEPPED, "impulse", "mass", "0.9073"),
        (STEPPED, "peak_force", "mass", "0.3828"),
    ],
)
def test_logarithmic_derivatives(scene, quantity, parameter, expected):
    unit = 10.0 ** -len(expected.partition(".")[2])
    assert log_derivative(quantity, parameter, scene) == pytest.approx(mpf(expected), abs=unit)


def test_the_velocity_of_a_mass_in_contact_is_known_in_closed_form():
    # before the first echo v = v0 exp(-Z t/M), and the impulse is M (v0 - v)
    scene = Struck(duration="0.75", mass="0.7")
    with mp.workdps(50):
        u = mpf("0.75") / mpf("0.7")
        assert abs(log_derivative("final_velocity", "mass", scene) - u) < mpf(10) ** -28
        assert abs(derivative("impulse", "mass", scene) - (1 - mp.exp(-u) * (1 + u))) < mpf(10) ** -28


def test_the_second_contact_of_the_paper_ends_at_an_edge_with_a_kink():
    with mp.workdps(50):

        def exit_slope(alpha, side):  # by alpha = 1/(2 M)
            mass = 1 / (2 * alpha)
            return -derivative("final_velocity", "mass", Struck(mass=mass), side) * mass / alpha

        edge = mp.findroot(
            lambda alpha: quantities(Struck(mass=1 / (2 * alpha), most=1))["nearest.0"],
            (mpf("1.0107"), mpf("1.0108")),
            solver="anderson",
        )
        assert edge == pytest.approx(mpf("1.010701206637"), abs=1e-12)
        above, below = edge + mpf(10) ** -20, edge - mpf(10) ** -8
        assert "closing.1" not in quantities(Struck(mass=1 / (2 * above)))
        assert "closing.1" in quantities(Struck(mass=1 / (2 * below)))
        assert exit_slope(mpf(1), 0) == pytest.approx(0.9287, abs=5e-5)
        assert exit_slope(below, 0) == pytest.approx(1.0210, abs=1e-3)
        assert exit_slope(above, -1) == pytest.approx(-0.0912, abs=5e-5)
