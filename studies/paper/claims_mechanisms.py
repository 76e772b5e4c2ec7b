"""Claims of the introduction on mechanisms that strike.

They are on arms, a slider-crank, their flexibility and their laws.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

import impactlab as il
from studies.pages import CASES
from studies.paper.claims import REMARK, Finding, percent, row

ARM, TWO, CRANK = (il.load_case(CASES / f"{name}.yaml") for name in ("arm_on_stop", "two_link_arm", "slider_crank"))
TORQUE, GRIPPER = "mechanisms.robot.links.0.torque", "mechanisms.robot.links.0.end_mass"
STOP, LAST = "contacts.0.law.stiffness", "mechanisms.{}.links.1.axial_modes"
RIGID_ARM = {"bodies.arm": {"kind": "link", "length": 1.0, "mass": 0.54}}
RIGID_FORE = {"bodies.fore": {"kind": "link", "length": 0.8, "mass": 0.432}, LAST.format("robot"): 0}
NO_STRETCH = {LAST.format("press"): 0}
RIGID_ROD = {"bodies.rod": {"kind": "link", "length": 0.3, "mass": 0.0942}, **NO_STRETCH}
FINE = {"solve.model.modes": 36, "solve.step": {"dt": 1.0e-6}}
ROD = 4.0e-5 * math.sqrt(2.1e11 * 7850.0), 0.25  # N s/m and kg: Z of the connecting rod, and the block that it strikes


class Burst:
    """The contacts of one run: peaks [N] and impulses [N s], each and in all."""

    def __init__(self, case: il.Case, duration: float, *changes: Mapping[str, Any]) -> None:
        settings = {"solve.duration": duration}
        for each in changes:
            settings |= each
        self.history = il.run(case.with_settings(settings))
        spans = self.history.contacts
        self.peaks = [span.peak_force or 0.0 for span in spans]
        self.impulses = [span.impulse for span in spans]
        self.peak, self.first, self.whole = max(self.peaks), self.impulses[0], sum(self.impulses)

    def over(self, other: Burst) -> tuple[float, float, float]:
        """Return peak, first impulse and the impulse of the whole burst over those of another."""
        return self.peak / other.peak, self.first / other.first, self.whole / other.whole


@row("1", "p. 767, of Yigit [13]", "Flexibility reduces the severity of the impact load.", "-", REMARK)
def flexibility_softens() -> Finding:
    two, rigid_two = Burst(TWO, 0.04), Burst(TWO, 0.04, RIGID_FORE)
    crank, stiff, rigid_crank = (Burst(CRANK, 0.02, each) for each in ({}, NO_STRETCH, RIGID_ROD))
    pressed = {TORQUE: 5.0}
    arm, fine, rigid_arm = (Burst(ARM, 0.018, pressed, each) for each in ({}, FINE, RIGID_ARM))
    a, b, c = two.over(rigid_two), crank.over(rigid_crank), arm.over(rigid_arm)
    bent = stiff.over(rigid_crank)[0]
    return Finding(
        f"of a blow it does, and least of the whole burst: with a flexible forearm the two-link arm strikes with "
        f"{a[0]:.2f} of the largest force of the rigid one ({two.peak:.0f} and {rigid_two.peak:.0f} N), {a[1]:.2f} of "
        f"its first impulse, and {a[2]:.2f} of its impulse in all, in {len(two.peaks)} contacts instead of one. "
        f"Without torque and losses the whole burst of a single arm cannot exceed the blow of the rigid one: energy "
        f"left in vibration is missing in the rebound. The slider-crank strikes once, with {b[0]:.2f} of the force and "
        f"{b[1]:.2f} of the impulse: all by the stretch of its rod; bending alone leaves {bent:.4f} of the force. "
        f"Where a torque presses, it is otherwise: under 5 N m the flexible arm of the case `arm_on_stop` is struck "
        f"first with {arm.peaks[0]:.0f} N and then with {arm.peaks[1]:.0f} N ({fine.peaks[1]:.0f} N with 36 modes at "
        f"half the step), the rigid one with {rigid_arm.peak:.0f} N",
        {
            "two_peak": a[0], "two_first": a[1], "two_whole": a[2], "crank_peak": b[0], "crank_impulse": b[1],
            "crank_bent": bent, "pressed_peak": c[0], "pressed_apart": fine.peak / arm.peak - 1.0,
        },
        a[1] < a[0] < a[2] < 1.0 and b[1] < b[0] < 0.9 and abs(bent - 1.0) < 1e-3 and c[0] > 1.9
        and len(arm.peaks) == len(fine.peaks) and abs(fine.peak / arm.peak - 1.0) < 5e-3,
    )  # fmt: skip


@row("1", "p. 767, of Yigit [13]", "Multiple impacts occur, with a decreasing intensity of them.", "-", REMARK)
def decreasing_intensity() -> Finding:
    two, arm = Burst(TWO, 0.011), Burst(ARM, 0.018)
    pressed = {TORQUE: 2.0}
    light = {TORQUE: 0.0, GRIPPER: 0.03, STOP: 3.0e6}
    torque, soft = Burst(ARM, 0.018, pressed), Burst(ARM, 0.03, light)
    apart = [
        abs(other.impulses[1] / found.impulses[1] - 1.0)
        for found, changes, duration in ((torque, pressed, 0.018), (soft, light, 0.03))
        for other in [Burst(ARM, duration, changes, FINE)]
        if len(other.peaks) == len(found.peaks)
    ]

    def told(found: Burst) -> str:
        return ", ".join(f"{peak:.4g} N" for peak in found.peaks)

    gained = 2.0 * 0.0148
    return Finding(
        f"so it is with the two-link arm ({told(two)}) and with the arm on its stop ({told(arm)}). It is no law. A "
        f"torque of 2 N m makes the second contact the stronger one ({told(torque)}; "
        f"{torque.impulses[0]:.4f} and {torque.impulses[1]:.4f} N s): in the 15 ms between them it gives {gained:.3f} "
        f"N m s to an arm that arrived with 0.028. It happens without a torque, too, with a light gripper on a soft "
        f"stop (0.03 kg, 3e6 N/m^1.5: {told(soft)}; {soft.impulses[0]:.4f} and {soft.impulses[1]:.4f} N s): the first "
        f"contact turns back less than half of the motion, and the second one the rest. With 36 modes at half the step "
        f"the second impulses differ by {percent(max(apart))} at most",
        {
            "two": two.impulses[1] / two.impulses[0], "arm": arm.impulses[1] / arm.impulses[0],
            "torque": torque.impulses[1] / torque.impulses[0], "soft": soft.impulses[1] / soft.impulses[0],
            "soft_peak": soft.peaks[1] / soft.peaks[0], "apart": max(apart),
        },
        all(sorted(each.impulses, reverse=True) == each.impulses for each in (two, arm)) and len(apart) == 2
        and torque.impulses[1] > 1.2 * torque.impulses[0] and soft.impulses[1] > 1.05 * soft.impulses[0]
        and soft.peaks[1] > 1.1 * soft.peaks[0] and max(apart) < 2e-3,
    )  # fmt: skip


def mass_of_rigid_arm() -> float:
    """Return the effective mass of the rigid two-link arm [kg].

    With it, the arm meets its stop: 1/(J M^-1 J) in the position of the case. The mass matrix is that of a double
    pendulum, in the absolute angles of its links.
    """
    upper, fore, hand, elbow, length, angle = 0.5, 0.432, 0.1, 0.5, 0.8, math.radians(60.0)
    static, inertia = (0.5 * fore + hand) * length, (fore / 3.0 + hand) * length**2
    coupled = elbow * static * math.cos(angle)
    matrix = np.array([[(upper / 3.0 + fore + hand) * elbow**2, coupled], [coupled, inertia]])
    reach = np.array([elbow * math.cos(angle), length])
    return float(1.0 / (reach @ np.linalg.solve(matrix, reach)))


@row(
    "1",
    "p. 766, of Khulief and Shabana [5]",
    "Spring and damper follow from the energy balance; an effective mass accounts for the bodies in the system that "
    "are connected by kinematic pairs.",
    "-",
    REMARK,
)
def effective_mass() -> Finding:
    effective, restitution = mass_of_rigid_arm(), 0.5

    def returned(mass: float, *changes: Mapping[str, Any]) -> float:
        """Return the speed after the first contact over the one before it."""
        law = {"kind": "khulief_shabana", "stiffness": 1.0e7, "restitution": restitution, "effective_mass": mass}
        history = Burst(TWO, 0.01, {"contacts.0.law": law}, *changes).history
        end = (history.contacts[0].end or math.nan) + 2.0e-6
        before, after = history.evaluate([0.0, end], "velocity:fore.right")
        return -float(after / before)

    right, hand, whole = (returned(mass, RIGID_FORE) for mass in (effective, 0.1, 1.032))
    bent, near = returned(effective), returned(0.1)
    return Finding(
        f"the effective mass is needed, and enough for rigid links: the two-link arm of 1.032 kg meets its stop with "
        f"$1/(\\mathbf J^\\mathsf T\\mathbf M^{{-1}}\\mathbf J)$ = {effective:.4f} kg, and with the damper made for it "
        f"and restitution 0.5 it returns with "
        f"{right:.4f} of its speed; with the mass of its hand {hand:.2f}, with its whole mass {whole:.2f}. With a "
        f"flexible forearm the first contact returns {bent:.2f}, with the damper for the mass of the hand {near:.2f}: "
        f"in so short a time only the hand and the end of the forearm answer, and vibration takes energy that our "
        f"version of the law, with its balance of rigid bodies, does not count. On the slider-crank, whose drive holds "
        f"the rate, the effective mass of a rigid chain is infinite, and the 0.25 kg of the block alone count",
        {"effective": effective, "right": right, "hand": hand, "whole": whole, "bent": bent, "bent_hand": near},
        abs(right - restitution) < 2e-3 and hand > 0.6 and whole < 0.35 and bent < near < 0.5,
    )  # fmt: skip


@row(
    "1",
    "p. 766, of Shao and others [10]",
    "On a flexible slider-crank the initial velocities of the nodes in contact and the initial contact pressure are "
    "obtained from wave propagation concepts.",
    "-",
    REMARK,
)
def pressure_of_a_link() -> Finding:
    light = {"mechanisms.press.links.1.end_mass": 0.0, LAST.format("press"): 40, "solve.step": {"dt": 2.0e-7}}
    hard = {"contacts.0.law": {"kind": "velocity_complementarity"}}
    history = Burst(CRANK, 0.0076, light, hard).history
    start = history.contacts[0].start
    speed = float(history.evaluate([start - 1e-6], "velocity:rod.right")[0])
    share = math.cos(float(history.evaluate([start], "angle:rod")[0])) ** 2
    times = np.array([1.0e-5, 2.0e-5, 4.0e-5, 5.8e-5])
    block = history.evaluate(start + times, "velocity:block") / speed
    z, mass = ROD
    errors = [np.abs(block / (1.0 - np.exp(-part * z / mass * times)) - 1.0) for part in (1.0, share)]
    plain, inclined = (float(np.max(each)) for each in errors)
    kept = Burst(CRANK, 0.0076, light, {"contacts.0.law": {"kind": "addition_deletion"}}).history
    same = float(np.max(np.abs(kept.evaluate(start + times, "velocity:block") / (block * speed) - 1.0)))
    return Finding(
        f"they follow from it with the angle $\\theta$ of the rod: on its slide the end moves along x, its wave "
        f"along the rod, "
        f"so the first force is $Z v_0\\cos^2\\theta$, here {share:.3f} $Z v_0$. Without a slider's mass the speed "
        f"of the "
        f"struck block rises by that impedance to {percent(inclined)} until the "
        f"reflection comes (hard contact, 40 axial modes); by $Z$ alone it is wrong by up to {percent(plain)}. With a "
        f"slider of 0.5 kg a hard blow starts with an impulse between two masses, which no wave gives. The constraint "
        f"technique itself (`addition_deletion`, whole steps) has the same speeds to {percent(same)}, and gains "
        f"{percent(kept.energy.largest_gain)} of energy",
        {
            "share": share, "inclined": inclined, "plain": plain,
            "constraint": same, "gain": float(kept.energy.largest_gain),
        },
        inclined < 3e-3 and float(np.min(errors[0])) > 0.08 and same < 0.02,
    )  # fmt: skip
