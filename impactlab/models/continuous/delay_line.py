"""Delay line: travelling waves of a uniform rod in steps, for laws that the exact solver refuses."""

from __future__ import annotations

import math
from typing import final

import numpy as np

from impactlab.errors import CaseError
from impactlab.models.base import Operators
from impactlab.models.continuous.base import MODES, AbstractSelfStepping, stepper_of, under_waves, without_mass
from impactlab.numerics.sums import sum_of, sum_of_squares
from impactlab.numerics.windows import window
from impactlab.printing import at_most
from impactlab.scene.bodies import End, WaveBody
from impactlab.scene.sizes import check_cells
from impactlab.stepper import Stepper
from impactlab.types import Array, Quantity


def free(parameters: Array, state: Array) -> None:
    """Step without contact: waves arrive, both ends reflect them, the reflections leave.

    An end with mass m, spring k, dashpot d and force F under an arriving wave w moves with the mean velocity V of
    (Z + d + k dt/2 + 2 m/dt) V = 2 Z w - k u + (2 m/dt) v + F and sends V - w. A wave that takes T/(2 dt) = n + f steps
    arrives as the mean of two steps, f and 1 - f, so that no impulse is lost.
    """
    whole, share, dt, impedance = int(parameters[0]), parameters[1], parameters[2], parameters[3]
    room = whole + 2
    head = int(state[6])
    # The waves that the ends sent in the step before stand in state[4] (to the right) and state[5], contact included.
    to_right, to_left = window(state, 7, room), window(state, 7 + room, room)
    to_right[head], to_left[head] = state[4], state[5]
    head = head + 1 if head + 1 < room else 0
    state[6] = head
    near = head - whole if head >= whole else head - whole + room
    far = near - 1 if near > 0 else room - 1
    for end in range(2):
        sent = to_left if end == 0 else to_right
        arrived = (1.0 - share) * sent[near] + share * sent[far]
        compliance, spring, inertia = parameters[4 + 3 * end], parameters[5 + 3 * end], parameters[6 + 3 * end]
        push = 2.0 * impedance * arrived + parameters[10 + end]
        mean = compliance * (push - spring * state[end] + inertia * state[2 + end])
        state[end] += dt * mean
        state[2 + end] = 2.0 * mean - state[2 + end] if inertia > 0.0 else mean
        state[4 + end] = mean - arrived


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write energy [J], work of the end forces [J] and momentum [N s].

    They are those of waves, end springs and end masses.
    """
    whole, share, dt, impedance = int(parameters[0]), parameters[1], parameters[2], parameters[3]
    room = whole + 2
    head = int(state[6])
    energy = state[4] * state[4] + state[5] * state[5]
    momentum = state[4] + state[5]
    last = head - whole if head >= whole else head - whole + room  # sent longest ago: a share of it has arrived
    after = head - whole + 1  # sent since then, up to the head; below zero the ring goes on at its end
    for way in range(2):
        sent = window(state, 7 + way * room, room)
        begin, beyond = max(after, 0), max(-after, 0)
        whole_part, wrapped = window(sent, begin, head - begin), window(sent, room - beyond, beyond)
        energy += share * sent[last] * sent[last] + sum_of_squares(whole_part) + sum_of_squares(wrapped)
        momentum += share * sent[last] + sum_of(whole_part) + sum_of(wrapped)
    work = parameters[10] * state[0] + parameters[11] * state[1]
    out[0], out[1], out[2] = impedance * dt * energy, work, impedance * dt * momentum
    for end in range(2):
        spring, mass = parameters[5 + 3 * end], 0.5 * dt * parameters[6 + 3 * end]
        out[0] += 0.5 * (spring * state[end] * state[end] + mass * state[2 + end] * state[2 + end])
        out[2] += mass * state[2 + end]


@final
class DelayLine(AbstractSelfStepping):
    """A uniform rod as two delays; its coordinates are the displacements of its ends.

    Its velocity per force is 1/Z at a free end, exact for every step up to the transit.
    """

    n_dof = 2
    books_momentum = True

    def __init__(self, rod: WaveBody, gravity: float, modes: int = MODES) -> None:
        if len(rod.segments) != 1:
            raise CaseError(
                f"the stepped delay line supports only uniform rods, and '{rod.name}' has {len(rod.segments)} segments",
                remedy="Use finite_element.",
                path="solve.model",
            )
        if gravity != 0.0:
            raise CaseError(
                f"the stepped delay line of '{rod.name}' does not support gravity, {gravity:g} m/s2 here",
                remedy="Use finite_element or modal.",
                path="solve.model",
            )
        if rod.is_damped:
            raise CaseError(dispersed(rod), remedy="Use finite_element or modal.", path="solve.model")
        self._rod, self._modes = rod, modes
        self._segment = rod.segments[0]
        self.transit = 0.5 * rod.round_trip

    def gives_means(self, x: float) -> bool:
        end = self._rod.left if x == 0.0 else self._rod.right
        return not (end.kind == "mass" and end.value > 0.0)

    @property
    def longest_step(self) -> float:
        return self.transit

    def broken(self, dt: float) -> float:
        steps = self.transit / dt
        return round(abs(steps - round(steps)), 9)

    def too_long(self, dt: float) -> CaseError:
        return CaseError(
            f"a step of {dt:.6g} s is longer than the transit {self.transit:.6g} s of '{self._rod.name}'",
            remedy=f"Give dt: {at_most(self.transit)} or less.",
            path="solve.step",
        )

    def operators(self) -> Operators:
        rod, profile = self._rod, self._rod.displacement
        start = np.zeros(2) if profile is None else profile(np.array([0.0, rod.length]))
        dashpots = np.array([end.value if end.kind == "dashpot" else 0.0 for end in (rod.left, rod.right)])
        load = np.array([rod.left.force, rod.right.force])
        rule = (2 * self._modes + 1) * math.pi / (2.0 * self.transit)
        return without_mass(start, np.full(2, rod.velocity), load, dashpots, rule)

    def row(self, x: float, quantity: Quantity) -> Array:
        if quantity not in ("displacement", "velocity") or not (x == 0.0 or x == self._rod.length):
            raise CaseError(
                f"the stepped delay line of '{self._rod.name}' has no {quantity} at {x:.6g} m: it has displacement and "
                "velocity at its ends",
                remedy="Use finite_element or modal, or a law that the continuous model solves from event to event.",
                path="probes",
            )
        return np.array([1.0, 0.0]) if x == 0.0 else np.array([0.0, 1.0])

    def grid(self) -> Array:
        return np.array([0.0, self._rod.length])

    def stepper(self, ports: Array, dt: float) -> Stepper:
        """Return the delay line prepared for a step, at most the transit [s]."""
        if dt > self.transit * (1.0 + 1e-12):
            raise self.too_long(dt)
        check_cells(self.transit / dt, self._rod.name)
        impedance, speed, rod = self._segment.impedance, self._segment.wave_speed, self._rod
        whole = max(1, math.floor(self.transit / dt * (1.0 + 1e-12)))
        share = max(0.0, self.transit / dt - whole)
        ends = [self._end(end, dt) for end in (rod.left, rod.right)]
        parameters = np.array([float(whole), share, dt, impedance, *ends[0], *ends[1], rod.left.force, rod.right.force])
        state = np.zeros(7 + 2 * (whole + 2))
        state[2:4] = [0.0 if end.kind == "clamped" else rod.velocity for end in (rod.left, rod.right)]
        if rod.displacement is None:
            state[4:6] = state[8 : 9 + whole] = state[10 + whole :] = 0.5 * rod.velocity
        else:
            state[:2] = self.operators().displacement
            edges = np.arange(whole + 3) * dt * speed
            for way, x in enumerate((edges, rod.length - edges)):
                # A wave that arrives j steps from now is on its way: its mean over the piece of rod it fills now.
                slopes = np.diff(rod.displacement(np.clip(x, 0.0, rod.length))) / np.diff(x)
                sent = 0.5 * (rod.velocity + (speed if way else -speed) * slopes)
                state[4 + way] = sent[0]
                # The head stands at 0: entry -j holds the wave sent j steps before the newest.
                before = np.arange(1, whole + 2)
                state[7 + way * (whole + 2) + (-before) % (whole + 2)] = sent[before]
        force_response = np.zeros((len(ports), state.size))
        for port, row in enumerate(ports):
            end = int(np.argmax(row))
            compliance, _, inertia = ends[end]
            force_response[port, end] = dt * compliance
            force_response[port, 2 + end] = 2.0 * compliance if inertia > 0.0 else compliance
            force_response[port, 4 + end] = compliance
        return stepper_of(free, measure, parameters, state, force_response, ports)

    def _end(self, end: End, dt: float) -> tuple[float, float, float]:
        return (0.0, 0.0, 0.0) if end.kind == "clamped" else under_waves(end, self._segment.impedance, dt)


def dispersed(rod: WaveBody) -> str:
    """Return the reason why a damped rod has no delay line."""
    return f"'{rod.name}' is damped, so that its waves change their shape: the continuous model does not support it"
