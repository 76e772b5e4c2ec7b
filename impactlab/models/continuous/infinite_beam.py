"""Infinite Euler-Bernoulli beam: its impulse response where it is struck, as a sum of exponentials."""

from __future__ import annotations

import math
from typing import final

import numpy as np

from impactlab.errors import CaseError, PairingError
from impactlab.models.base import Face, Operators
from impactlab.models.continuous.base import MODES, AbstractSelfStepping, check_served, stepper_of, without_mass
from impactlab.scene.bodies import Beam
from impactlab.stepper import Stepper
from impactlab.types import Array, Quantity

SPACING = 0.5  # of ln p between two rates of decay: the sum of exponentials is then exact to 1e-8
MIN_RATE, MAX_RATE = 1e-13, 1e3  # rates of decay over 1/dt: the memory holds for 1e9 steps; faster ones act at once
PERIODS_OF_MASS = 1e3  # periods of `points_per_period` in the time (M/K)^2 of a mass that strikes


def free(parameters: Array, state: Array) -> None:
    """Step without contact: the motion under earlier forces goes on and decays.

    State: displacement, velocity, velocity of the whole beam, force of the step before, displacement before it, work
    given so far, impulse given so far, load; then for each rate p the decayed integral of F: q' = F - p q.
    """
    n = int(parameters[0])
    dt, admittance, compliance, reach = parameters[1], parameters[2], parameters[3], parameters[4]
    weight, decay, spread = parameters[5 : 5 + n], parameters[5 + n : 5 + 2 * n], parameters[5 + 2 * n : 5 + 3 * n]
    memory = state[8 : 8 + n]
    load = state[7]
    state[5] += (state[3] + load) * (state[0] - state[4])
    state[3], state[4] = 0.0, state[0]
    moved, velocity = 0.0, 0.0
    for k in range(n):
        held = memory[k]
        moved += weight[k] * spread[k] * held
        memory[k] = decay[k] * held + spread[k] * load
        velocity += weight[k] * decay[k] * held
    state[0] += state[2] * dt + admittance * moved + reach * load
    state[1] = state[2] + admittance * velocity + compliance * load
    state[6] += load * dt


def measure(parameters: Array, state: Array, out: Array) -> None:  # noqa: ARG001 - the signature of a stepper
    """Write the work on the beam and of its load [J], and momentum [N s]."""
    out[0] = state[5] + (state[3] + state[7]) * (state[0] - state[4])
    out[1] = state[7] * state[0]
    out[2] = state[6]


@final
class InfiniteBeam(AbstractSelfStepping):
    """A uniform Euler-Bernoulli beam without reflections.

    Both ends are infinite, or one is a free tip and the other infinite. Where it is struck, a force F gives the
    velocity F/(K sqrt(s)) in the domain of Laplace, K = 2 sqrt(2) (EI)^(1/4) (rho A)^(3/4) at an inner point and a
    quarter of that at a free tip. Its memory 1/sqrt(pi t) is a sum of exponentials, 1/sqrt(s) = 1/pi int p^(-1/2)/(s +
    p) dp by the trapezoidal rule in ln p: each stands for a mass without spring behind a dashpot, so that the beam
    never returns more than the work done on it. The sum is exact to 1e-8 over 1e9 steps, and exact for a force constant
    over a step. Its energy is the work done on it, radiated waves included. It is known where it is struck, and nowhere
    else.

    ``points_per_period`` counts 1000 periods in the time (M/K)^2 of a mass that strikes it. A hard contact that holds
    positions is then of second order and keeps the energy: at ten points v/v0 errs by 5e-7 at
    t = 0.01 (M/K)^2. One that holds velocities is of first order, and errs by 2.4e-4 there.
    Without a mass the rule counts the hundredth frequency of a simply supported beam of the length given.

    References
    ----------
    Graff1975, chapter 3 (infinite beams); LubichSchadle2002 (memory by sums of exponentials).
    """

    n_dof = 1

    def __init__(self, beam: Beam, gravity: float, faces: tuple[Face, ...]) -> None:
        self._beam, self._x = beam, _struck(beam, gravity, faces)
        segment = beam.segments[0]
        stiffness, mass = segment.bending_stiffness, segment.density * segment.area
        inner = math.sqrt(8.0) * stiffness**0.25 * mass**0.75
        self.resistance = inner if beam.left.kind == beam.right.kind == "infinite" else 0.25 * inner
        struck_by = [face.partner_mass for face in faces if math.isfinite(face.partner_mass)]
        self._rule = (
            2.0 * math.pi * PERIODS_OF_MASS * (self.resistance / min(struck_by)) ** 2
            if struck_by
            else (MODES * math.pi / beam.length) ** 2 * math.sqrt(stiffness / mass)
        )

    @property
    def longest_step(self) -> float:
        return math.inf

    def operators(self) -> Operators:
        velocity, load = np.full(1, self._beam.velocity), np.array([self._beam.end_force])
        return without_mass(np.zeros(1), velocity, load, np.zeros(1), self._rule)

    def row(self, x: float, quantity: Quantity) -> Array:
        if quantity not in ("displacement", "velocity") or x != self._x:
            raise PairingError(
                f"the infinite beam '{self._beam.name}' has only displacement and velocity, at its "
                f"contact at {self._x:.6g} m, and no {quantity} at {x:.6g} m",
                remedy="Probe it there, or use theory: timoshenko with continuous, or finite_element.",
                path="probes",
            )
        return np.ones(1)

    def grid(self) -> Array:
        return np.array([self._x])

    def stepper(self, ports: Array, dt: float) -> Stepper:
        rates = np.exp(np.arange(math.log(MIN_RATE), math.log(MAX_RATE), SPACING)) / dt
        weights = SPACING / math.pi * np.sqrt(rates)
        # All slower rates together do not decay within the run.
        slow = weights[0] / math.expm1(0.5 * SPACING)
        rates, weights = np.concatenate(([0.0], rates)), np.concatenate(([slow], weights))
        decay = np.exp(-rates * dt)
        spread = np.concatenate(([dt], -np.expm1(-rates[1:] * dt) / rates[1:]))
        # Of rates that decay within a step only the sum counts: with it a constant force moves the beam exactly.
        compliance = 2.0 * math.sqrt(dt / math.pi) / self.resistance
        reach = 2.0 / 3.0 * dt * compliance
        parameters = np.concatenate(
            ([float(rates.size), dt, 1.0 / self.resistance, compliance, reach], weights, decay, spread)
        )
        load = self._beam.end_force
        state = np.concatenate(([0.0, self._beam.velocity, self._beam.velocity], np.zeros(4), [load], 0.0 * rates))
        response = np.concatenate(([reach, compliance, 0.0, 1.0, 0.0, 0.0, dt, 0.0], spread))
        force_response = np.tile(response, (len(ports), 1))
        return stepper_of(free, measure, parameters, state, force_response, ports)


def _struck(beam: Beam, gravity: float, faces: tuple[Face, ...]) -> float:
    """Return the place where the beam is struck [m]; raise where no closed form exists."""
    path, bare = f"solve.models.{beam.name}", "Use finite_element or modal for this body, or theory: timoshenko."
    kinds = [end.kind for end in (beam.left, beam.right)]
    if sorted(kinds) not in (["infinite", "infinite"], ["free", "infinite"]):
        raise PairingError(
            f"the continuous description of an Euler-Bernoulli beam needs both ends infinite, or one infinite and the "
            f"other free; the ends of '{beam.name}' are {kinds[0]} and {kinds[1]}",
            remedy=bare,
            path=path,
        )
    check_served(beam, gravity, "Euler-Bernoulli", bare, {"displacement at t = 0": beam.displacement is not None})
    places = sorted({face.x for face in faces})
    tip = 0.0 if kinds[0] == "free" else beam.length
    if len(places) > 1:
        raise PairingError(
            f"the infinite beam '{beam.name}' is struck at {len(places)} places; its response at one "
            "place to a force at another is not known in closed form",
            remedy=bare,
            path=path,
        )
    if "free" in kinds and places and places[0] != tip:
        raise PairingError(
            f"the semi-infinite beam '{beam.name}' is struck at {places[0]:.6g} m; its motion is known at its free "
            f"tip, {tip:.6g} m",
            remedy="Strike the tip, or use theory: timoshenko or finite_element.",
            path=path,
        )
    if not places and "free" not in kinds:
        raise CaseError(
            f"nothing strikes the infinite beam '{beam.name}'", remedy="Add a contact, or remove the body.", path=path
        )
    return places[0] if places else tip
