"""Dispersive waves at a contact: tables and figures of dispersive-waves.md.

They are by both laws and in closed form.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.dispersive_identification import DispersiveIdentification
from impactlab.contact.modal_messengers import ModalMessengers
from impactlab.contact.velocity_complementarity import VelocityComplementarity
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.errors import PairingError, StepError
from impactlab.history import AbstractHistory
from impactlab.integrators.bathe import Bathe
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.newmark import Newmark
from impactlab.metrics import midpoints, relative_l2
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.messengers import miss
from impactlab.models.modal import Modal
from impactlab.report.figures.style import INK, MUTED, PALETTE, Margins, grid, log_axis
from impactlab.scene import ElasticBody
from impactlab.scene.method import StepRule
from impactlab.types import Array
from studies import bounds as of_rods
from studies.beams.scenes import RESISTANCE, beam, love, love_rod, rod, sheared, slender, struck
from studies.pages import Study, filled, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ANY = 1e9  # share of a miss: nothing is refused
GENERAL, BARE = DispersiveIdentification(), DispersiveIdentification(residual=False)
PHASE, GROUP = ModalMessengers(accept=ANY), ModalMessengers(speed="group", accept=ANY)
SLENDER, SHEARED = "euler_bernoulli", "timoshenko"
LATERAL = 0.009  # m, nu r of the Love rod: 0.3 times 30 mm


class Place(NamedTuple):
    """A face on a body in modes."""

    name: str
    body: ElasticBody
    model: Any
    x: float


PLACES = (
    Place("uniform rod, end", rod(), Modal(None, 20), 0.0),
    Place("Love rod, end", rod(), love_rod(20, LATERAL), 0.0),
    Place("pinned slender beam, middle", beam(0.3, "pinned", "pinned"), Modal(None, 20), 0.15),
    Place("pinned Timoshenko beam, middle", beam(0.3, "pinned", "pinned", SHEARED), Modal(None, 20), 0.15),
    Place("the same, 80 modes", beam(0.3, "pinned", "pinned", SHEARED), Modal(None, 80), 0.15),
    Place("slender cantilever, middle", beam(0.3, "clamped", "free"), Modal(None, 20), 0.15),
    Place("slender cantilever, tip", beam(0.3, "clamped", "free"), Modal(None, 20), 0.3),
    Place("Timoshenko cantilever, tip", beam(0.3, "clamped", "free", SHEARED), Modal(None, 20), 0.3),
    Place("pinned slender beam, middle, 100 elements", beam(0.3, "pinned", "pinned"), Modal(100, 20), 0.15),
)


def missed(place: Place, points: float, speed: Literal["phase", "group"]) -> float:
    """Return the error of the messengers of a body.

    It is against the motion of the face by its modes in a step.
    """
    build = place.model.build_beam if place.body.kind == "beam" else place.model.build
    body = build(place.body, 0.0)
    frequencies = np.sqrt(body.operators().stiffness[0])
    dt = 2.0 * np.pi / float(frequencies.max()) / points
    try:
        row = body.arriving(place.x, dt, speed)
    except PairingError:
        return float("nan")
    return miss(row, body.row(place.x, "displacement"), frequencies, dt)


def share(value: float) -> str:
    """Return a share as percent, rounding as such."""
    if not np.isfinite(value):
        return "beyond the body"
    return "rounding" if value < 1e-11 else f"{100.0 * value:.2g} %" if value < 0.995 else f"{100.0 * value:.0f} %"


def messengers() -> str:
    """Return the table of errors of messengers."""
    rows = [
        [
            place.name,
            *(share(missed(place, points, speed)) for speed in ("phase", "group") for points in (4.0, 10.0, 40.0)),
        ]  # type: ignore[arg-type]
        for place in PLACES
    ]
    return table(["face", *(f"{speed}, {n} points" for speed in ("phase", "group") for n in (4, 10, 40))], rows)


class Problem(NamedTuple):
    """A mass on a body, and its velocity in closed form."""

    name: str
    body: ElasticBody
    model: Callable[[int], Any]
    mass: float
    x: float
    end: float  # s
    exact: Callable[[Array], Array]
    modes: tuple[int, ...]


def long_beam(theory: str, tip: bool) -> Problem:
    """Return a mass on a beam that is effectively infinite.

    No wave returns which matters before the mass has given 57 % of its velocity.
    """
    held = beam(2.0, "clamped" if tip else "pinned", "free" if tip else "pinned", theory)
    mass, part = 0.05 * held.mass, 0.25 if tip else 1.0
    name = f"{'slender' if theory == SLENDER else 'Timoshenko'} beam, {'tip' if tip else 'inner point'}"
    return Problem(
        name, held, lambda n: Modal(None, n), mass, 2.0 if tip else 1.0, (mass / (part * RESISTANCE)) ** 2,
        lambda t: slender(mass, part, t) if theory == SLENDER else sheared(mass, tip, t), (25, 100, 200),
    )  # fmt: skip


def problems() -> tuple[Problem, ...]:
    """Return the problems with their closed forms."""
    body, trip = rod(), rod().round_trip

    def bar(t: Array) -> Array:
        alone = struck(body, Continuous(), WaveIdentification(), body.mass, trip, 0.0)
        return np.asarray(alone.evaluate(t, "velocity:hammer"))

    return (
        Problem("uniform rod", body, lambda n: Modal(None, n), body.mass, 0.0, trip, bar, (10, 40, 100)),
        Problem(
            "Love rod", body, lambda n: love_rod(n, LATERAL), body.mass, 0.0, trip,
            lambda t: love(body.mass, LATERAL, t), (10, 40, 100),
        ),
        long_beam(SLENDER, False), long_beam(SLENDER, True), long_beam(SHEARED, False), long_beam(SHEARED, True),
    )  # fmt: skip


def gain(history: AbstractHistory) -> str:
    """Return the larger of gain and loss of a run, with its sign."""
    book = history.energy
    worst = book.largest_gain if book.largest_gain >= book.largest_loss else -book.largest_loss
    return f"{100.0 * worst:+.2g} %" if abs(worst) > 1e-9 else "0"


def laws_compared() -> str:
    """Return the table of both laws against closed forms."""
    rows = []
    for problem in problems():
        t = problem.end * (np.arange(60) + 0.5) / 60.0
        exact = problem.exact(t)
        # A Love rod has no highest wave speed but a highest frequency: the step follows the bar's.
        for modes in problem.modes:
            dt = (
                StepRule(dt=problem.end / (40.0 * modes))
                if problem.name == "Love rod"
                else StepRule(points_per_period=10.0)
            )
            cells = []
            for law in (GENERAL, BARE, PHASE):
                seen = struck(problem.body, problem.model(modes), law, problem.mass, problem.end, problem.x, step=dt)
                error = float(np.sqrt(np.mean((seen.evaluate(t, "velocity:hammer") - exact) ** 2)))
                cells += [f"{error:.1e}", gain(seen)]
            rows.append([problem.name, f"{modes}", *cells])
    head = ["scene", "modes", "general", "energy", "general, no residual", "energy", "sketch", "energy"]
    return table(head, rows)


def steps_of(law: AbstractContactLaw, points: Sequence[float]) -> list[AbstractHistory]:
    """Return runs of the slender tip with 25 modes at several steps."""
    problem = long_beam(SLENDER, True)
    return [
        struck(problem.body, Modal(None, 25), law, problem.mass, problem.end, 2.0, step=StepRule(points_per_period=n))
        for n in points
    ]


POINTS = (10.0, 40.0, 160.0, 640.0)


@cache
def orders() -> tuple[str, dict[str, tuple[list[float], list[float]]]]:
    """Return the table of steps at a tip, and the errors and gains to draw."""
    problem = long_beam(SLENDER, True)
    t = midpoints(problem.end, 400)
    limit = steps_of(BARE, (5120.0,))[0].evaluate(t, "position:hammer")
    rows, lines = [], {}
    for name, law in (("general, no residual", BARE), ("sketch, phase speed", PHASE), ("sketch, group speed", GROUP)):
        runs = steps_of(law, POINTS)
        errors = [relative_l2(run.evaluate(t, "position:hammer"), limit) or 0.0 for run in runs]
        gains = [run.energy.largest_gain for run in runs]
        lines[name] = (errors, gains)
        rows.append([name, *(f"{e:.1e}, {100.0 * g:.2g} %" for e, g in zip(errors, gains, strict=True))])
    return table(["law", *(f"{n:.0f} points: error, gain" for n in POINTS)], rows), lines


def impedance() -> str:
    """Return the table of the balance by 1/Z on the uniform rod.

    It is over three round trips.
    """
    body = rod()
    end, rows = 3.0 * body.round_trip, []
    exact = struck(body, Continuous(), WaveIdentification(), body.mass, end, 0.0)
    t = midpoints(end)
    for modes in (10, 40, 100):
        cells = []
        for law in (GENERAL, BARE, PHASE, ModalMessengers(balance="impedance", accept=ANY), WaveIdentification()):
            seen = struck(body, Modal(None, modes), law, body.mass, end, 0.0)
            error = relative_l2(seen.evaluate(t, "position:hammer"), exact.evaluate(t, "position:hammer")) or 0.0
            cells.append(f"{100.0 * error:.2g} %")
        rows.append([f"{modes}", *cells])
    head = [
        "modes",
        "general",
        "general, no residual",
        "sketch",
        "sketch, balance by 1/Z",
        "wave_identification, residual",
    ]
    return table(head, rows)


def rebound() -> str:
    """Return the results of a whole collision by several descriptions."""
    rows = []
    for name, held, x, end in (
        ("slender cantilever, tip", beam(0.3, "clamped", "free"), 0.3, 0.0128),
        ("pinned slender beam, middle", beam(0.3, "pinned", "pinned"), 0.15, 0.0046),
    ):
        methods: tuple[tuple[str, Any, AbstractContactLaw, dict[str, Any]], ...] = (
            ("velocity_complementarity, 100 elements, midpoint", FiniteElement(100), VelocityComplementarity(),
             {"integrator": Midpoint(), "step": StepRule(dt=4e-7)}),
            ("general, 10 modes", Modal(None, 10), GENERAL, {}),
            ("general, 40 modes", Modal(None, 40), GENERAL, {}),
            ("general, 80 modes", Modal(None, 80), GENERAL, {}),
            ("sketch, 10 modes", Modal(None, 10), PHASE, {}),
            ("sketch, 40 modes", Modal(None, 40), PHASE, {}),
            ("sketch by group speed, 40 modes", Modal(None, 40), GROUP, {}),
        )  # fmt: skip
        for method, model, law, more in methods:
            try:
                seen = struck(held, model, law, 0.5 * held.mass, end, x, **more)
            except StepError as error:
                rows.append([name, method, "fails", "-", str(error).splitlines()[0][:60]])
                continue
            left = float(seen.evaluate(end, "velocity:hammer"))
            rows.append([name, method, f"{left:.3f} v0", f"{len(seen.contacts)}", gain(seen)])
    return table(["scene", "method", "velocity of the mass at the end", "contacts", "energy"], rows)


BOUND_MODELS = {
    "one element": FiniteElement(1),
    "40 elements": FiniteElement(40),
    "one mode": Modal(None, 1),
    "10 modes": Modal(None, 10),
}


def bounds() -> str:
    """Return the table of the general form's gains and losses.

    They are the largest on the rod, over mass ratios, far ends and steps.
    """
    rows = []
    for law, kind in ((BARE, "no"), (GENERAL, "yes")):
        for name, model in BOUND_MODELS.items():
            cells = []
            for scheme in (Newmark(), ExactModal(), Bathe()):
                worst = of_rods.worst(
                    of_rods.struck(model, law, scheme, StepRule(points_per_period=points), alpha, far)
                    for points in (3.2, 4.0, 10.0)
                    for alpha in (1e-3, 0.1, 1.0, 100.0)
                    for far in ("clamped", "free")
                )
                cells += ["refused", "-"] if worst is None else [share(worst.above), share(worst.loss)]
            rows.append([name, kind, *cells])
    return table(
        [
            "model",
            "residual",
            *(f"{name}: {what}" for name in ("newmark", "exact_modal", "bathe") for what in ("gain", "loss")),
        ],
        rows,
    )


def picture() -> Figure:
    """Return the figure of errors of single messengers.

    It also shows the effect of the step at a tip.
    """
    figure, [[left, right]] = grid(1, 2, 2.7, Margins(across=0.8))
    chosen = (  # place, speed, colour, height of the name at the right, clear of all lines
        (2, "phase", 0, 0.1),
        (7, "phase", 2, 0.66),
        (6, "phase", 1, 0.42),
        (2, "group", 3, 1.1),
        (6, "group", 4, 1.85),
    )
    for number, speed, colour, height in chosen:
        points = np.geomspace(3.0, 100.0, 12)
        place = PLACES[number]
        left.semilogx(points, [missed(place, float(n), speed) for n in points], color=PALETTE[colour])  # type: ignore[arg-type]
        left.text(98.0, height, f"{place.name}, {speed}", color=PALETTE[colour], fontsize=7.5, ha="right", va="center")
    left.set_ylim(-0.05, 2.3)
    left.set_xlabel("points in the shortest period")
    left.set_ylabel("error, over the motion of the modes in a step")
    left.set_title("Error of the messengers")
    for number, (name, (errors, gains)) in enumerate(orders()[1].items()):
        right.loglog(POINTS, errors, color=PALETTE[number], marker="o", markersize=3.5)
        right.loglog(POINTS, gains, color=PALETTE[number], linestyle=(0, (3, 1.5)), linewidth=1.0)
        right.text(11.0, 10.0 ** (-6.1 - 0.42 * number), name, color=PALETTE[number], fontsize=7.5)
    right.text(
        11.0, 10.0**-7.5, "solid: error of the mass's position; dashed: energy gained", color=MUTED, fontsize=7.5
    )
    right.set_ylim(1e-8, 1.0)
    right.set_xlabel("points in the shortest period")
    right.set_title("Tip of a slender beam, 25 modes")
    for axis in (left.xaxis, right.xaxis, right.yaxis):
        log_axis(axis)
    return figure


def slowing() -> Figure:
    """Return the figure of the mass's velocity on long beams."""
    figure, [panels] = grid(1, 2, 2.7, Margins(across=0.4), share=True)
    for axes, theory, title in zip(panels, (SLENDER, SHEARED), ("Slender beam", "Timoshenko beam"), strict=True):
        problem = long_beam(theory, False)
        t = np.linspace(0.004, 1.0, 120)
        for number, modes in enumerate((50, 100, 200)):
            seen = struck(problem.body, Modal(None, modes), GENERAL, problem.mass, problem.end, problem.x)
            times = np.linspace(0.0, 1.0, 600)
            axes.plot(
                times, seen.evaluate(times * problem.end, "velocity:hammer"), color=PALETTE[number], linewidth=1.1
            )
            axes.text(
                0.97,
                0.93 - 0.08 * number,
                f"{modes} modes",
                color=PALETTE[number],
                ha="right",
                transform=axes.transAxes,
            )
        axes.plot(t, problem.exact(t * problem.end), color=INK, linewidth=0.9)
        axes.text(0.97, 0.69, "infinite beam, exact", color=INK, ha="right", transform=axes.transAxes)
        axes.set_xlabel("time  κ² t")
        axes.set_title(title)
    panels[0].set_ylabel("velocity of the mass  v / v0")
    return figure


PARTS = {
    "messengers": messengers,
    "orders": lambda: orders()[0],
    "laws": laws_compared,
    "impedance": impedance,
    "rebound": rebound,
    "bounds": bounds,
}
STUDY = Study(
    {"dispersive-waves.md": filled(PARTS)},
    {"figures/dispersive_messengers": picture, "figures/dispersive_slowing": slowing},
)
