"""The warning of a contact whose faces never met."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from impactlab.history.base import AbstractHistory, Warned
from impactlab.history.frame import touched_in
from impactlab.types import Array

GAPS = 2000  # instants at which the gap of an exact history is read
NOISE_TOL = 1e-6  # of the largest change of a gap: overlaps of contacts below the noise floor are smaller by far
MIN_OPENING = 1e-12  # m, by which a gap grows that is not rounding of positions of about a metre


def no_contact(contact: str, initial_gap: float, gaps: Array, travel: float) -> Warned:
    """Return the warning of a contact whose faces never met.

    Parameters
    ----------
    contact : str
        Its name.
    initial_gap : float
        Gap at t = 0 [m].
    gaps : array
        Gaps of the run in order of time [m].
    travel : float
        Largest change of a gap in the run [m].
    """
    smallest = float(gaps.min())
    if smallest >= min(0.0, initial_gap):
        text = f"the faces never met; the smallest gap was {smallest:.6g} m"
        if smallest >= gaps[0] - MIN_OPENING and gaps[-1] > gaps[0] + MIN_OPENING:
            text += (
                ", at the start: the bodies move apart. The first body of `between` is on the left of "
                "the second (for beams: below it). If they should meet, swap the two, or change the sign "
                "of a velocity or of gravity"
            )
        elif smallest == initial_gap == 0.0:
            text = "the faces touch at the start, but no force reached them within the run"
    elif -smallest > NOISE_TOL * travel:
        text = f"the faces overlap by {-smallest:.2g} m at the end of the run: they meet within its last step"
    else:
        text = f"the faces overlapped by {-smallest:.2g} m at most, too little for a contact"
    return Warned("no_contact", f"{contact}: {text}", contact)


def never_closed(history: AbstractHistory) -> Iterator[Warned]:
    """Yield a warning for each contact that was never closed in an exact history."""
    touched = touched_in(history)
    for contact in history.scene.contacts:
        if contact.name not in touched:
            gaps = history.evaluate(np.linspace(0.0, history.duration, GAPS), f"gap:{contact.name}")
            yield no_contact(contact.name, contact.gap, gaps, math.inf)
