"""Mechanisms against textbook equations, closed forms and impacts found by independent programs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

import impactlab as il
from tests.reference.chains import ALUMINIUM, Chain, document, flat

BARS = {"one": {"kind": "link", "length": 0.5, "mass": 0.7}, "two": {"kind": "link", "length": 0.8, "mass": 0.4}}
TURNED = [{"body": "one", "angle": 0.3, "rate": 1.0}, {"body": "two", "angle": -0.4, "rate": 2.0, "end_mass": 0.3}]


def double_pendulum(duration: float) -> np.ndarray:
    """Return the angles of two bars under gravity after a time, from the textbook's equations."""
    (l1, m1), (l2, m2), end, g = (0.5, 0.7), (0.8, 0.4), 0.3, 9.81
    coupling, first = (m2 / 2.0 + end) * l1 * l2, m1 / 2.0 + m2 + end

    def rates(_t: float, y: np.ndarray) -> np.ndarray:
        a, b, va, vb = y
        mixed = coupling * math.cos(a - b)
        mass = np.array([[m1 * l1**2 / 3.0 + (m2 + end) * l1**2, mixed], [mixed, m2 * l2**2 / 3.0 + end * l2**2]])
        swing = coupling * math.sin(a - b)
        force = np.array(
            [-swing * vb**2 - first * g * l1 * math.cos(a), swing * va**2 - (m2 / 2.0 + end) * g * l2 * math.cos(b)]
        )
        return np.concatenate((y[2:], np.linalg.solve(mass, force)))

    return solve_ivp(rates, (0.0, duration), [0.3, -0.4, 1.0, 2.0], method="DOP853", rtol=1e-12, atol=1e-12).y[:2, -1]


def test_two_rigid_links_swing_as_in_the_textbook_at_second_order():
    """In the second angle errors of third order, of the predicted middles, still show at these steps."""
    exact, errors = double_pendulum(1.0), []
    for dt in (5e-4, 2.5e-4):
        history = il.run(document(BARS, TURNED, 1.0, dt, gravity=[0.0, -9.81]))
        errors.append(np.abs([float(history.evaluate(1.0, f"angle:{name}")) for name in BARS] - exact))
    assert errors[1].max() < 5e-7
    assert errors[0][0] / errors[1][0] == pytest.approx(4.0, rel=0.05)
    assert errors[0][1] / errors[1][1] > 4.0


def test_a_pendulum_has_the_period_of_the_elliptic_integral():
    swing = 1.2  # rad, from the lowest position
    bar = {"bar": {"kind": "link", "length": 0.6, "mass": 1.0}}
    period = 4.0 * math.sqrt(2.0 * 0.6 / (3.0 * 9.81)) * ellipk(math.sin(swing / 2.0) ** 2)
    links = [{"body": "bar", "angle": swing - math.pi / 2.0}]
    history = il.run(document(bar, links, float(period), 2e-4, gravity=[0.0, -9.81]))
    assert float(history.evaluate(history.duration, "angle:bar")) == pytest.approx(swing - math.pi / 2.0, abs=1e-6)
    assert float(history.evaluate(history.duration / 2.0, "angle:bar")) == pytest.approx(-swing - math.pi / 2, abs=1e-6)


def test_a_slider_stands_where_crank_and_rod_put_it():
    bodies = {"crank": BARS["one"] | {"length": 0.1}, "rod": BARS["two"] | {"length": 0.3}, "stop": {"kind": "wall"}}
    links = [{"body": "crank", "angle": -1.9, "drive": {"rate": 30.0}}, {"body": "rod", "end_mass": 0.5}]
    contacts = [
        {"between": ["rod.right", "stop"], "along": "x", "gap": 1.0, "law": {"kind": "hertz", "stiffness": 1e9}}
    ]
    case = document(bodies, links, 0.1, 1e-4, end={"slide": 0.02}, contacts=contacts)
    history = il.run(case)
    t = np.linspace(0.0, 0.1, 41)
    crank = -1.9 + 30.0 * t
    place = 0.1 * np.cos(crank) + np.sqrt(0.3**2 - (0.02 - 0.1 * np.sin(crank)) ** 2)
    assert history.evaluate(t, "position:rod.right") == pytest.approx(place, abs=1e-6)


def arm(modes: int, dt: float, duration: float = 18e-3) -> il.Case:
    bodies = {"arm": flat(1.0, 0.02, 0.01, ALUMINIUM), "stop": {"kind": "wall"}}
    links = [{"body": "arm", "torque": 0.5, "rate": 0.1, "end_mass": 0.1}]
    contacts = [{"between": ["arm.right", "stop"], "along": "y", "law": {"kind": "hertz", "stiffness": 3e9}}]
    return document(bodies, links, duration, dt, contacts=contacts, modes=modes)


def test_an_arm_on_a_stop_has_three_sub_impacts():
    found = il.run(arm(26, 1e-6)).contacts
    assert len(found) == 3
    for span, (start, end, peak, impulse), within in zip(
        found,
        [
            (0.0, 0.3562e-3, 118.51, 0.022734),
            (13.369e-3, 13.781e-3, 74.11, 0.016062),
            (16.119e-3, 16.584e-3, 50.0, 0.01220),
        ],
        (1e-4, 5e-4, 3e-3),
        strict=True,
    ):
        assert span.impulse == pytest.approx(impulse, rel=within)
        assert span.peak_force == pytest.approx(peak, rel=within)
        assert (span.start, span.end) == pytest.approx((start, end), abs=2e-6)


def test_a_rigid_arm_strikes_as_a_mass_on_a_hertz_spring():
    """The closed form of Hertz impact: effective mass 0.28 kg at the tip, 0.1 m/s."""
    bodies = {"bar": {"kind": "link", "length": 1.0, "mass": 0.54}, "stop": {"kind": "wall"}}
    contacts = [{"between": ["bar.right", "stop"], "along": "y", "law": {"kind": "hertz", "stiffness": 3e9}}]
    links = [{"body": "bar", "rate": 0.1, "end_mass": 0.1}]
    (span,) = il.run(document(bodies, links, 1e-3, 5e-7, contacts=contacts)).contacts
    depth = (1.25 * 0.28 * 0.1**2 / 3e9) ** 0.4
    assert span.peak_force == pytest.approx(3e9 * depth**1.5, rel=1e-5)
    assert span.peak_force == pytest.approx(207.63, rel=1e-4)
    assert span.end == pytest.approx(2.9432 * depth / 0.1, rel=1e-4)
    assert span.impulse == pytest.approx(0.056, rel=1e-5)


def test_a_two_link_arm_strikes_twice():
    bodies = {
        "upper": {"kind": "link", "length": 0.5, "mass": 0.5},
        "fore": flat(0.8, 0.02, 0.01, ALUMINIUM),
        "stop": {"kind": "wall"},
    }
    links = [
        {"body": "upper", "angle": math.pi / 3.0, "rate": 1.0},
        {"body": "fore", "rate": 1.0, "end_mass": 0.1, "axial_modes": 6},
    ]
    contacts = [{"between": ["fore.right", "stop"], "along": "y", "law": {"kind": "hertz", "stiffness": 1e9}}]
    first, second = il.run(document(bodies, links, 11e-3, 1e-6, contacts=contacts)).contacts
    assert first.impulse == pytest.approx(0.238245, rel=1e-4)
    assert first.peak_force == pytest.approx(1282.3, rel=1e-4)
    assert first.end == pytest.approx(0.3450e-3, rel=1e-4)
    assert second.impulse == pytest.approx(0.18549, rel=1e-3)
    assert second.peak_force == pytest.approx(964.5, rel=1e-3)
    assert (second.start, second.end) == pytest.approx((9.66361e-3, 10.01774e-3), abs=1e-7)  # by adaptive steps


def slider_crank(dt: float) -> il.Case:
    bodies = {
        "crank": {"kind": "link", "length": 0.1, "mass": 0.2},
        "rod": flat(0.3, 0.01, 0.004, {"young": 2.1e11, "density": 7850.0}),
        "block": {"kind": "mass", "mass": 0.25},
    }
    links = [
        {"body": "crank", "angle": -1.9, "drive": {"rate": 30.0}},
        {"body": "rod", "axial_modes": 12, "end_mass": 0.5},
    ]
    contacts = [
        {"between": ["rod.right", "block"], "along": "x", "gap": 0.02, "law": {"kind": "hertz", "stiffness": 1e9}}
    ]
    return document(bodies, links, 9e-3, dt, end={"slide": 0.0}, contacts=contacts, modes=10)


def test_a_slider_crank_strikes_a_block():
    history = il.run(slider_crank(1e-6))
    (span,) = history.contacts
    assert (span.start, span.end) == pytest.approx((7.4036e-3, 7.7558e-3), abs=1e-7)
    assert span.peak_force == pytest.approx(5620.7, rel=5e-4)
    assert span.impulse == pytest.approx(1.03821, rel=1e-4)
    assert float(history.evaluate(history.duration, "velocity:block")) == pytest.approx(4.1528, rel=1e-4)


def test_energy_and_work_of_the_drive_balance() -> None:
    """To 3e-8 of the energy at the start, at any time; the error falls by more than four with half the step."""
    errors = []
    for dt in (2e-6, 1e-6):
        book = il.run(slider_crank(dt)).energy
        total = sum(book.bodies.values()) + book.stored - book.work
        errors.append(float(np.ptp(total)) / float(np.abs(total[0])))
    assert errors[1] < 3e-8
    assert errors[0] / errors[1] > 4.0


HINGED = [
    {"body": "upper", "angle": 1.0, "rate": 3.0, "torque": 4.0, "axial_modes": 2},
    {"body": "fore", "angle": 0.2, "rate": 5.0, "torque": -2.0, "axial_modes": 2, "end_mass": 0.1},
]
DRIVEN = [
    {"body": "upper", "joint": "clamped", "angle": 1.0, "drive": {"rate": 3.0}, "axial_modes": 2},
    {"body": "fore", "joint": "clamped", "angle": 0.2, "axial_modes": 2, "end_mass": 0.1},
]


MIXED = [DRIVEN[0] | {"drive": {"rate": 3.0, "within": 0.01}}, HINGED[1]]


@pytest.mark.parametrize("links", [HINGED, DRIVEN, MIXED], ids=["hinged", "driven", "mixed"])
def test_angular_momentum_about_the_ground_hinge_changes_by_moments(links: list[dict[str, Any]]) -> None:
    """By the torque or the drive on the first link, and by the moment of the contact force; others act in pairs."""
    bodies = {"upper": flat(0.5, 0.02, 0.01, ALUMINIUM), "fore": flat(0.8, 0.02, 0.01, ALUMINIUM)}
    contacts = [
        {"between": ["fore.right", "stop"], "along": "y", "gap": 1e-5, "law": {"kind": "hertz", "stiffness": 1e9}},
        {"between": ["fore.right", "far"], "along": "x", "gap": 9.0, "law": {"kind": "hertz", "stiffness": 1.0}},
    ]  # the far wall records where the force along y acts
    duration, errors = 2e-3, []
    for dt in (4e-6, 2e-6, 1e-6):
        walls = {"stop": {"kind": "wall"}, "far": {"kind": "wall"}}
        case = document(bodies | walls, links, duration, dt, contacts=contacts, modes=8, snapshots=[0.0, duration])
        history, chain = il.run(case), Chain(case)
        assert len(history.contacts) > 0
        moved, rates = (history.motions(np.arange(2), "chain", of_rates)[:, : chain.n] for of_rates in (False, True))
        start, end = (chain.angular_momentum(moved[number], rates[number]) for number in (0, 1))
        lengths = np.diff(history.recorded["position:fore.right along x"].times)
        arms = history.recorded["position:fore.right along x"].values
        force = history.recorded[f"force:{history.scene.contacts[0].name}"].values[1:]
        moments = 0.5 * (arms[1:] + arms[:-1]) * -force
        moments += history.recorded["drive:upper"].values[1:] if "drive" in links[0] else links[0]["torque"]
        scale = float(np.abs(force * arms[1:]) @ lengths)
        errors.append(abs(end - start - float(moments @ lengths)) / scale)
    assert errors[2] < 1e-7
    assert errors[0] / errors[1] > 3.9
    assert errors[1] / errors[2] > 3.9


def test_a_beam_that_spins_up_lags_and_stretches_as_published():
    """Kane, Ryan and Banerjee 1987; Simo and Vu-Quoc 1986: to 6 rad/s within 15 s."""
    section, material = {"area": 1e-3, "inertia": 5e-7}, {"young": 2.8e10, "density": 1200.0}
    beam = {"kind": "beam", "length": 10.0, "section": section, "material": material}
    links = [{"body": "beam", "joint": "clamped", "drive": {"rate": 6.0, "within": 15.0}, "axial_modes": 2}]
    law = {"kind": "hertz", "stiffness": 1.0}
    contacts = [
        {"between": ["beam.right", wall], "along": along, "gap": 50.0, "law": law}
        for wall, along in (("east", "x"), ("north", "y"))
    ]
    bodies = {"beam": beam, "east": {"kind": "wall"}, "north": {"kind": "wall"}}
    history = il.run(document(bodies, links, 20.0, 2e-3, contacts=contacts, modes=5))
    t = np.arange(0.0, 20.0, 4e-3)  # ends of steps, as chords of the circle cut it by more than the stretch
    hub = history.evaluate(t, "angle:beam")
    x, y = (history.evaluate(t, f"position:beam.right along {along}") for along in "xy")
    lag = np.sin(hub) * x - np.cos(hub) * y
    assert hub[-1] == pytest.approx(6.0 * (t[-1] - 7.5), abs=1e-5)
    assert lag.max() == pytest.approx(0.574, rel=2e-3)
    assert t[np.argmax(lag)] == pytest.approx(6.76, abs=0.02)
    straight = (t > 18.0) & (np.abs(lag) < 2e-4)  # between the last small swings
    stretch = (np.cos(hub) * x + np.sin(hub) * y)[straight] - 10.0
    assert len(stretch) > 3
    assert float(np.mean(stretch)) == pytest.approx(5.14e-4, rel=5e-3)
    book = history.energy
    total = book.bodies["chain"] - book.work
    assert float(np.abs(total - total[0]).max() / np.abs(book.bodies["chain"]).max()) < 1e-8


def test_a_link_clamped_without_an_angle_goes_on_straight():
    def angles(**second: Any) -> list[float]:
        bodies = {name: {"kind": "link", "length": 0.5, "mass": 1.0} for name in ("a", "b")}
        links = [{"body": "a", "angle": "90 deg", "rate": 4.0}, {"body": "b", **second}]
        made = il.Case.from_dict({
            "bodies": bodies,
            "mechanisms": {"arm": {"links": links}},
            "solve": {"duration": 1e-3, "step": {"dt": 1e-4}},
        })  # fmt: skip
        return [link.angle for link in made.scene().bodies["arm"].links]

    assert angles(joint="clamped") == pytest.approx([np.pi / 2.0, np.pi / 2.0])
    assert angles(joint="clamped", angle=0.0) == pytest.approx([np.pi / 2.0, 0.0])
    assert angles(joint="hinge") == pytest.approx([np.pi / 2.0, 0.0])


def test_the_moment_of_a_drive_is_of_second_order() -> None:
    """A rigid bar that is brought to its rate: the moment is its inertia times the given angular acceleration."""
    rate, within, inertia = 6.0, 0.2, 0.5 * 0.4**2 / 3.0
    t = np.linspace(0.01, 0.19, 37)
    exact = inertia * rate / within * (1.0 - np.cos(2.0 * np.pi * t / within))
    errors = []
    for dt in (1e-3, 5e-4):
        case = il.Case.from_dict({
            "bodies": {"bar": {"kind": "link", "length": 0.4, "mass": 0.5}, "wall": {"kind": "wall"}},
            "mechanisms": {"arm": {"links": [{"body": "bar", "drive": {"rate": rate, "within": within}}]}},
            "contacts": [
                {"between": ["bar.right", "wall"], "along": "x", "gap": 5.0, "law": {"kind": "hertz", "stiffness": 1.0}}
            ],
            "solve": {"duration": 0.2, "integrator": {"kind": "midpoint"}, "step": {"dt": dt}, "records": 1000},
        })  # fmt: skip
        errors.append(float(np.abs(il.run(case).evaluate(t, "drive:bar") - exact).max()))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] < 1e-4 * exact.max()
