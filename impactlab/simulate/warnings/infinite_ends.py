"""The warning of a damped rod or shaft with an infinite end.

The dashpot of that end is the impedance Z of the undamped body. Damped by a times its mass and with a stress that is
delayed by b, the rod beyond the end has the impedance Z sqrt((1 + a/s)(1 + b s)). So the dashpot reflects the share
(a/s + b s)/4 of a wave, for small a/s and b s: of a steady wave a t/4 after a time t, of a front, which the way to the
end has widened to sqrt(2 b t), b/4 over that width.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from impactlab.history.base import Warned
from impactlab.scene.bodies import WaveBody
from impactlab.scene.problem import Scene

REFLECTED_WARN = 0.01  # of a wave: a larger share that comes back from an infinite end is reported


def warnings(scene: Scene) -> Iterator[Warned]:
    """Yield a warning for each damped rod or shaft whose infinite end reflects waves."""
    for body in scene.wave_bodies:
        if not (body.is_damped and any(end.unbounded for _, end in body.ends)):
            continue
        share = reflected(body, scene.duration)
        if share > REFLECTED_WARN:
            yield Warned(
                "damped_infinite_end",
                f"'{body.name}' is damped, and its infinite end is a dashpot of the undamped impedance: it reflects up "
                f"to about {100.0 * share:.2g} % of a wave. Give a longer body with another end, from which no wave "
                "comes back within the run, or leave damping and viscosity out",
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
