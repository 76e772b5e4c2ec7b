"""The leading wave of a run along its contacts: largest force of each and its instant, between the records."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from impactlab.errors import ImpactlabError
from impactlab.history import AbstractHistory
from impactlab.prefixes import prefixed, prefixed_range
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.types import Array


@dataclass(frozen=True, repr=False)
class LeadingWave:
    """Largest force of each contact in a row, and when it acted."""

    contacts: tuple[str, ...]
    times: Array  # (contacts,) s
    forces: Array  # (contacts,) N

    def __repr__(self) -> str:
        count = len(self.contacts)
        if not count:
            return "<LeadingWave along no contact>"
        return (
            f"<LeadingWave along {count} contact{'s' if count > 1 else ''}, "
            f"{prefixed_range(self.times[0], self.times[-1], 's')}: largest forces "
            f"{prefixed(self.forces[0], 'N')} in the first, {prefixed(self.forces[-1], 'N')} in the last>"
        )

    def speed(self, first: int = 0, last: int = -1) -> float:
        """Return the speed from one contact to another [contacts/s].

        Parameters
        ----------
        first, last : int
            Their numbers, from 0, or negative from the end.

        Raises
        ------
        ImpactlabError
            If there is no contact of that number, or the two are one.
        """
        count = len(self.contacts)
        for number in (first, last):
            if not isinstance(number, (int, np.integer)) or not -count <= number < count:
                raise ImpactlabError(
                    f"there is no contact of number {number}. Allowed: whole numbers from {-count} to {count - 1}",
                    remedy="Give numbers of contacts in the row.",
                )
        passed = last % count - first % count
        if passed == 0:
            raise ImpactlabError(
                f"the speed is that from one contact to another, and both are number {first}",
                remedy="Give two contacts of the row.",
            )
        return passed / float(self.times[last] - self.times[first])

    def factors(self, stiffness: float, mass: float, over: int = 10) -> Array:
        """Return C = speed sqrt(m)/(k^(1/3) F^(1/6)) over stretches of contacts in a row, (contacts - over,).

        Parameters
        ----------
        stiffness : float
            k [N/m^1.5] of F = k d^1.5.
        mass : float
            Of each bead [kg].
        over : int
            Contacts of a stretch; F is the mean of its largest forces.
        """
        speeds = over / (self.times[over:] - self.times[:-over])
        sums = np.concatenate(([0.0], np.cumsum(self.forces)))
        means = (sums[over + 1 :] - sums[: -over - 1]) / (over + 1)
        return np.asarray(speeds * math.sqrt(mass) / (stiffness ** (1.0 / 3.0) * means ** (1.0 / 6.0)))


def leading_wave(
    history: AbstractHistory, contacts: Sequence[str] | None = None, until: float = math.inf
) -> LeadingWave:
    """Return the largest force of each contact and when it acted, from the parabola through three records.

    Parameters
    ----------
    history : AbstractHistory
        Of a run by steps.
    contacts : sequence of str, optional
        Names of contacts in a row; all of the scene, in the order of the case, if not given.
    until : float, optional
        Time [s] before which the force is looked at, such as that of a reflection.

    Raises
    ------
    ImpactlabError
        If the run has no records, or the force of a contact has no largest value within it.
    """
    if not isinstance(history, AbstractRecordedHistory):
        raise ImpactlabError("the leading wave is read from the records of a run by steps", remedy="Give such a run.")
    names = tuple(contact.name for contact in history.scene.contacts) if contacts is None else tuple(contacts)
    found = np.array([_largest(history, name, until) for name in names]).reshape(len(names), 2)
    return LeadingWave(names, found[:, 0], found[:, 1])


def _largest(history: AbstractRecordedHistory, contact: str, until: float) -> tuple[float, float]:
    """Return when the force of a contact is largest [s], and that force [N]."""
    channel = history.recorded.get(f"force:{contact}")
    if channel is None:
        raise ImpactlabError(f"there is no contact '{contact}' in this run", remedy="Name contacts of its scene.")
    count = int(np.searchsorted(channel.times, until, side="right"))
    forces = channel.values[:count]
    at = int(np.argmax(forces)) if count else 0
    if not 0 < at < count - 1 or not forces[at] > 0.0:
        raise ImpactlabError(
            f"the force of '{contact}' has no largest value within the run", remedy="Give a longer duration."
        )
    before, top, after = (float(force) for force in forces[at - 1 : at + 2])
    slope, bend = 0.5 * (after - before), after - 2.0 * top + before
    shift = -slope / bend if bend < 0.0 else 0.0
    step = float(channel.times[at + 1] - channel.times[at - 1]) / 2.0
    # Of a run with more steps than records the latter are means over several.
    kept = max((span.peak_force or 0.0 for span in history.spans(contact) if span.start <= until), default=0.0)
    return float(channel.times[at]) + shift * step, max(top + 0.5 * slope * shift, kept if until == math.inf else 0.0)
