"""Claims of Sections 1 and 3: the classical methods, and St. Venant's solution."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.penalty import Penalty
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.metrics import midpoints
from impactlab.models.finite_element import FiniteElement
from impactlab.scene.method import StepRule
from impactlab.types import Relative
from studies.paper.by_hand import arriving, face_flight, paper_flight, second_by_hand
from studies.paper.claims import CONFIRMED, CORRECTED, REMARK, Finding, row
from studies.paper.problem import (
    FORCE,
    SEGMENT,
    SPEED,
    STRESS,
    Method,
    T,
    Z,
    at,
    computed,
    event,
    exact,
    modal,
    peak,
    penetration,
    rod_of,
    scene_of,
    spans,
    total_impulse,
)

RUN = "impactlab run cases/axial_impact.yaml"


# Section 1 ---------------------------------------------------------------------------------------------------------


@row("1", "p. 766", "With a contact element, penetration necessarily occurs.", "-", CONFIRMED)
def contact_element() -> Finding:
    soft = penetration(computed(modal(100, 40, Penalty(Relative(1.0)))))
    stiff = penetration(computed(modal(100, 40, Penalty(Relative(100.0)))))
    return Finding(
        f"deepest {soft:.1e} v0 T with a spring of $EA/h$, {stiff:.1e} with one 100 times stiffer (100 elements, "
        "40 modes)",
        {"soft": soft, "stiff": stiff},
        soft > stiff > 0.0,
    )


@row("1", "p. 766", "Constraint addition-deletion does not allow penetration.", "-", CONFIRMED)
def addition_deletion() -> Finding:
    method = Method(FiniteElement(100, "lumped"), AdditionDeletion(), CentralDifference(), StepRule(courant=0.9))
    deepest = penetration(computed(method))
    return Finding(
        "none beyond rounding (100 lumped elements, central difference)", {"deepest": deepest}, deepest < 1e-12
    )


@row(
    "1",
    "p. 766",
    "In the generalised impulse-momentum balance impacts are instantaneous, so contact forces are not obtained.",
    "-",
    CONFIRMED,
    f"{RUN} --method impulse_momentum",
)
def no_force() -> Finding:
    history = computed(modal(None, 40, ImpulseMomentum(1.0), integrator=ExactModal()))
    nothing = bool(np.all(np.isnan(history.evaluate(midpoints(history.duration, 100), FORCE))))
    kicks = spans(history)[0].kicks or 0
    total = total_impulse(history)
    return Finding(
        f"no force; but one balance is not the impact: {kicks} kicks add up to {total:.2f} m v0 (exact 1.70; 40 modes)",
        {"kicks": kicks, "total": total},
        nothing and kicks > 1,
    )


@row(
    "1",
    "p. 766 (on Palas et al.)",
    "With an infinite set of modes the balance gives a velocity jump at the contact area only.",
    "-",
    CONFIRMED,
)
def first_kick() -> Finding:
    kicks = {}
    for modes in (10, 40, 160):
        first = (
            spans(computed(modal(None, modes, ImpulseMomentum(1.0), integrator=ExactModal())))[0].first_impulse or 0.0
        )
        kicks[modes] = first / rod_of(scene_of().scene).mass
    closed = {modes: 2.0 / (1.0 + 2.0 * modes) for modes in kicks}
    return Finding(
        "the first impulse falls as $2/(1 + 2d)$, to nothing: "
        + ", ".join(f"{kick:.4f}" for kick in kicks.values())
        + " m v0 with $d$ = 10, 40, 160 modes",
        {f"modes_{modes}": kick for modes, kick in kicks.items()},
        all(abs(kicks[modes] - closed[modes]) < 1e-9 for modes in kicks),
    )


# Section 3 ---------------------------------------------------------------------------------------------------------


@row(
    "3",
    "Eqs. 2, 4, p. 768-769",
    "Stress and velocity of a section change by $s = \\rho c\\,v$ as a wave passes (sign of the travel direction).",
    "-",
    CONFIRMED,
)
def wave_relation() -> Finding:
    # Along a characteristic, v + s/(rho c) (rightwards) and v - s/(rho c) (leftwards) stay what they were.
    history, far = exact(), 0.2
    t = midpoints(2.0 * T, 500)
    way = far / SEGMENT.wave_speed
    worst = 0.0
    for sign, start, stop in ((1.0, "0", "0.2"), (-1.0, "0.2", "0")):
        here = history.evaluate(t, f"velocity:rod@{start}") + sign * history.evaluate(t, f"stress:rod@{start}") / STRESS
        later = history.evaluate(t + way, f"velocity:rod@{stop}")
        later = later + sign * history.evaluate(t + way, f"stress:rod@{stop}") / STRESS
        worst = max(worst, float(np.abs(here - later).max()))
    return Finding(
        "$v \\pm s/(\\rho c)$ is constant along its characteristic, to rounding", {"worst": worst}, worst < 1e-11
    )


@row(
    "3",
    "Eq. 5, p. 769",
    "Until the reflection returns, the stress is $s_0\\,e^{-\\sqrt{E\\rho}\\,t/M}$, $M$ the mass per area, which "
    "is $s_0\\,e^{-2t/T}$ here.",
    "$s_0 = \\rho c v_0$",
    CONFIRMED,
)
def first_interval() -> Finding:
    t = midpoints(T, 500)
    worst = float(np.abs(exact().evaluate(t, FORCE) / Z - np.exp(-2.0 * t / T)).max())
    first = at(exact(), FORCE, 0.0) / 1e3
    return Finding(f"the same to rounding; first force {first:.5f} kN", {"worst": worst, "force": first}, worst < 1e-12)


@row(
    "3",
    "Eq. 9, p. 769",
    "In the second interval the wave that leaves is $s_1 = s_0(t) + s_0\\,e^{-2(t/T - 1)}\\bigl(1 + 4(1 - "
    "t/T)\\bigr)$.",
    "-",
    CONFIRMED,
)
def second_interval() -> Finding:
    t = midpoints(T, 500)[:260] / T + 1.0
    y = t - 1.0
    formula = np.exp(-2.0 * t) + np.exp(-2.0 * y) * (1.0 - 4.0 * y)
    out = (exact().evaluate(t * T, "stress:rod@0") / STRESS + exact().evaluate(t * T, "velocity:rod@0")) / 2.0
    worst = float(np.abs(out - formula).max())
    most = peak(exact())
    return Finding(
        f"the same to rounding; so the largest contact stress is $2 + e^{{-2}}$ = {most:.6f} $\\rho c v_0$, at $t = T$",
        {"worst": worst, "peak": most},
        worst < 1e-11 and abs(most - 2.0 - math.exp(-2.0)) < 1e-11,
    )


@row(
    "3",
    "Section 3, p. 769",
    "During contact waves reflect at the contact surface as at a clamped end.",
    "-",
    CORRECTED,
)
def clamped_reflection() -> Finding:
    def reflected(alpha: float, after: float) -> float:
        history, t = exact(alpha), 1.0 + after
        stress, velocity = at(history, "stress:rod@0", t) / STRESS, at(history, "velocity:rod@0", t)
        going, coming = 0.5 * (stress + velocity), 0.5 * (stress - velocity)
        return (going - math.exp(-2.0 * alpha * t)) / coming

    front, quarter, opening = reflected(1.0, 1e-9), reflected(1.0, 0.25), reflected(1.0, 0.5338)
    heavy = reflected(1e-3, 0.25)
    return Finding(
        f"only the front does: the reflected share of the arriving wave is {front:.2f} at T, {quarter:z.2f} at 1.25 T "
        f"and {opening:.2f} at the opening ($1 - 4(t/T - 1)$). The mass balance of Eq. 7, which the paper then uses, "
        f"is right; the clamped end is its limit of a heavy mass ({heavy:.3f} at 1.25 T for $\\alpha = 0.001$)",
        {"front": front, "quarter": quarter, "opening": opening, "heavy": heavy},
        abs(front - 1.0) < 1e-6 and abs(quarter) < 1e-9 and opening < -1.0 and heavy > 0.99,
    )


@row("3", "Eqs. 10, 11a, p. 769", "End of the first impact and velocity there.", "1.534 T, 0.688 v0", CONFIRMED)
def first_end() -> Finding:
    opening, speed = event(exact(), 1), -at(exact(), SPEED, 1.8)
    return Finding(
        f"{opening:.6f} T, {speed:.6f} v0",
        {"opening": opening, "speed": speed},
        round(opening, 3) == 1.534 and round(speed, 3) == 0.688,
    )


@row("3", "Fig. 2, p. 770", "A second period of contact exists; it starts at:", "2.1284 T", CORRECTED)
def second_start() -> Finding:
    start = event(exact(), 2)
    return Finding(f"it exists, and starts at {start:.6f} T", {"start": start}, abs(start - 2.1284) > 0.003)


@row("3", "Eq. 13, p. 771", "Stress at the start of the second contact.", "0.274 s0", CORRECTED)
def second_stress() -> Finding:
    stress = at(exact(), FORCE, event(exact(), 2) + 1e-9) / Z
    return Finding(f"{stress:.6f} s0", {"stress": stress}, abs(stress - 0.274) > 0.02)


@row("3", "Eq. 13, p. 771", "Duration of the second contact.", "0.0347 T", CORRECTED)
def second_duration() -> Finding:
    duration = event(exact(), 3) - event(exact(), 2)
    return Finding(f"{duration:.6f} T", {"duration": duration}, abs(duration - 0.0347) > 0.003)


@row("3", "Eq. 13, p. 771", "Velocity of the mass after the second contact.", "0.6922 v0", CORRECTED)
def second_speed() -> Finding:
    speed = -at(exact(), SPEED, 3.0)
    return Finding(f"{speed:.6f} v0", {"speed": speed}, abs(speed - 0.6922) > 0.005)


@row(
    "3",
    "Eqs. 11 to 13, p. 770-771",
    "Where the four numbers above come from: the printed constants of Eq. 12 (1.068, 0.6566, 10.158, 2.5396) "
    "and 0.688.",
    "0.5944 T after the opening",
    REMARK,
)
def rounding() -> Finding:
    opening, speed = event(exact(), 1), -at(exact(), SPEED, 1.8)
    printed = float(brentq(lambda t: paper_flight(t) - 0.688 * t, 0.5, 0.62, xtol=1e-14))
    closed = float(brentq(lambda t: face_flight(t, opening) - speed * (t - opening), 2.05, 2.14, xtol=1e-14))
    exactly = closed - opening
    off = paper_flight(exactly) - 0.688 * exactly
    apart = 2.0 * arriving(closed) - speed
    by_paper, by_us = second_by_hand(1.534 + printed, 0.688), second_by_hand(closed, speed)
    return Finding(
        f"as printed the curves meet at {printed:.4f} T, so 1.534 + 0.5944 = 2.1284 T, and from there Eq. 13 gives "
        f"{by_paper.stress:.3f} s0, {by_paper.duration:.4f} T as printed, but {by_paper.speed:.4f} v0: the printed "
        "0.6922 v0 does not follow from the paper's own numbers (0.688 plus the impulse of that stress; it looks "
        f"like a slip of one digit). Unrounded, the same formulas give {exactly:.4f} T, hence {closed:.6f} T, "
        f"{by_us.stress:.4f} s0, {by_us.duration:.6f} T, {by_us.speed:.6f} v0. The printed curves are wrong by "
        f"{abs(off):.4f} v0 T there, and they meet with a difference of slope of only {apart:.2f} v0, so the crossing "
        f"moves by {printed - exactly:.4f} T",
        {
            "printed": printed,
            "closed": closed,
            "stress_printed": by_paper.stress,
            "duration_printed": by_paper.duration,
            "speed_printed": by_paper.speed,
            "stress": by_us.stress,
            "duration": by_us.duration,
            "speed": by_us.speed,
        },
        abs(printed - 0.5944) < 5e-5
        and abs(closed - event(exact(), 2)) < 1e-10
        and (round(by_paper.stress, 3), round(by_paper.duration, 4), round(by_paper.speed, 4))
        == (0.274, 0.0347, 0.6972)
        and abs(by_us.speed + at(exact(), SPEED, 3.0)) < 1e-10,
    )
