"""Check that the waves at a specimen belong together, by its momentum.

The forces on its two faces may differ by its momentum alone.
"""

from __future__ import annotations

import numpy as np

from impactlab.measurement.dispersion import Bar
from impactlab.measurement.inputs import warn_unusual
from impactlab.types import Array

WINDOW = 10.0  # diameters of the bar over the wave speed, from the arrival of the incident wave on: the first rise
ARRIVAL_SHARE = 0.05  # of the largest incident strain
MAX_DENSITY = 1e4  # kg/m3, density of a specimen: above those of steel, copper and lead's alloys of tests
SHARE = 0.05  # of the force of the incident wave, by which strains of both bars may differ


def warn_if_apart(dt: float, bar: Bar, incident: Array, forces: tuple[Array, Array], volume: float) -> None:
    """Issue an `UnusualValue` where the forces on a specimen differ too much.

    They are those on both faces, and differ by more than the specimen can take up. The impulse of their difference is
    the momentum of the specimen, whose velocity is at most twice that of the incident wave. Records that begin at
    different instants, or distances of the gauges that are wrong, move one wave against the others: for that time, at
    the first rise, the impulse is as large as that of the whole wave.

    ``incident`` are strains and ``forces`` [N] those on both faces, shape (n,) each, ``dt`` [s] apart; ``volume`` is
    that of the specimen [m3].
    """
    size = float(np.abs(incident).max())
    if size == 0.0:
        return
    first = int(np.argmax(np.abs(incident) >= ARRIVAL_SHARE * size))
    window = WINDOW * bar.diameter / bar.wave_speed
    begin, end = max(0, first - round(0.5 * window / dt)), first + round(window / dt)
    front, back = (each[begin:end] for each in forces)
    late = dt * float(np.abs(np.cumsum(front - back)).max()) / (size * bar.young * bar.area)  # s, of the incident force
    impedance = bar.young * bar.area / bar.wave_speed
    allowed = 2.0 * MAX_DENSITY * volume / impedance + SHARE * window
    if late > allowed:
        warn_unusual(
            f"at the first rise, up to {end * dt:.6g} s, the forces on the two faces of the specimen differ by an "
            f"impulse of {1e6 * late:.3g} us times the force of the incident wave, and the momentum of the specimen "
            f"explains {1e6 * allowed:.3g} us at most: check that both records begin at one instant, and the distances "
            "of the gauges from the specimen."
        )
