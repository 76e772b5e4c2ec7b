"""The warning of a link that gravity swings.

It is clamped to the hub that a drive holds, and straight at t = 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from impactlab.history.base import Warned
from impactlab.scene.bodies import links_on_hubs
from impactlab.simulate.channels import AbstractRecordedHistory

SWING_WARN = 0.01  # of the motion of a face in the run: the share that the swing has in it, as of other beams
BEAM_SHARE = 33.0 / 140.0  # of the mass of a cantilever, that a mass at its tip stands for (Rayleigh)


def warnings(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Yield a warning for each link whose swing by gravity matters.

    The link is on a driven hub, and swings about its static sag. None where gravity alone moves it. The sag is that of
    a cantilever under its weight and that of the mass at its end, at its angle at t = 0.
    """
    scene = history.scene
    for body, link in links_on_hubs(scene.bodies.values()):
        others = (each for name, each in scene.bodies.items() if name != body.name)
        turns = link.drive is not None and link.drive.rate != 0.0
        if link.beam is None or not (turns or any(each.moves for each in others)):
            continue
        across = math.cos(link.angle) * body.gravity[1] - math.sin(link.angle) * body.gravity[0]  # m/s2
        mass, bending, length = link.beam.mass, link.beam.segments[0].bending_stiffness, link.length
        slowest = math.sqrt(3.0 * bending / (length**3 * (link.end_mass + BEAM_SHARE * mass)))  # rad/s
        swing = 1.0 - math.cos(min(slowest * history.duration, math.pi))
        for number, mark in enumerate(body.marks):
            x, side = mark.x, mark.along[1] * math.cos(link.angle) - mark.along[0] * math.sin(link.angle)
            of_beam = mass / length * x**2 * (6.0 * length**2 - 4.0 * length * x + x**2) / 24.0
            sag = across * (of_beam + link.end_mass * x**2 * (3.0 * length - x) / 6.0) / bending
            moved = float(np.ptp(history.recorded[body.face_channel(number)].values))
            if swing * abs(side * sag) > SWING_WARN * moved:
                yield Warned(
                    "static_sag",
                    f"'{link.name}' is straight at t = 0, and its weight acts from then on: it swings about its static "
                    f"sag, {sag:.3g} m at {x:.6g} m, by up to {swing * abs(sag):.3g} m within the run, of {moved:.3g} "
                    f"m that {mark.label} moves; where it hung at rest, leave gravity out: displacements, gaps and "
                    "moments then count from the sag",
                )
                break
