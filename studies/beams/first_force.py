"""The first force of an impact on a beam: beams-first-force.md.

The study makes the table and the figure of this page.

A mass strikes the middle of a free steel beam, 1 cm x 1 cm and 60 cm long, so hard that both move together; until
58 us nothing comes back from its ends. The mean force since the touch is M (v0 - v)/t, of any method, over
2 sqrt(kGA rho A) v0.
"""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy.special import erfcx

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.dispersive_identification import DispersiveIdentification
from impactlab.contact.velocity_complementarity import VelocityComplementarity
from impactlab.history import AbstractHistory
from impactlab.integrators.exact_modal import ExactModal
from impactlab.models.base import AbstractRodModel
from impactlab.models.continuous import Continuous
from impactlab.models.modal import Modal
from impactlab.report.figures import style
from impactlab.scene import Beam, BeamSegment, End
from impactlab.scene.method import StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import struck
from impactlab.types import Array
from studies.pages import Study, filled

COUNTS = (20, 40, 80, 160, 320, 640)
LENGTH, SIDE, YOUNG, DENSITY = 0.6, 0.01, 2.1e11, 7900.0
AREA, INERTIA = SIDE**2, SIDE**4 / 12.0
SHEAR = 5.0 / 6.0 * YOUNG / 2.6 * AREA
IMPEDANCE = 2.0 * math.sqrt(SHEAR * DENSITY * AREA)  # at an inner point
RESISTANCE = math.sqrt(8.0) * (YOUNG * INERTIA) ** 0.25 * (DENSITY * AREA) ** 0.75
MASS, SPEED = 0.5, 1.0
EARLY, LAST, END = 7e-6, 3e-5, 5e-5  # s: where the finest steps end, the figure, and the runs


class Line(NamedTuple):
    """A modal result: relative mean force since the touch.

    It is over the first force of the Timoshenko beam.
    """

    modes: int
    period: float  # s, of the highest mode
    times: Array
    force: Array
    first: float  # over the period of the highest mode


def body(theory: str) -> Beam:
    """Return the beam by one of the theories."""
    shears = theory == "timoshenko"
    segment = BeamSegment(
        LENGTH, AREA, YOUNG, DENSITY, inertia=INERTIA, height=SIDE,
        shear_stiffness=SHEAR if shears else math.inf, rotary_inertia=DENSITY * INERTIA if shears else 0.0,
    )  # fmt: skip
    ends = End("free"), End("free")
    return Beam("beam", (segment,), *ends, theory="timoshenko" if shears else "euler_bernoulli")


@cache
def measured() -> dict[str, list[Line]]:
    """Return the modal solutions by theory."""
    return {theory: [modal(theory, modes) for modes in COUNTS] for theory in ("timoshenko", "euler_bernoulli")}


def struck_run(
    beam: Beam, model: AbstractRodModel, law: AbstractContactLaw, dt: float, duration: float
) -> AbstractHistory:
    """Return the run of a mass on the middle of a beam."""
    integrator = None if isinstance(model, Continuous) else ExactModal()
    place = {"mass": MASS, "velocity": SPEED, "x": 0.5 * LENGTH, "duration": duration}
    return run(*struck(beam, model, law, integrator, StepRule(dt=dt), **place))


def mean_force(history: AbstractHistory, times: Array) -> Array:
    """Return the mean force since the touch, over the first force, at times [s]."""
    velocity = history.evaluate(times, "velocity:hammer")
    return np.asarray(MASS * (SPEED - velocity) / times / (IMPEDANCE * SPEED))


def modal(theory: str, modes: int) -> Line:
    """Return the force by a number of modes.

    There are ten steps in the period of the highest.
    """
    beam = body(theory)
    model = Modal(modes=modes)
    highest = model.build_beam(beam, 0.0).operators().highest_frequency
    period = 2.0 * math.pi / highest
    dt = 0.1 * period
    times = np.geomspace(dt, max(LAST, 1.5 * period), 400)
    # Read at ends of steps: between them the velocity is drawn as a line.
    times = dt * np.unique(np.round(times / dt))
    history = struck_run(beam, model, VelocityComplementarity(), dt, 1.01 * float(times[-1]))
    force = mean_force(history, times)
    return Line(modes, period, times, force, float(np.interp(period, times, force)))


@cache
def continuous(dt: float, end: float) -> AbstractHistory:
    """Return a run of the continuous Timoshenko beam; several lines of the table and the figure read it."""
    return struck_run(body("timoshenko"), Continuous(), DispersiveIdentification(), dt, end)


def waves(times: Array) -> Array:
    """Return the solution of the continuous Timoshenko beam.

    Each step of the later part, which takes five times as long, is still below a hundredth of the time it is read at.
    """
    early, late = continuous(4e-9, EARLY), continuous(2e-8, END)
    return np.where(times < EARLY, mean_force(early, np.minimum(times, EARLY)), mean_force(late, times))


def endless(times: Array) -> Array:
    """Return the closed form of the infinite Euler-Bernoulli beam.

    Its mean force is 2 K v0/sqrt(pi t) at first.
    """
    slowed = SPEED * (1.0 - erfcx(RESISTANCE / MASS * np.sqrt(times)))
    return np.asarray(MASS * slowed / times / (IMPEDANCE * SPEED))


def draw(lines: dict[str, list[Line]]) -> Figure:
    """Return the figure of the mean force over time.

    It is also shown over the first period of the highest mode.
    """
    figure = Figure(figsize=(style.WIDTH, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
    times = np.geomspace(2e-8, LAST, 500)
    for number, line in enumerate(lines["timoshenko"]):
        colour = style.PALETTE[number % len(style.PALETTE)]
        left.loglog(line.times * 1e6, line.force, color=colour, lw=1.1, label=f"{line.modes} modes")
    left.loglog(times * 1e6, waves(times), color=style.INK, lw=2.0, label="continuous, Timoshenko", zorder=5)
    left.loglog(times * 1e6, endless(times), color=style.MUTED, lw=1.4, ls="--", label="infinite, Euler-Bernoulli")
    left.set(xlabel="time since the touch  [µs]", ylabel="mean force / (2 √(kGA ρA) v0)", xlim=(0.02, LAST * 1e6))
    left.set_ylim(0.1, 30.0)
    left.legend(frameon=False, fontsize=7.5)
    left.set_title("Mean force since the touch")
    for theory, name, colour in (
        ("timoshenko", "Timoshenko", style.PALETTE[0]),
        ("euler_bernoulli", "Euler-Bernoulli", style.PALETTE[1]),
    ):
        shown = lines[theory]
        right.loglog([line.modes for line in shown], [line.first for line in shown], "o-", color=colour, ms=4)
        last = shown[-1]
        right.annotate(
            name, (last.modes, last.first), xytext=(-4, 7), textcoords="offset points", ha="right", color=colour
        )
    right.axhline(1.0, color=style.INK, lw=1.0)
    right.set(xlabel="modes", ylabel="mean force / (2 √(kGA ρA) v0)")
    for axis in (left.xaxis, left.yaxis, right.xaxis, right.yaxis):
        style.log_axis(axis)
    right.set_xticks(COUNTS, [str(count) for count in COUNTS])
    right.set_ylim(0.2, 30.0)
    right.set_title("Over the first period of the highest mode")
    return figure


def table(lines: dict[str, list[Line]]) -> str:
    """Return the table of the page, in Markdown."""
    rows = [
        "| modes | period of the highest | force, modes | continuous "
        "| Euler-Bernoulli: period | force, modes | infinite |",
        "|---|---|---|---|---|---|---|",
    ]
    for shear, plain in zip(lines["timoshenko"], lines["euler_bernoulli"], strict=True):
        known = float(waves(np.array([0.5, 1.0]) * shear.period)[-1])
        law = float(endless(np.array([plain.period]))[0])
        rows.append(
            f"| {shear.modes} | {shear.period * 1e6:.3g} µs | {shear.first:.2f} | {known:.2f} "
            f"| {plain.period * 1e6:.3g} µs | {plain.first:.2f} | {law:.2f} |"
        )
    return "\n".join(rows)


STUDY = Study(
    {"beams-first-force.md": filled({"first force": lambda: table(measured())})},
    {"figures/beams_first_force.png": lambda: draw(measured())},
)
