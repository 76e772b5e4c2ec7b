"""Energy balance of a march at its end, compiled.

It is for scenes without gravity, dashpots in contacts and branches of laws. Digits that a march loses change an energy,
and that change stays: in a body, or in the loss of a dashpot. So where the balance closes to rounding at the end, the
energies over time, which take longer than a short march, are not needed.
"""

from __future__ import annotations

import math

import numpy as np

from impactlab.exact.arrays import MarchArrays
from impactlab.exact.batch.reading import integral, node_at, wave_integral
from impactlab.exact.setup.network import Log
from impactlab.numerics.addresses import entered_with_table
from impactlab.numerics.compiling import EXACT_ENTRY, EXACT_PART


@EXACT_PART
def energy_at(m: MarchArrays, t: float) -> float:
    """Return the energy of all bodies and springs at time t [J].

    Each wave is inside its rod for one transit.
    """
    total = 0.0
    for e in range(len(m.ends)):
        end = m.ends[e]
        total += end.impedance * wave_integral(m, e, t - end.transit, t, False)
    for n in range(len(m.nodes)):
        node = m.nodes[n]
        if 0.0 < node.mass < np.inf:
            total += 0.5 * node.mass * node_at(m, n, t, False) ** 2
        if node.spring > 0.0:
            total += 0.5 * node.spring * node_at(m, n, t, True) ** 2
    for c in range(len(m.contacts)):
        contact = m.contacts[c]
        if contact.stiffness > 0.0:
            depth = node_at(m, contact.left, t, True) - node_at(m, contact.right, t, True) - contact.gap
            total += 0.5 * contact.stiffness * max(0.0, depth) ** 2
    return total


@EXACT_ENTRY
def end_error(m: MarchArrays) -> float:
    """Return the relative error of the energy balance at the end.

    It is relative to the larger of initial energy and work; inf without either.
    """
    t, start, work, lost = m.state[0].duration, energy_at(m, 0.0), 0.0, 0.0
    for n in range(len(m.nodes)):
        node = m.nodes[n]
        if node.end_force != 0.0:
            work += node.end_force * (node_at(m, n, t, True) - node_at(m, n, 0.0, True))
        if node.dashpot > 0.0:
            row = n - m.junctions[node.junction].first_node
            lost += node.dashpot * integral(m, node.junction, row, 0.0, t, True)
    scale = max(abs(start), abs(work))
    return abs(energy_at(m, t) + lost - work - start) / scale if scale > 0.0 else np.inf


def error_at_end(log: Log) -> float:
    """Return the relative error of a march's energy balance at its end.

    It is inf where it cannot be found in this way.
    """
    plain = float(log.state["gravity"]) == 0.0 and not log.names and not log.junctions["loaded"].any()
    if not plain or (log.contacts["damping"] > 0.0).any() or (log.contacts["branch"] >= 0).any():
        return math.inf
    return float(entered_with_table(end_error, log.memory))
