"""Figures of the pages on pile driving and on drilling.

Also the table of the case measured_head (``--head``).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

import impactlab as il
from impactlab import drilling, piling
from impactlab.piling import case_method
from impactlab.report.figures import style
from studies.pages import CASES, Study

AREA, SPEED, HAMMER = 1e-3, 5000.0, 0.5  # of the drill of the page: m2, m/s, m
PUT_IN = {
    "shaft.capacity": 6e5, "shaft.quake": 2.5e-3, "shaft.damping": 0.2,
    "toe.capacity": 9e5, "toe.quake": 3e-3, "toe.damping": 0.5,
}  # fmt: skip


def draw_blow() -> Figure:
    """Return the figure of one blow on a pile.

    It shows force and Z v at the head, the largest stresses along the pile, and the bearing graph.
    """
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
    first.set(xlim=(0.0, 30.0), ylim=(-2.0, 4.5), xlabel="time  [ms]", ylabel="force, Z v  [MN]")
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
    """Return the figure of head and toe motion per blow.

    It also shows the residual forces along the pile.
    """
    driving = piling.drive(il.load_case(CASES / "smith_pile.yaml"), 8)
    figure = Figure(figsize=(style.WIDTH, 2.9), layout="constrained")
    left, right = figure.subplots(1, 2)
    numbers = np.arange(1, len(driving.blows) + 1)
    left.plot(numbers, [1e3 * each.head for each in driving.blows], "o-", color=style.INK, label="head")
    left.plot(numbers, [1e3 * each.toe for each in driving.blows], "s--", color=style.PALETTE[1], label="toe")
    left.set(xlabel="blow", ylabel="permanent displacement  [mm]")
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


def write_head(rows: Sequence[str]) -> int:
    """Write cases/measured_head.csv, the signals at the head of `smith_pile`; ``rows`` is ``--head``."""
    if list(rows) != ["--head"]:
        print("python -m studies applications --head writes cases/measured_head.csv")
        return 2
    (CASES / "measured_head.csv").write_text(head_table(), encoding="utf-8")
    return 0


def head_table() -> str:
    """Return the head signals of `smith_pile` as a CSV text.

    They are time, force and velocity, 20 samples to a millisecond.
    """
    head = piling.blow(il.load_case(CASES / "smith_pile.yaml")).head
    time = np.linspace(0.0, head.time[-1], 2001)
    lines = ["time [ms],force [kN],velocity [m/s]"]
    for each in time:
        force, velocity = (np.interp(each, head.time, values) for values in (head.force, head.velocity))
        lines.append(f"{1e3 * each:.2f},{1e-3 * force:.3f},{velocity:.6f}")
    return "\n".join(lines) + "\n"


def draw_match() -> Figure:
    """Return the figure of a signal match with its uncertainties.

    It shows the measured head velocity with that of the start and of the fitted soil.
    """
    case = il.load_case(CASES / "measured_head.yaml")
    found, rough = matched(case, 0.02), start_of(case)
    figure = Figure(figsize=(style.WIDTH, 2.9), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    ms = 1e3 * found.time
    left.plot(ms, found.measured, color=style.MUTED, lw=0.8, label="measured, 2 % noise")
    left.plot(ms, il.run(rough).evaluate(found.time, "velocity:pile@0"), color=style.PALETTE[1], ls="--", label="start")
    left.plot(ms, found.computed, color=style.INK, label="fitted")
    left.set(xlim=(0.0, 60.0), xlabel="time  [ms]", ylabel="velocity of the head  [m/s]")
    left.set_title("Head under the measured force", loc="left")
    left.legend(frameon=False, loc="upper right")
    rows = [*found.parameters, found.capacity]
    for place, (each, exact) in enumerate(zip(rows, [*PUT_IN.values(), 1.5e6], strict=True)):
        ends = np.array([each.lower, each.value, each.upper]) / exact
        right.plot(100.0 * (ends[[0, 2]] - 1.0), [place, place], color=style.INK, lw=2.0)
        right.plot(100.0 * (ends[1] - 1.0), place, "o", ms=4.0, color=style.INK)
    right.axvline(0.0, color=style.MUTED, lw=0.8)
    right.set_yticks(range(len(rows)), [*PUT_IN, "capacity of both"])
    right.set(ylim=(len(rows) - 0.5, -0.5), xlabel="error of the fitted value  [%]")
    right.set_title("95 % intervals", loc="left")
    return figure


def start_of(case: il.Case) -> il.Case:
    """Return the case with half of each number of its soil."""
    halves = {name: 0.5 * value for name, value in PUT_IN.items()}
    blocks = {"shaft": 0, "toe": 1}
    paths = {name: f"contacts.{blocks[name.split('.')[0]]}.law.{name.split('.')[1]}" for name in halves}
    return case.with_settings({paths[name]: value for name, value in halves.items()})


def matched(case: il.Case, noise: float) -> piling.Match:
    """Return the soil that matches the table with noisy velocities.

    The match starts from half of each number.
    """
    time, force, velocity = np.loadtxt(CASES / "measured_head.csv", delimiter=",", skiprows=1, unpack=True)
    velocity = velocity + noise * velocity.max() * np.random.default_rng(1).standard_normal(velocity.size)
    return piling.match(start_of(case), 1e-3 * time, 1e3 * force, velocity, list(PUT_IN))


STUDY = Study(
    {},
    {
        "figures/pile_blow.png": draw_blow,
        "figures/pile_driving.png": draw_driving,
        "figures/pile_match.png": draw_match,
        "figures/drill_blow.png": draw_drill,
    },
    command=write_head,
)
