"""Bending moments, shear forces, stresses and strains of flexible links, by probes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.history.base import AbstractHistory
from impactlab.types import Array

LENGTH, WIDTH, HEIGHT, YOUNG, DENSITY, G = 1.0, 0.02, 0.01, 7e10, 2700.0, 9.81
WEIGHT = DENSITY * WIDTH * HEIGHT * G  # N/m
HELD = {"joint": "clamped", "drive": {"rate": 0.0}}
QUANTITIES = ("bending_moment", "shear_force", "stress", "strain")


def arm(young: float = YOUNG, **keys: Any) -> il.Beam:
    section = {"width": WIDTH, "height": HEIGHT}
    return il.Beam(length=LENGTH, section=section, material={"young": young, "density": DENSITY}, **keys)


def run(
    modes: int,
    link: dict[str, Any],
    duration: float = 0.05,
    young: float = YOUNG,
    at: float = 0.35,
    angle: float = 0.0,
    before: tuple[dict[str, Any], ...] = (),
) -> AbstractHistory:
    """Return the run of an arm across gravity at t = 0, turned with it by an angle [rad]; ``before`` it other links."""
    probes = [il.Probe("arm", x, quantity) for quantity in QUANTITIES for x in (0.0, at)]
    solve = {
        "duration": duration,
        "model": {"kind": "modal", "elements": 40, "modes": modes},
        "integrator": {"kind": "midpoint"},
        "step": {"dt": 2e-5},
    }
    bodies = {"arm": arm(young), **{each["body"]: il.Link(length=0.3, mass=0.1) for each in before}}
    case = il.Case(
        bodies=bodies,
        mechanisms={"machine": {"links": [*before, {"body": "arm", "angle": angle, **link}]}},
        gravity=[G * math.sin(angle), -G * math.cos(angle)],
        probes=probes,
        solve=solve,
    )
    return il.run(case)


def values(history: AbstractHistory, channel: str) -> Array:
    return np.asarray(history.evaluate(np.linspace(0.0, history.duration, 2001), channel))


def test_a_link_that_is_held_has_the_internal_forces_of_a_cantilever() -> None:
    """A beam of the same modes under the same weight: its equations are linear, and the link hardly bends."""
    link = run(6, HELD)
    probes = [il.Probe("arm", x, quantity) for quantity in QUANTITIES for x in (0.0, 0.35)]
    solve = {"duration": 0.05, "model": {"kind": "modal", "elements": 40, "modes": 6}, "step": {"dt": 2e-5}}
    beam = il.run(
        il.Case(
            bodies={"arm": arm(ends={"left": "clamped"})},
            gravity=-G,
            probes=probes,
            solve=solve | {"integrator": {"kind": "newmark"}},
        )
    )
    for probe in beam.scene.probes:
        wanted = values(beam, probe.channel)
        assert np.abs(values(link, probe.channel) - wanted).max() < 1e-12 * np.abs(wanted).max()


def test_an_arm_on_a_held_link_and_with_axial_shapes_has_the_same_internal_forces() -> None:
    """Other links and axial shapes come before the coordinates that a moment is read from."""
    alone = run(6, HELD)
    held = {"body": "bar", "drive": {"rate": 0.0}}
    behind = run(6, {"joint": "clamped", "axial_modes": 2}, before=(held,))
    for quantity in QUANTITIES:
        wanted = values(alone, f"{quantity}:arm@0.35")
        assert np.abs(values(behind, f"{quantity}:arm@0.35") - wanted).max() < 1e-5 * np.abs(wanted).max()


def test_the_moment_at_the_root_balances_that_of_the_hub() -> None:
    """The moment of the hub follows from the equation of rotation; the sum of the modes tends to it."""
    missing = []
    for modes in (3, 12):
        link = run(modes, HELD)
        hub, root = values(link, "drive:arm"), values(link, "bending_moment:arm@0")
        missing.append(np.abs(hub + root).max() / np.abs(hub).max())
    assert missing[0] < 0.01
    assert missing[1] < missing[0] / 10.0  # as the cube of the modes or faster, under a load without jumps


def test_a_falling_bar_bends_most_at_a_third_of_its_length() -> None:
    """The moment of a uniform bar that is let go about a hinge, w x (L - x)^2/(4 L) while it is horizontal.

    w is its weight per length; a falling chimney breaks there. The moment of a stiff bar oscillates about this one.
    """
    for x in (LENGTH / 3.0, 0.6 * LENGTH):
        history = run(12, {}, duration=0.02, young=100.0 * YOUNG, at=x)
        times = np.linspace(0.0, history.duration, 4001)
        window = np.sin(np.pi * times / history.duration) ** 4  # lets oscillations cancel
        moment, shear = (
            float(np.sum(window * history.evaluate(times, f"{quantity}:arm@{x:.6g}")) / window.sum())
            for quantity in ("bending_moment", "shear_force")
        )
        rest = LENGTH - x
        assert moment == pytest.approx(WEIGHT * x * rest**2 / (4.0 * LENGTH), rel=2e-3)  # half of it by modes left out
        # Its negative slope, zero at a third; of the shear force more lies in modes left out.
        assert shear == pytest.approx(WEIGHT * rest * (2.0 * x - rest) / (4.0 * LENGTH), abs=1e-3 * WEIGHT * LENGTH)


def test_internal_forces_are_those_in_the_frame_of_the_link() -> None:
    level, turned = (run(4, {"rate": 3.0}, at=0.3, angle=angle) for angle in (0.0, 2.0))
    for quantity in QUANTITIES:
        wanted = values(level, f"{quantity}:arm@0.3")
        assert np.abs(values(turned, f"{quantity}:arm@0.3") - wanted).max() < 1e-9 * np.abs(wanted).max()


@pytest.mark.parametrize(
    ("probe", "words"),
    [
        ({"body": "arm", "at": 0.1, "quantity": "velocity"}, "Allowed: bending_moment, shear_force, stress, strain"),
        ({"body": "bar", "at": 0.1, "quantity": "stress"}, "'bar' is a rigid link"),
        ({"body": "arm", "at": 1.1, "quantity": "stress"}, "lies outside the body 'arm'"),
    ],
)
def test_probes_that_a_link_does_not_have_are_refused(probe: dict[str, Any], words: str) -> None:
    links = [{"body": "arm"}, {"body": "bar"}]
    bodies = {"arm": arm(), "bar": {"kind": "link", "length": 0.3, "mass": 0.1}}
    with pytest.raises(il.CaseError, match=words):
        il.Case(bodies=bodies, mechanisms={"machine": {"links": links}}, probes=[probe], solve={"duration": 1e-3})
