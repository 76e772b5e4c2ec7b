"""Kernel of a chain of delay lines.

Waves travel from node to node, and at each node two arrive and two leave.

Parameters: number of nodes, dt, number of steps so far; then of each node impedance to its left, impedance to its
right, mean velocity per force, spring, 2 m/dt, load; then of each piece between two nodes its delay in steps, the index
where its waves stand, the present place there, its impedance, the velocity that gravity gives to either wave in a step;
then the waves on their way as they were sent, both directions of a step side by side. The kernel writes these, the
places and the number of steps: they are the memory of the body, kept apart from the state that contacts change.

State: of each node the time integral of the velocity that it sends to the left, its displacement, and that of the
velocity that it sends to the right [m]; then the three velocities.
"""

from __future__ import annotations

from impactlab.numerics.sums import sum_of, sum_of_squares
from impactlab.numerics.windows import window
from impactlab.types import Array

NODE, PIECE, FIRST = 6, 5, 3  # numbers of a node and of a piece; where those of the nodes begin
SENT_LEFT, MOVED, SENT_RIGHT = 0, 1, 2  # coordinates of a node


def free(parameters: Array, state: Array) -> None:
    """Step without contact: waves travel on, and those that arrive move the nodes.

    A node between impedances Z1 and Z2 with mass m, spring k, dashpot d and force F, under the waves p from the left
    and q from the right, moves with the mean velocity V of (Z1 + Z2 + d + k dt/2 + 2 m/dt) V = 2 Z1 p + 2 Z2 q - k u +
    (2 m/dt) v + F. It sends V - p to the left and V - q to the right. On its way a wave gains g/2 in a unit of time.
    """
    nodes, dt = int(parameters[0]), parameters[1]
    rates = 3 * nodes
    parameters[2] += 1.0
    p = 0.0
    for node in range(nodes):
        at, u, v = FIRST + NODE * node, 3 * node + MOVED, rates + 3 * node + MOVED
        q, next_p = 0.0, 0.0
        if node < nodes - 1:
            piece = FIRST + NODE * nodes + PIECE * node
            delay, start, place = int(parameters[piece]), int(parameters[piece + 1]), int(parameters[piece + 2])
            index = start + 2 * place
            # The waves that both ends sent in the step before, contact included.
            parameters[index] = state[v + 1]
            parameters[index + 1] = state[v + 2]
            place = place + 1 if place + 1 < delay else 0
            parameters[piece + 2] = place
            index = start + 2 * place
            gained = delay * parameters[piece + 4]
            next_p, q = parameters[index] + gained, parameters[index + 1] + gained
        inertia = parameters[at + 4]
        push = 2.0 * (parameters[at] * p + parameters[at + 1] * q) + parameters[at + 5]
        mean = parameters[at + 2] * (push - parameters[at + 3] * state[u] + inertia * state[v])
        state[u] += dt * mean
        state[v] = 2.0 * mean - state[v] if inertia > 0.0 else mean
        if node > 0:
            state[v - 1] = mean - p
            state[u - 1] += dt * (mean - p)
        if node < nodes - 1:
            state[v + 1] = mean - q
            state[u + 1] += dt * (mean - q)
        p = next_p


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write energy [J], work of loads [J] and momentum [N s] of the chain.

    They are those of waves, end springs and end masses. A wave sent j to j + 1 steps ago has gained j to j + 1 times
    the velocity by gravity in a step. The work of gravity is that of the weight on the displacement, which both waves
    carry.
    """
    nodes, dt = int(parameters[0]), parameters[1]
    time = dt * parameters[2]
    out[0], out[1], out[2] = 0.0, 0.0, 0.0
    for node in range(nodes - 1):
        piece = FIRST + NODE * nodes + PIECE * node
        delay, start, place = int(parameters[piece]), int(parameters[piece + 1]), int(parameters[piece + 2])
        impedance, gain = parameters[piece + 3], parameters[piece + 4]
        right, left = state[3 * nodes + 3 * node + SENT_RIGHT], state[3 * nodes + 3 * node + 3 + SENT_LEFT]
        moved = state[3 * node + SENT_RIGHT] + state[3 * node + 3 + SENT_LEFT]  # m, at both nodes
        if gain == 0.0:  # all waves but the oldest ones, in whose place the newest will stand
            before, behind = window(parameters, start, 2 * place), 2 * (delay - 1 - place)
            after = window(parameters, start + 2 * (place + 1), behind)
            squares = right * right + left * left + sum_of_squares(before) + sum_of_squares(after)
            out[0] += impedance * dt * squares
            out[2] += impedance * dt * (right + left + sum_of(before) + sum_of(after))
            continue
        energy, momentum, area, k = 0.0, 0.0, 0.0, place
        for age in range(delay):
            if age > 0:
                k = k - 1 if k > 0 else delay - 1
                right, left = parameters[start + 2 * k], parameters[start + 2 * k + 1]
            now = (age + 0.5) * gain
            energy += (right + now) * (right + now) + (left + now) * (left + now) + gain * gain / 6.0
            momentum += right + left + 2.0 * now
            area += moved - 0.5 * dt * (right + left)
            moved -= dt * (right + left)
        out[0] += impedance * dt * energy
        out[1] += 2.0 * impedance * gain * (area + delay * delay * gain * time)
        out[2] += impedance * dt * momentum
    energy, work, momentum = 0.0, 0.0, 0.0
    for node in range(nodes):
        at, u, v = FIRST + NODE * node, 3 * node + MOVED, 3 * nodes + 3 * node + MOVED
        mass = 0.5 * dt * parameters[at + 4]
        energy += 0.5 * (parameters[at + 3] * state[u] * state[u] + mass * state[v] * state[v])
        work += parameters[at + 5] * state[u]
        momentum += mass * state[v]
    out[0] += energy
    out[1] += work
    out[2] += momentum
