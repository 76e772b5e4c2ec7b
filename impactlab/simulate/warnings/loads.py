"""Warnings of end forces with pulses that are shorter than a step."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from impactlab.history.base import Warned
from impactlab.scene.bodies.loads import SampledLoad
from impactlab.scene.problem import Scene

MIN_PULSE = 0.1  # of the impulse of the largest pulse of a force: smaller ones are its ripple


def warnings(scene: Scene, dt: float) -> Iterator[Warned]:
    """Yield a warning for each end force with a pulse within a step.

    The step is ``dt`` [s].
    """
    for name, body in scene.elastic.items():
        for x, load in body.loads:
            shortest = shortest_pulse(load.sampled(scene.duration), scene.duration)
            if shortest < dt:
                yield Warned(
                    "short_load",
                    f"'{name}' at {x:.6g} m: a pulse of the end force lasts about {shortest:.3g} s, and a step "
                    f"{dt:.3g} s: the motion has at most its impulse, not its shape. Give a shorter step (more "
                    "elements or modes), or model continuous, which is exact for linear contacts",
                )


def shortest_pulse(load: SampledLoad, duration: float) -> float:
    """Return the duration of a force's shortest pulse within a run [s].

    It is the impulse of the pulse over its largest force. Pulses are divided by changes of sign; inf where there is no
    force.
    """
    inside = load.times[(load.times > 0.0) & (load.times < duration)]
    times = np.concatenate(([0.0], inside, [duration]))
    forces = np.abs(load.at(times))
    signs = np.sign(load.at(0.5 * (times[:-1] + times[1:])))
    pieces = 0.5 * (forces[1:] + forces[:-1]) * np.diff(times)
    starts = np.flatnonzero(np.diff(signs, prepend=np.nan) != 0.0)
    impulses = np.add.reduceat(pieces, starts)
    peaks = np.maximum.reduceat(np.maximum(forces[1:], forces[:-1]), starts)
    large = (impulses > MIN_PULSE * impulses.max()) & (peaks > 0.0)
    return float((impulses[large] / peaks[large]).min(initial=np.inf))
