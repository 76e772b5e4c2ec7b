"""Warnings of probes of rods whose largest internal force lasts too short a time for elements or modes.

Behind a front, and in a pulse a few elements long, internal forces oscillate at the highest frequencies of a mesh. They
do so also where the contact force is right.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterator

import numpy as np

from impactlab.history.base import Warned
from impactlab.printing import counted
from impactlab.scene.bodies import WaveBody
from impactlab.simulate.channels import AbstractRecordedHistory, Channel
from impactlab.simulate.warnings.peaks import MIN_RECORDS, beside, keeps_waves
from impactlab.simulate.warnings.resolvability import FINER
from impactlab.types import INTERNAL_FORCES

RESOLUTIONS = 5.0  # half shortest periods of the body, or steps: what lasts less may be an oscillation of the mesh
# Largest value over the largest mean in this time, beyond the ratio of a force that decays as exp(-Z t/m). Of 22 probes
# above it in random runs without another warning of forces, the extremes of 20 were wrong by a tenth or more.
RATIO_WARN = 1.1
SAID = frozenset(
    {
        "approximate_modes",
        "coarse_contact",
        "energy_gain",
        "energy_loss",
        "first_force",
        "probe_near_load",
        "short_load",
    }
)


def warnings(history: AbstractRecordedHistory, codes: Container[str]) -> Iterator[Warned]:
    """Yield a warning for each rod or shaft with probes that oscillate.

    None where one of the ``codes`` found already states that forces, or probes, are not resolved.
    """
    if any(code in codes for code in SAID):
        return
    for body in history.scene.wave_bodies:
        time = _resolved(history, body)
        least = RATIO_WARN * _decay(history, body, time)
        found: dict[str, tuple[float, float, float]] = {}
        for probe in history.scene.probes if time > 0.0 else ():
            if probe.body == body.name and body.reading(probe.quantity)[0] in (*INTERNAL_FORCES, "strain"):
                largest, mean = _largest(history.recorded[probe.channel], time, least)
                if largest > least * mean > 0.0:
                    found[probe.channel] = largest / mean, largest, mean
        if found:
            worst = max(found, key=lambda channel: found[channel])
            ratio, largest, mean = found[worst]
            more = f", as does that of {counted(len(found) - 1, 'more probe')} of it" if len(found) > 1 else ""
            yield Warned(
                "probe_oscillates",
                f"{worst}: the largest value, {largest:.4g}, is {ratio:.3g} times the largest mean over {time:.3g} s, "
                f"five time resolutions of '{body.name}' under this method. Elements and modes oscillate as fast "
                f"behind a front or in a short pulse, so that it follows the mesh{more}. Compare it with this mean, "
                f"{mean:.4g}; give {FINER}. Behind a sharp front oscillations remain: there use model continuous, or a "
                "lumped mesh at courant 1",
            )


def _resolved(history: AbstractRecordedHistory, body: WaveBody) -> float:
    """Return five time resolutions of a body [s].

    It is 0 where waves do not disperse: on a mesh at its stability limit, and without elements or modes.
    """
    highest, dt = history.built[body.name].system.highest_frequency, history.dt or 0.0
    if highest <= 0.0 or keeps_waves(history, body):
        return 0.0
    return RESOLUTIONS * max(dt, math.pi / highest)


def _largest(channel: Channel, time: float, least: float) -> tuple[float, float]:
    """Return the largest size of a signal and that of its mean over a time.

    Zeros where records are too far apart, or a mean beside the largest value is above 1/least of it.
    """
    times, values = channel.times, channel.values
    if times.size <= MIN_RECORDS or time < MIN_RECORDS * float(times[-1] - times[0]) / (times.size - 1):
        return 0.0, 0.0
    sized = values if values.max() >= -values.min() else -values
    largest = float(sized.max())
    if any(largest <= least * mean for mean in beside(times, sized, time)):
        return 0.0, 0.0
    integral = np.append(0.0, (0.5 * (values[1:] + values[:-1]) * np.diff(times)).cumsum())
    return largest, float(np.abs(np.interp(times + time, times, integral) - integral).max() / time)


def _decay(history: AbstractRecordedHistory, body: WaveBody, time: float) -> float:
    """Return the ratio of the first force to its mean over a time, of the lightest mass in contact with a body."""
    facts = [history.facts_of(contact) for _, contact in history.scene.met_by(body.name)]
    decays = max((time * each.impedance / each.striker for each in facts if each.impedance < math.inf), default=0.0)
    return decays / -math.expm1(-decays) if decays > 0.0 else 1.0
