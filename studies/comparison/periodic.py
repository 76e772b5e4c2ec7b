"""The periodic bar under many methods.

Also the trap of a hard constraint under Newmark's method.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

from impactlab import metrics
from impactlab.history import AbstractHistory
from impactlab.scene import Scene
from studies.comparison.schemes import EXACT, SCHEMES, TRAP, TRAP_MIDDLE, Run, Scheme, ran, scene_of, stopped
from studies.pages import percent, table

SIZES = (20, 80, 320)
IMPULSE = 0.5  # N s, of each of the four exact contacts
PRESSURE = 0.5  # N, while they last
CONTACTS = 4
REPEATS = 5  # the least time of so many runs is shown
STEPS = (1.0, 0.5)  # c dt/h, of the trap


class Figures(NamedTuple):
    """Results of a run of four periods."""

    end: float  # energy at the end over that at the start
    largest: float  # of the run
    tip: float | None  # relative L2 errors
    pressure: float | None
    away: float | None  # pressure, without 0.05 T around its jumps
    again: int  # contacts beyond the four
    peak: float  # largest force over the exact one
    time: float  # s


@functools.cache
def exact() -> AbstractHistory:
    """Return the exact solution."""
    history = ran(scene_of("periodic_bar", EXACT, 1)).history
    assert history is not None
    return history


def figures(run: Run, scene: Scene) -> Figures | None:
    """Return the figures of a run, None where it has none."""
    history = run.history
    if history is None or history.duration < scene.duration:
        return None
    energy, [name] = history.energy.total, metrics.force_channels(scene)
    # Touches with no more impulse than rounding do not count.
    touches = [span for span in history.contacts if span.impulse > 1e-9 * IMPULSE]
    return Figures(
        float(energy[-1] / energy[0]),
        float(energy.max() / energy[0]),
        metrics.face_displacement(history, exact(), scene),
        metrics.force(history, exact(), scene),
        metrics.force_away_from_jumps(history, exact(), scene),
        max(0, len(touches) - CONTACTS),
        float(history.evaluate(metrics.midpoints(scene.duration, 40_000), name).max()) / PRESSURE,
        history.cost.solve_s,
    )


def measured(scheme: Scheme, n: int, courant: float | None = None, repeats: int = 1) -> tuple[Figures | None, str]:
    """Return the figures of a method, and why it was stopped.

    They have the least time of several runs.
    """
    scene = scene_of("periodic_bar", scheme, n, courant=courant)
    run = ran(scene)
    found = figures(run, scene.scene)
    if found is not None:
        spent = [history.cost.solve_s for history in (ran(scene).history for _ in range(repeats - 1)) if history]
        found = found._replace(time=min([found.time, *spent]))
    return found, run.reason


def ratio(value: float) -> str:
    """Return an energy over another: four digits, 1 where it differs by rounding."""
    return "1" if abs(value - 1.0) < 1e-9 else f"{value:.3f}" if value < 9.9995 else f"{value:.3g}"


def row(scheme: Scheme, sizes: tuple[int, ...] = SIZES) -> tuple[str, float | None, str]:
    """Return cells of a method, its time [s], and why it stopped.

    The cells are without the time, which is that on the finest mesh.
    """
    found = [measured(scheme, n, repeats=REPEATS if n == sizes[-1] else 1) for n in sizes]
    reason = next((reason for _, reason in reversed(found) if reason), "")
    known = [each for each, _ in found]
    if scheme.integrator is None:
        known = known[:1]
    cells = [
        " / ".join("-" if each is None else show(each) for each in known)
        for show in (
            lambda each: ratio(each.end),
            lambda each: ratio(each.largest),
            lambda each: percent(each.tip, ""),
            lambda each: percent(each.pressure, ""),
            lambda each: percent(each.away, ""),
            lambda each: str(each.again),
        )
    ]
    name = f"{scheme.name}{'*' if reason else ''}"
    last = known[-1]
    return " | ".join([scheme.group, name, scheme.rule, *cells]), None if last is None else last.time, reason


HEADER = (
    "kind | method | c dt/h | energy at the end | largest energy | tip [%] | pressure [%] | away from jumps [%]"
    " | re-touches | time"
)


def periodic() -> str:
    """Return the table of methods on the periodic bar."""
    rows = [row(scheme) for scheme in SCHEMES]
    least = min(time for (_, time, _), scheme in zip(rows, SCHEMES, strict=True) if time and scheme.integrator)
    lines = [f"{cells} | {'-' if time is None else f'{time / least:.2g}'}" for cells, time, _ in rows]
    reasons = [(scheme.name, reason) for (_, _, reason), scheme in zip(rows, SCHEMES, strict=True) if reason]
    return table(HEADER, lines) + stopped(reasons)


def trap() -> str:
    """Return the table of the trap: a hard constraint under Newmark's average acceleration."""
    lines = []
    for scheme, form in ((TRAP, "end of the step (textbook)"), (TRAP_MIDDLE, "constant over the step (`newmark`)")):
        for courant in STEPS:
            found = [measured(scheme, n, courant)[0] for n in SIZES]
            shown = [each for each in found if each is not None]
            cells = [
                " / ".join(f"{value:.3g}" for value in values)
                for values in (
                    [each.end for each in shown],
                    [each.largest for each in shown],
                    [each.peak for each in shown],
                )
            ]
            again = " / ".join(str(each.again) for each in shown)
            lines.append(f"{form} | {courant:g} | " + " | ".join(cells) + f" | {again}")
    return table("contact force | c dt/h | energy at the end | largest energy | peak pressure | re-touches", lines)
