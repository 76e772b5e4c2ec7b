"""Figure of the page on wave identification.

It shows the contact force of the paper's impact, exact and by the 1999 method.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

import impactlab as il
from impactlab.report.figures import style
from impactlab.scene import Rod
from studies.pages import CASES, Study


def draw() -> Figure:
    """Return the figure of contact force and face displacement.

    They are over time, in the units of the paper.
    """
    case = il.load_case(CASES / "axial_impact.yaml")
    scene = case.scene()
    [rod] = [body for body in scene.bodies.values() if isinstance(body, Rod)]
    period, impedance = scene.round_trip, rod.segments[0].impedance
    t = np.linspace(0.0, 2.6 * period, 4000)
    runs = [
        ("exact", il.run(case.method("continuous")), style.INK, 2.0),
        ("10 modes", il.run(case.method("modal_10")), style.PALETTE[1], 1.1),
        ("40 modes of 100 elements", il.run(case), style.PALETTE[0], 1.1),
    ]
    figure = Figure(figsize=(style.WIDTH, 3.5), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.45, 1.0))
    for name, history, colour, width in runs:
        front = 3 if name == "exact" else 2
        force = history.evaluate(t, "force:hammer|rod.left") / impedance
        face = history.evaluate(t, "displacement:rod@0") / period
        left.plot(t / period, force, color=colour, lw=width, label=name, zorder=front)
        right.plot(t / period, face, color=colour, lw=width, zorder=front)
    hammer = runs[0][1].evaluate(t, "position:hammer") / period
    right.plot(t / period, hammer, color=style.MUTED, lw=1.2, ls="--", zorder=1)
    right.annotate("mass", (2.45, float(hammer[-150])), xytext=(6, 6), textcoords="offset points", color=style.MUTED)
    left.annotate(
        "second contact", (2.144, 0.33), xytext=(2.144, 0.95), ha="center", color=style.INK,
        arrowprops={"arrowstyle": "-", "color": style.MUTED, "lw": 0.8},
    )  # fmt: skip
    left.set(xlabel="t / T", ylabel="contact force / (Z v0)", ylim=(0.0, 2.45), xlim=(0.0, 2.6))
    right.set(xlabel="t / T", ylabel="displacement / (v0 T)", xlim=(0.0, 2.6))
    left.legend(frameon=False, loc="upper right")
    left.set_title("Contact force", loc="left")
    right.set_title("Struck face and mass", loc="left")
    return figure


STUDY = Study({}, {"figures/axial_impact.png": draw})
