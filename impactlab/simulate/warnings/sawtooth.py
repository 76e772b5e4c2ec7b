"""Sawtooth of explicit meshes at their stability limit: warnings of dashpots whose velocity jumps there.

At courant 1 a lumped mesh of a rod is two meshes that do not touch each other: u(x, t) with (x/h + t/dt) even, and odd.
Waves are exact on both. The damping of a step is that of its mean velocity, half of the right one in the step in which
the velocity jumps, so that one mesh moves too far by a part of a step. The strain then alternates from element to
element and from step to step, behind the front and for good; a smaller step disperses it within some steps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from impactlab.history.base import Warned
from impactlab.integrators.base import AbstractIntegrator
from impactlab.scene.bodies import End, WaveBody
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene
from impactlab.simulate.planning.preparation import BuiltBody

# Of the impedance of a rod, from which the first step under a dashpot at an end is that of the front, at the stability
# limit (`impactlab.integrators.leapfrog_factors.write_factors`).
EXACT_START = math.sqrt(2.0)
MIN_SHARE = 0.995  # of the stability limit: below it the sawtooth is within the ringing of any mesh at a front


def warnings(
    scene: Scene, method: Method, integrator: AbstractIntegrator, built: Mapping[str, BuiltBody], dt: float
) -> Iterator[Warned]:
    """Yield a warning for each rod or shaft with a sawtooth.

    A dashpot causes it in steps of dt [s].
    """
    if not integrator.needs_diagonal_mass:
        return
    for body in scene.wave_bodies:
        source, system = _source(scene, method, body), built[body.name].system
        if source and not system.modes and dt > MIN_SHARE * integrator.limit(system):
            yield Warned(
                "sawtooth",
                f"'{body.name}': at the stability limit of the step waves do not disperse, and strain and "
                f"force inside the elements behind the front from {source} alternate from step to step; "
                "displacements, contact forces and values at nodes, the mean of both sides, are right. "
                "Give courant: 0.95, or model: {kind: continuous}",
            )


def _source(scene: Scene, method: Method, body: WaveBody) -> str:
    """Return as text the first dashpot whose velocity jumps; empty if none does."""
    for side, (x, end) in zip(("left", "right"), body.ends, strict=True):
        jumps = body.velocity != 0.0 or _force_at_start(end) != 0.0
        if end.kind == "dashpot" and jumps and end.value < EXACT_START * body.impedance_at(x):
            return f"the dashpot of its {side} end"
    for contact in scene.contacts:
        law = method.laws[contact.name]
        # Faces that touch at t = 0 do so at the start of a step, and the dashpot acts over the whole of it.
        touches_within = contact.gap != 0.0 and body.name in (contact.left.body, contact.right.body)
        if touches_within and law.force_jumps and not law.hard:
            return f"the dashpot of {contact.name}"
    return ""


def _force_at_start(end: End) -> float:
    """Return the force on an end at t = 0 [N]."""
    return end.force if end.load is None else float(end.load.at(np.zeros(1))[0])
