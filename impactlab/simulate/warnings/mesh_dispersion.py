"""Dispersion of waves on a mesh of rods: how long a front takes to pass after a travel over many elements.

Waves of a mesh travel at c (1 - a (k h)^2), with wave number k, element length h and a = s/24: s = 1 - b^2 of lumped
masses under central differences at Courant number b, 1 + 2 b^2 under the trapezoidal and the midpoint rule, and
-1 + 2 b^2 of consistent masses under these. After a travel over n elements a step is the integral of the Airy function
with the time scale (s n/8)^(1/3) h/c. It exceeds the step by 27 %, whatever n: behind the front if short waves are slow
(s > 0); if they are fast (s < 0) it begins with a dip as large ahead of the front, and a step down with a rise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.mesh.bars import Mesh
from impactlab.scene.bodies import ElasticBody
from impactlab.simulate.channels import AbstractRecordedHistory

LOBES = 3.5  # time scales of the first lobe and the trough beside it: means over them exceed a step by 4 % at most
RISE = 2.34  # time scales from the front to the top of the first lobe, the first zero of the Airy function


def airy_scale(history: AbstractRecordedHistory, bodies: Sequence[ElasticBody], time: float) -> float:
    """Return the time scale of a front that some bodies have dispersed up to a time of the run [s].

    It is the longest of theirs. Fronts travel from the first touch of the run on, of loads and initial displacements
    from t = 0. Meshes of higher order hardly disperse waves: 0, as for modes, whose overshoot stays as short as they
    are, and for lumped masses at Courant number 1.
    """
    cube, dt, scheme = 0.0, history.dt or 0.0, history.method.integrator
    events = history.events  # by time
    first_front = events[0].time if events and not history.scene.waves_from_start else 0.0
    travelled = max(0.0, time - first_front)
    explicit = isinstance(scheme, AbstractIntegrator) and scheme.needs_diagonal_mass
    for body in bodies:
        built = history.built[body.name]
        if isinstance(built.model, Mesh) and built.model.order == 1 and built.system.highest_frequency > 0.0:
            lumped = built.model.lumped
            transit = (2.0 if lumped else math.sqrt(12.0)) / built.system.highest_frequency
            of_step = (-1.0 if explicit else 2.0) * (dt / transit) ** 2
            cube = max(cube, abs((1.0 if lumped else -1.0) + of_step) * travelled * transit**2 / 8.0)
    return math.cbrt(cube)
