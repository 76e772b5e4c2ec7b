"""The leading wave of a run: first peak of each contact force.

Its instant is found between the records.

A wave that comes back from the end of a row may be larger than the one before: the largest force of a run says nothing
about the leading wave. The force of each contact is followed from the first time it has risen to a third of the peak
at the contact before, and the peak is the largest force until it has fallen by a twentieth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from impactlab.errors import ImpactlabError
from impactlab.history import AbstractHistory
from impactlab.numerics.interpolation import between
from impactlab.prefixes import prefixed, prefixed_range
from impactlab.printing import counted
from impactlab.simulate.channels import AbstractRecordedHistory, Channel, Smooth
from impactlab.types import Array

SHARE = 1.0 / 3.0  # of the peak at the contact before, or of the largest force if that is less: where a pulse begins
ROW = "Give a list of names of contacts, in the order in which the wave passes them."
BY_STEPS = "Run the case with an integrator and a step, such as solve: {integrator: {kind: central_difference}, ...}."
RIPPLE = 0.05  # of the largest force so far: a fall by less does not end a pulse


@dataclass(frozen=True, repr=False)
class LeadingWave:
    """Largest force of each contact of a row in the leading wave, with its time."""

    contacts: tuple[str, ...]
    times: Array  # (contacts,) s
    forces: Array  # (contacts,) N

    def __repr__(self) -> str:
        count = len(self.contacts)
        if not count:
            return "<LeadingWave along no contact>"
        return (
            f"<LeadingWave along {counted(count, 'contact')}, "
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
        """Return C = speed sqrt(m)/(k^(1/3) F^(1/6)) over stretches of contacts in a row.

        Shape (contacts - over,).

        Parameters
        ----------
        stiffness : float
            k [N/m^1.5] of F = k d^1.5.
        mass : float
            Of each bead [kg].
        over : int
            Contacts of a stretch; F is the mean of its largest forces.

        Raises
        ------
        ImpactlabError
            If the wave has no such stretch.
        """
        most = self.times.size - 1
        if not 1 <= over <= most:
            allowed = f"a whole number from 1 to {most}" if most > 0 else "a wave at two contacts or more"
            raise ImpactlabError(
                f"over is {over}. Allowed: {allowed}", remedy="Give a shorter stretch, or a wave at more contacts."
            )
        speeds = over / (self.times[over:] - self.times[:-over])
        sums = np.concatenate(([0.0], np.cumsum(self.forces)))
        means = (sums[over + 1 :] - sums[: -over - 1]) / (over + 1)
        return np.asarray(speeds * math.sqrt(mass) / (stiffness ** (1.0 / 3.0) * means ** (1.0 / 6.0)))


def leading_wave(
    history: AbstractHistory, contacts: Sequence[str] | None = None, until: float = math.inf
) -> LeadingWave:
    """Return the largest force of each contact in the leading wave, and its time.

    Both come from the parabola through three records or, of beads with records several steps apart, from the cubic
    between them. Waves that follow, such as one that comes back from a wall, do
    not count, even if they are larger.

    Parameters
    ----------
    history : AbstractHistory
        Of a run by steps.
    contacts : sequence of str, optional
        Names of contacts in a row, in the order in which the wave passes them; all of the scene, in the order of the
        case, if not given.
    until : float, optional
        Time [s] before which the force is looked at, such as that of a reflection.

    Raises
    ------
    ImpactlabError
        If the run has no records, the force of a contact has no largest value within it, or the wave does not pass the
        contacts one after the other.
    """
    if not isinstance(history, AbstractRecordedHistory):
        raise ImpactlabError("the leading wave is read from the records of a run by steps", remedy=BY_STEPS)
    names = tuple(contact.name for contact in history.scene.contacts) if contacts is None else tuple(contacts)
    if isinstance(contacts, str):
        raise ImpactlabError(f"{contacts[:60]!r} is one contact, and a wave passes several", remedy=ROW)
    found, before = np.zeros((len(names), 2)), math.inf
    for number, name in enumerate(names):
        *found[number], before = _peak(history, name, until, before)
    times = found[:, 0]
    if np.any(np.diff(times) <= 0.0):
        first = int(np.argmax(np.diff(times) <= 0.0))
        arrived, then = (f"'{names[number]}' at {times[number]:.6g} s" for number in (first, first + 1))
        apart = float(np.median(np.diff(history.recorded[f"force:{names[first]}"].times)))
        too_few = bool(times[first] - times[first + 1] < apart)
        raise ImpactlabError(
            f"the wave does not pass the contacts one after the other: it is at {arrived} and at {then}"
            + f", and records are {prefixed(apart, 's')} apart" * too_few,
            remedy="Give so many solve.records that there are one or two for each contact that the wave passes, or "
            "give the contacts in the order in which it passes them."
            if too_few
            else "Give the contacts in the order in which the wave passes them, without those at an end where it is "
            "reflected, and with `until` the time at which a wave comes back.",
        )
    return LeadingWave(names, times, found[:, 1])


def _peak(history: AbstractRecordedHistory, contact: str, until: float, before: float) -> tuple[float, float, float]:
    """Return instant [s] and force [N] of the first pulse, and its rise [N].

    The rise is that above the first record of the contact. ``before`` is the rise at the contact before it, infinite if
    there is none.
    """
    channel = history.recorded.get(f"force:{contact}")
    if channel is None:
        raise ImpactlabError(f"there is no contact '{contact}' in this run", remedy="Name contacts of its scene.")
    count = int(np.searchsorted(channel.times, until, side="right"))
    forces = channel.values[:count]
    at = _first_peak(forces - forces[0], before) if count else 0
    if not 0 < at < count - 1 or not forces[at] > 0.0:
        raise ImpactlabError(
            f"the force of '{contact}' has no largest value within the run",
            remedy="Give a longer duration, or leave out contacts that the wave does not reach.",
        )
    time, force = _at_top(channel, at)
    # Of a run with more steps than records the latter are means over several: the period of contact has the peak.
    kept = _kept(history, contact, channel, float(channel.times[at])) if until == math.inf else 0.0
    force = kept if kept and channel.smooth is not None else max(force, kept)
    return time, force, force - float(forces[0])


def _at_top(channel: Channel, at: int) -> tuple[float, float]:
    """Return instant [s] and force [N] of the peak beside record ``at``."""
    if channel.smooth is not None:  # records several steps apart: the peak of the force that lies between them
        times, values, rates, power = channel.smooth
        near = slice(max(at - 2, 0), at + 2)
        pulse = Smooth(times[near], values[near], rates[near], power)
        instants = pulse.turning_times()
        forces = pulse.at(between(instants, pulse.times))
        highest = int(np.argmax(forces))
        return float(instants[highest]), float(forces[highest])
    left, top, right = (float(force) for force in channel.values[at - 1 : at + 2])
    slope, bend = 0.5 * (right - left), right - 2.0 * top + left
    shift = -slope / bend if bend < 0.0 else 0.0
    middles = channel.times if channel.middles is None else channel.middles  # forces are means
    step = float(middles[at + 1] - middles[at - 1]) / 2.0
    return float(middles[at]) + shift * step, top + 0.5 * slope * shift


def _first_peak(rise: Array, before: float) -> int:
    """Return the index of the record with the largest first pulse; 0 without a pulse."""
    largest = float(rise.max())
    if not largest > 0.0:
        return 0
    start = int(np.argmax(rise >= SHARE * min(before, largest)))
    pulse = rise[start:]
    fallen = pulse < (1.0 - RIPPLE) * np.maximum.accumulate(pulse)
    return start + int(np.argmax(pulse[: int(np.argmax(fallen)) if fallen.any() else None]))


def _kept(history: AbstractRecordedHistory, contact: str, channel: Channel, time: float) -> float:
    """Return the largest force [N] of the period of contact around a peak.

    It is 0 where that period has another, larger one.
    """
    for span in history.spans(contact):
        end = span.until(history.duration)
        if span.start <= time <= end:
            within = (channel.times >= span.start) & (channel.times <= end)
            is_largest = channel.times[within][int(np.argmax(channel.values[within]))] == time
            return (span.peak_force or 0.0) if is_largest else 0.0
    return 0.0
