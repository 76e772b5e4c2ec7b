"""Warnings of ends: damped bodies with an infinite end, and forces with pulses that are shorter than a step.

The dashpot of an infinite end is the impedance Z of the undamped body. Damped by a times its mass, with a stress
delayed by b, the rod beyond the end has the impedance Z sqrt((1 + a/s)(1 + b s)). So the dashpot reflects the share
(a/s + b s)/4 of a wave, for small a/s and b s: of a steady wave a t/4 after a time t, of a front, which the way to the
end has widened to sqrt(2 b t), b/4 over that width.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from impactlab.history.base import Warned
from impactlab.scene.bodies import WaveBody
from impactlab.scene.bodies.loads import SampledLoad
from impactlab.scene.problem import Scene

REFLECTED_WARN = 0.01  # of a wave: a larger share that comes back from an infinite end is reported
MIN_PULSE = 0.1  # of the impulse of the largest pulse of a force: smaller ones are its ripple


def reflecting(scene: Scene) -> Iterator[Warned]:
    """Yield a warning for each damped rod or shaft whose infinite end reflects waves."""
    for body in scene.wave_bodies:
        if not (body.is_damped and any(end.unbounded for _, end in body.ends)):
            continue
        share = reflected(body, scene.duration)
        if share > REFLECTED_WARN:
            yield Warned(
                "damped_infinite_end",
                f"'{body.name}' is damped, and its infinite end is a dashpot with the impedance of the "
                f"undamped body, which reflects up to about {100.0 * share:.2g} % of a wave. Give a "
                "longer body with another end, from which no wave returns within the run, or leave "
                "damping and viscosity out",
            )


def reflected(body: WaveBody, duration: float) -> float:
    """Return an estimate of the largest share of a wave that infinite ends reflect."""
    transit, found = body.front_time(0.0, body.length), 0.0
    for x, end in body.ends:
        if end.unbounded:
            segment = body.segments[0 if x == 0.0 else -1]
            delay = segment.viscosity / segment.young + body.damping.stiffness
            steady = min(1.0, 0.25 * body.damping.mass * max(0.0, duration - transit))
            front = min(1.0, 0.25 * math.sqrt(delay / (2.0 * transit))) if transit < duration else 0.0
            found = max(found, steady * math.exp(-0.5 * body.damping.mass * transit), front)
    return found


def short_loads(scene: Scene, dt: float) -> Iterator[Warned]:
    """Yield a warning for each end force with a pulse within a step of ``dt`` [s]."""
    for name, body in scene.elastic.items():
        for x, load in body.loads:
            shortest = shortest_pulse(load.sampled(scene.duration), scene.duration)
            if shortest < dt:
                yield Warned(
                    "short_load",
                    f"'{name}' at {x:.6g} m: a pulse of the end force lasts about {shortest:.3g} s, and a "
                    f"step {dt:.3g} s, so that the motion has at most the impulse of the pulse, not its "
                    "shape. Give a shorter step (more elements or modes), or model continuous, which is "
                    "exact for linear contacts",
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
