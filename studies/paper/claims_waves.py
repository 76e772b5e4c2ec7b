"""Claims of Sections 6 and 7 on waves: Figs 8 to 11.

They are waves along the rod.
"""

from __future__ import annotations

import numpy as np

from impactlab.history import AbstractHistory
from studies.paper.claims import CORRECTED, REMARK, Finding, percent, row
from studies.paper.problem import (
    PLAIN,
    REACTION,
    SEGMENT,
    SNAPSHOTS,
    STRESS,
    WAVE,
    Method,
    T,
    computed,
    exact,
    exact_field,
    modal,
)

RUN = "impactlab run cases/axial_impact.yaml"


@row(
    "6",
    "Figs 8, 9, p. 777",
    "Stress waves at 1.551e-5 s and 3.49e-5 s: the part of the rod that the wave has not reached stays at rest.",
    "at rest",
    REMARK,
)
def at_rest() -> Finding:
    def ahead(history: AbstractHistory, t: float, quantity: str, scale: float) -> float:
        field = history.field("rod", t, quantity)
        front = SEGMENT.wave_speed * t
        return float(np.abs(field.values[field.x > front + 0.1 * SEGMENT.length]).max()) / scale

    true = max(ahead(exact(), t, "stress", STRESS) for t in SNAPSHOTS[:2])
    printed = computed(modal(100, 70, PLAIN))
    values = {f"stress_{i + 8}": ahead(printed, t, "stress", STRESS) for i, t in enumerate(SNAPSHOTS[:2])}
    values["moved_9"] = ahead(printed, SNAPSHOTS[1], "displacement", T)
    return Finding(
        "exactly at rest in the continuous rod. With 70 of 100 modes more than $L/10$ ahead of the front the stress "
        f"ripples by up to {values['stress_8']:.2f} s0 (Fig. 8) and {values['stress_9']:.2f} s0 (Fig. 9), while "
        f"sections move by less than {values['moved_9']:.0e} v0 T: fast short waves of the mesh",
        values | {"exact": true},
        true == 0.0 and max(values.values()) < 0.2 and values["moved_9"] < 1e-2,
    )


@row(
    "6",
    "Figs 9, 10, p. 777-778",
    "Fig. 10 shows an instant after the first reflection; both captions give t = 3.49e-5 s.",
    "3.49e-5 s, 3.491e-5 s",
    CORRECTED,
    "python -m studies paper",
)
def captions() -> Finding:
    transit = SEGMENT.length / SEGMENT.wave_speed
    front = 3.49e-5 / transit
    return Finding(
        f"the wave reaches the clamped end at $L/c$ = {1e6 * transit:.2f} us; at 34.9 us its front is at {front:.2f} L "
        "(the times look like 2 T/15 and 0.3 T). Fig. 10's caption repeats Fig. 9's; we draw it at "
        f"{1e6 * SNAPSHOTS[2]:.0f} us, when the reflected front is back at {2.0 - SNAPSHOTS[2] / transit:.3f} L",
        {"transit": transit, "front": front},
        transit > 3.491e-5 and abs(0.3 * T - 3.491e-5) < 1e-8 and abs(2.0 * T / 15.0 - 1.551e-5) < 1e-8,
    )


@row(
    "6",
    "Figs 8 to 10, p. 778",
    "The stress waves of the simulation are smaller than those of theory.",
    "smaller",
    REMARK,
    f"{RUN} --set solve.model.modes=70 --set contacts.0.law.residual=false",
)
def wave_heights() -> Finding:
    def level(history: AbstractHistory, t: float) -> float:
        """Return the mean stress behind the front over the exact one.

        It is taken up to 80 % of the way of the front.
        """
        field = history.field("rod", t, "stress")
        behind = field.x < 0.8 * SEGMENT.wave_speed * t
        return float(np.mean(field.values[behind]) / np.mean(exact_field(field.x, t)[behind]))

    values = {}
    for name, law in (("printed", PLAIN), ("residual", WAVE)):
        for i, t in enumerate(SNAPSHOTS[:2]):
            values[f"{name}_{i + 8}"] = level(computed(modal(100, 70, law)), t)
    values["full_9"] = level(computed(modal(100, 100, PLAIN)), SNAPSHOTS[1])
    return Finding(
        f"mean stress behind the front {values['printed_8']:.2f} and {values['printed_9']:.2f} of the exact "
        f"one (Figs 8, 9) as printed: the loss of the messenger's reading. With residual {values['residual_8']:.2f} "
        f"and {values['residual_9']:.2f}, with 100 of 100 modes {values['full_9']:.2f}; then only the ripple "
        "at the front differs",
        values,
        values["printed_9"] < 0.9 and abs(values["residual_9"] - 1.0) < 0.03,
    )


@row(
    "6",
    "Fig. 11, p. 779",
    "There is no reaction at the clamped end until the wave arrives.",
    "0",
    REMARK,
    f"{RUN} --method modal_40",
)
def reaction() -> Finding:
    t = np.linspace(0.0, 0.45, 4000) * T
    true = float(np.abs(exact().evaluate(np.linspace(0.0, 0.49999, 2000) * T, REACTION)).max()) / STRESS
    forty, analytic = computed(modal(40, 40, PLAIN)), computed(modal(None, 40, WAVE))
    values = {"exact": true}
    for name, history in (("modes_40", forty), ("analytic_40", analytic)):
        values[name] = float(np.abs(history.evaluate(t, REACTION)).max()) / STRESS
        values[f"mean_{name}"] = float(np.mean(history.evaluate(t, REACTION))) / STRESS
    whole = np.linspace(0.0, 3.0, 9001) * T
    values["largest"] = float(forty.evaluate(whole, REACTION).max() / exact().evaluate(whole, REACTION).max())
    return Finding(
        "none in the continuous rod, where it starts with 2 s0 at T/2. With 40 of 40 modes the mean up to "
        f"0.45 T is {values['mean_modes_40']:.4f} s0, but fast short waves shake the clamp by up "
        f"to {values['modes_40']:.2f} s0 (40 analytic modes: {values['analytic_40']:.2f}). Largest reaction "
        f"{values['largest']:.2f} of the exact one, as with the contact stress",
        values,
        true == 0.0 and abs(values["mean_modes_40"]) < 0.02 and values["largest"] < 1.0,
    )


@row(
    "7",
    "p. 779-780",
    "Eigenvectors describe the propagation of the wave very well.",
    "-",
    REMARK,
)
def propagation() -> Finding:
    def off(method: Method) -> float:
        field = computed(method).field("rod", SNAPSHOTS[1], "stress")
        true = exact_field(field.x, SNAPSHOTS[1])
        return float(np.linalg.norm(field.values - true) / np.linalg.norm(true))

    values = {
        "printed": off(modal(100, 70, PLAIN)),
        "residual": off(modal(100, 70, WAVE)),
        "full": off(modal(100, 100, PLAIN)),
        "analytic": off(modal(None, 70, WAVE)),
    }
    return Finding(
        f"stress along the rod at 3.49e-5 s, relative L2 error: {percent(values['printed'])} with 70 of 100 as "
        f"printed, {percent(values['residual'])} with residual, {percent(values['full'])} with 100 "
        f"of 100, {percent(values['analytic'])} with 70 analytic modes. A jump keeps any such error high; the "
        "front stands at its place",
        values,
        values["residual"] < values["printed"] < 0.5,
    )
