"""The bouncing bar over a hundred bounces under many methods."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from impactlab.contact.paoli_schatzman import PaoliSchatzman
from impactlab.history import AbstractHistory
from impactlab.types import Array
from studies.comparison.periodic import ratio
from studies.comparison.schemes import EXACT, SCHEMES, TRAP, Run, Scheme, ran, scene_of, stopped
from studies.pages import table

SIZES = (100, 200)
BOUNCES = 100
FIRST, EVERY, LAST = 1.0, 8.0 / 3.0, 2.0 / 3.0  # s: first touch, from touch to touch, length of a contact
END = FIRST + EVERY * (BOUNCES - 1) + LAST + 1.0  # s, at the top after the hundredth bounce
IN_PLAY = 500.0  # J, weight times the height of the fall
APART = 0.5 * LAST  # s; touches nearer than this are one bounce
RIGHT = 0.1 * LAST  # s; a bounce begins in time if it begins this near


class Count(NamedTuple):
    """Results of a run of a hundred bounces."""

    kept: float  # mechanical energy at the end over that at the start
    largest: float
    found: int  # bounces until the end
    in_time: int  # of them, until the first that is not
    hundredth: float | None  # s, touch of the hundredth


def bounces(history: AbstractHistory) -> Array:
    """Return when bounces begin [s]: contacts less than half a contact apart are one."""
    spans = history.contacts
    ends = [-np.inf, *(span.start if span.end is None else span.end for span in spans)]
    return np.array([span.start for span, end in zip(spans, ends, strict=False) if span.start - end > APART])


def mechanical(history: AbstractHistory) -> Array:
    """Return kinetic, strain and potential energy over the reference energy, when energies are kept, (n,)."""
    book = history.energy
    return np.asarray(1.0 + (book.total - book.total[0] - book.work) / IN_PLAY)


def count(history: AbstractHistory) -> Count:
    """Return the figures of a run."""
    begun, energy = bounces(history), mechanical(history)
    late = np.abs(begun[:BOUNCES] - (FIRST + EVERY * np.arange(min(begun.size, BOUNCES)))) > RIGHT
    in_time = int(np.argmax(late)) if late.any() else int(late.size)
    hundredth = float(begun[BOUNCES - 1]) if begun.size >= BOUNCES else None
    return Count(float(energy[-1]), float(energy.max()), int(begun.size), in_time, hundredth)


def bounced(scheme: Scheme, n: int) -> Run:
    """Return the run of a method over the time of a hundred exact bounces."""
    return ran(scene_of("bouncing_bar", scheme, n, duration=END))


# Explicit Paoli-Schatzman without restitution is addition_deletion; with e = 1 the periodic bar shows enough.
CHOSEN = [scheme for scheme in SCHEMES if scheme is TRAP or not isinstance(scheme.law, PaoliSchatzman)]


def hundredth(found: Count, exact: bool) -> str:
    """Return when the hundredth bounce begins, of the exact solution by its error."""
    if found.hundredth is None:
        return "-"
    error = abs(found.hundredth - (FIRST + EVERY * (BOUNCES - 1)))
    return f"265 ({error:.0e} off)" if exact and error > 0.0 else f"{found.hundredth:.2f}"


def bouncing() -> str:
    """Return the table of methods on the bouncing bar."""
    lines, reasons = [], []
    for scheme in CHOSEN:
        runs = [bounced(scheme, n) for n in (SIZES if scheme.integrator is not None else SIZES[:1])]
        counts = [None if run.history is None or run.history.duration < END else count(run.history) for run in runs]
        reason = next((run.reason for run in runs if run.reason), "")
        if reason:
            reasons.append((scheme.name, reason))
        cells = [
            " / ".join("-" if each is None else show(each) for each in counts)
            for show in (
                lambda each: ratio(each.kept),
                lambda each: ratio(each.largest),
                lambda each: str(each.found),
                lambda each: str(each.in_time),
                lambda each: hundredth(each, scheme is EXACT),  # noqa: B023 - called at once
            )
        ]
        lines.append(f"{scheme.name}{'*' if reason else ''} | {scheme.rule} | " + " | ".join(cells))
    header = "method | c dt/h | energy at the end | largest energy | bounces found | in time | 100th begins [s]"
    return table(header, lines) + stopped(reasons)
