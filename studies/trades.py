"""Figures of the pages on pile driving and on drilling."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

import impactlab as il
from impactlab import drilling, piling
from impactlab.piling import case_method
from impactlab.report import style
from studies.pages import CASES, Study

AREA, SPEED, HAMMER = 1e-3, 5000.0, 0.5  # of the drill of the page: m2, m/s, m


def draw_blow() -> Figure:
    """Return force and Z v at the head, the largest stresses along the pile, and the bearing graph."""
    case = il.load_case(CASES / "smith_pile.yaml")
    blow = piling.blow(case)
    head, length = blow.head, 20.0
    figure = Figure(figsize=(style.WIDTH, 3.3), layout="constrained")
    first, second, third = figure.subplots(1, 3, width_ratios=(1.4, 1.0, 1.0))
    first.plot(1e3 * head.time, 1e-6 * head.force, color=style.INK, label="force")
    first.plot(1e3 * head.time, 1e-6 * head.impedance_velocity, color=style.PALETTE[1], ls="--", label="Z v")
    found = case_method(head.time, head.force, head.velocity, head.impedance, length, 4000.0, 0.4)
    for time, name in ((found.peak_time, "t1"), (found.peak_time + 0.01, "t1 + 2 L/c")):
        first.axvline(1e3 * time, color=style.MUTED, lw=0.8)
        first.annotate(name, (1e3 * time, 4.1), xytext=(3, 0), textcoords="offset points", color=style.MUTED)
    first.set(xlim=(0.0, 30.0), ylim=(-2.0, 4.5), xlabel="time  [ms]", ylabel="MN")
    first.set_title("At the head", loc="left")
    first.legend(frameon=False, loc="upper right", bbox_to_anchor=(1.0, 0.88))
    history = blow.history
    stress = np.array([history.field("pile", t, "stress").values for t in history.scene.field_times])
    x = history.field("pile", 0.0, "stress").x
    second.plot(1e-6 * stress.max(axis=0), x, color=style.PALETTE[0], label="compression")
    second.plot(-1e-6 * stress.min(axis=0), x, color=style.PALETTE[1], ls="--", label="tension")
    second.set(ylim=(20.0, 0.0), xlim=(0.0, 28.0), xlabel="largest stress  [MPa]", ylabel="below the head  [m]")
    second.set_title("Along the pile", loc="left")
    second.legend(frameon=False, loc="center", bbox_to_anchor=(0.5, 0.25))
    graph = piling.bearing_graph(case, np.linspace(0.6e6, 4.2e6, 25))
    third.plot(graph.blows_per_metre, 1e-6 * graph.capacity, color=style.INK)
    third.plot([blow.blows_per_metre or np.nan], [1.5], "o", color=style.PALETTE[1])
    third.set(xlim=(0.0, 500.0), ylim=(0.0, 4.4), xlabel="blows per metre", ylabel="static capacity  [MN]")
    third.set_title("Bearing graph", loc="left")
    return figure


def draw_driving() -> Figure:
    """Return the motion of head and toe per blow, and the residual forces along the pile."""
    driving = piling.drive(il.load_case(CASES / "smith_pile.yaml"), 8)
    figure = Figure(figsize=(style.WIDTH, 2.9), layout="constrained")
    left, right = figure.subplots(1, 2)
    numbers = np.arange(1, len(driving.blows) + 1)
    left.plot(numbers, [1e3 * each.head for each in driving.blows], "o-", color=style.INK, label="head")
    left.plot(numbers, [1e3 * each.toe for each in driving.blows], "s--", color=style.PALETTE[1], label="toe")
    left.set(xlabel="blow", ylabel="moved for good  [mm]")
    left.set_title("Each blow", loc="left")
    left.legend(frameon=False)
    for number, colour, dash in ((1, style.PALETTE[1], "--"), (8, style.INK, "-")):
        each = driving.blows[number - 1]
        label = f"after blow {number}"
        right.stairs(
            1e-3 * each.force, each.x, orientation="horizontal", color=colour, ls=dash, label=label, baseline=None
        )
    right.set(ylim=(20.0, 0.0), xlim=(0.0, None), xlabel="force in the pile  [kN]", ylabel="below the head  [m]")
    right.set_title("Residual forces", loc="left")
    right.legend(frameon=False, loc="lower left")
    return figure


def drill(stiffness: float, gamma: float, rod: float, duration: float) -> il.Case:
    """Return the drill of the page: rod and hammer of one impedance, on rock."""
    material = {"young": 2e11, "density": 8000.0}
    rock = {"kind": "bilinear", "stiffness": stiffness, "unloading_stiffness": stiffness / gamma}
    return il.Case(
        bodies={
            "hammer": il.Rod(length=HAMMER, area=AREA, material=material, velocity=10.0),
            "rod": il.Rod(length=rod, area=AREA, material=material),
            "rock": il.Wall(),
        },
        contacts=[
            il.Contact("hammer.right", "rod.left", {"kind": "energy_conserving"}),
            il.Contact("rod.right", "rock", rock),
        ],
        solve={"duration": duration, "model": {"kind": "continuous"}, "step": {"dt": 5e-7}},
    )


def draw_drill() -> Figure:
    """Return the force-penetration loop, the work over time, and the curve of efficiency."""
    several = drilling.blow(drill(5e7, 0.1, 3.0, 6e-3))
    loop = several.loop
    figure = Figure(figsize=(style.WIDTH, 3.0), layout="constrained")
    first, second, third = figure.subplots(1, 3)
    first.plot(1e3 * loop.penetration, 1e-3 * loop.force, color=style.INK)
    first.set(xlim=(0.0, 2.8), ylim=(0.0, 150.0), xlabel="penetration  [mm]", ylabel="force  [kN]")
    first.set_title("Bit on rock", loc="left")
    second.plot(1e3 * loop.time, loop.work, color=style.INK)
    second.axhline(200.0, color=style.MUTED, lw=0.8, ls="--")
    second.annotate("energy of the hammer", (0.1, 203.0), color=style.MUTED)
    second.set(xlim=(0.0, 6.0), ylim=(0.0, 220.0), xlabel="time  [ms]", ylabel="work on the rock  [J]")
    second.set_title("Pass after pass", loc="left")
    k = np.geomspace(1.5e7, 3e9, 30)
    curve = drilling.sweep(drill(2.5e8, 1e-4, 3.0, 1.7e-3), k)  # rock that gives nothing back
    b = 2.0 * k * HAMMER / (2e11 * AREA)
    third.semilogx(0.5 * b, 200.0 * (1.0 - np.exp(-b)) ** 2 / b, color=style.PALETTE[0], label="closed form")
    third.semilogx(0.5 * b, 100.0 * curve.first_pass, "o", ms=3.5, color=style.INK, label="runs")
    third.set(ylim=(0.0, 100.0), xlabel="k L / (E A)", ylabel="efficiency, one pass  [%]")
    third.set_title("Rock of several stiffnesses", loc="left")
    third.legend(frameon=False, loc="lower center")
    return figure


STUDY = Study(
    {},
    {
        "figures/pile_blow.png": draw_blow,
        "figures/pile_driving.png": draw_driving,
        "figures/drill_blow.png": draw_drill,
    },
)
