"""Power laws of the indentation: Hertz, and three laws with hysteresis damping."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.numerics.compiling import UNPACK
from impactlab.types import Level, Noted, Port, PowerForce, Reply, Restitution, SideFacts, Start, option

MAX_EXPLICIT = 4.0  # stiffness times compliance of the faces: the stability limit w dt = 2 of an explicit step
COARSE_WARN = 0.25  # the same, and damping times compliance, from which a step is long against the contact's own times
MAX_DAMPED = 1.0  # damping times compliance, from which a mean force over the step turns the rate round within it
SLOW_RATIO = 0.999  # slowest_approach over the approach speed, below which the touch was no slow one
MIN_COMPLIANCE = 1e-300  # m/N, to divide by
MAX_TURNS = 1000  # of Newton's iteration; a few are enough except for extreme exponents
STIFFNESS = (
    "K, force per indentation to the power n; of spheres and rounded ends {radius: 5 mm, material: steel}, with "
    "other_radius where the other body is no plane"
)
TOO_STIFF = (
    "at this overlap the tangent stiffness of the power law exceeds the stability limit of "
    "an explicit step, 4 over the compliance of the faces in a step"
)
SLOW = Noted(
    slot=2,
    code="slow_touch",
    text=("touches slower than slowest_approach, which replaces their approach speed in the damping: {count}"),
)
COARSE = Noted(
    slot=3,
    code="coarse_contact",
    text="steps too long for the contact's own oscillation or decay: {count}; give a smaller step, or an implicit "
    "scheme in place of an explicit one",
)


@UNPACK
def approach_speed(port: Port, reply: Reply) -> float:
    """Return the speed of approach at the touch [m/s]; count one below the lowest allowed."""
    speed = port.memory[1]
    if speed == 0.0:
        gap, free_gap = port.gap, port.free_gap
        share = gap / (gap - free_gap) if gap > 0.0 else 0.0
        if port.averaged == 0.0 and port.acting_gap_per_force == 0.0 and port.gap_rate * port.dt < 0.0:
            # Rates are those in the middle of the step before, in which the faces met, and of the step itself.
            share = 0.5 - min(1.0, gap / (port.gap_rate * port.dt))
        speed = -(port.gap_rate + share * (port.free_gap_rate - port.gap_rate))
        if speed < port.parameters[3]:
            speed = port.parameters[3]
            reply.memory[2] += 1.0 if port.parameters[2] > 0.0 else 0.0
    return speed


@UNPACK
def at_start(port: Port, reply: Reply, gain: float) -> float:
    """Write force and stored energy for a force at the step's start; return the loss [J]."""
    stiffness, n = port.parameters[0], port.parameters[1]
    gap, compliance = port.gap, port.gap_per_force
    before = max(0.0, -gap)
    rate, rate_compliance = port.acting_rate, port.acting_rate_per_force
    spring, tangent = stiffness * before**n, n * stiffness * before ** (n - 1.0)
    lost = 0.0
    if tangent * compliance > MAX_EXPLICIT:
        reply.failed = 1.0
    else:
        reply.memory[3] += 1.0 if max(tangent * compliance, spring * gain * rate_compliance) > COARSE_WARN else 0.0
        reply.trial = spring * (1.0 - gain * rate) / (1.0 + spring * gain * rate_compliance)
        reply.force = max(0.0, reply.trial)
        after = max(0.0, -(port.free_gap + compliance * reply.force))
        # For n = 1 the energy kept under such a force is k/2 times the indentations at both ends of the step.
        reply.stored = stiffness * (before * after) ** (0.5 * (n + 1.0)) / (n + 1.0)
        lost = spring * gain * (rate + rate_compliance * reply.force) ** 2 * port.dt
        reply.in_contact = 1.0 if reply.trial > 0.0 or gap == 0.0 else 0.0
    return lost


@UNPACK
def spring_of(port: Port, before: float, power: float, after: float, y: float) -> tuple[float, float]:
    """Return force [N] and slope [N/m] of the spring at the step's end or averaged.

    ``before`` and ``after`` are the indentations at its ends [m], y the one gained, ``power`` that before to n + 1.
    """
    stiffness, n = port.parameters[0], port.parameters[1]
    ratio = y / (before + after)
    if port.averaged == 0.0:
        spring, tangent = stiffness * after**n, n * stiffness * after ** (n - 1.0)
    elif abs(ratio) < 1e-3 and before > 0.0:
        # The quotient would be a difference of nearly equal numbers: its series about the middle.
        middle, square = 0.5 * (before + after), ratio * ratio
        bend, tangent = n * (n - 1.0) / 6.0, stiffness * middle ** (n - 1.0)
        spring = tangent * middle * (1.0 + bend * square * (1.0 + (n - 2.0) * (n - 3.0) * square / 20.0))
        tangent *= 0.5 * n + bend * (ratio + (0.5 * n - 1.0) * square)
    else:
        spring = stiffness * (after ** (n + 1.0) - power) / ((n + 1.0) * y)
        tangent = (stiffness * after**n - spring) / y
    return spring, tangent


@UNPACK
def over_step(port: Port, reply: Reply, gain: float) -> tuple[float, float]:
    """Write force and stored energy for a force within or at the step's end.

    Return the energy lost [J] and the indentation at the end [m].
    """
    stiffness, n = port.parameters[0], port.parameters[1]
    gap, free_gap, compliance = port.gap, port.free_gap, port.gap_per_force
    before, free = max(0.0, -gap), gap - free_gap
    y, after, spring, rise = free, 0.0, 0.0, 0.0
    power, size = before ** (n + 1.0), math.inf
    # The rate of indentation where the force acts is linear in the indentation gained.
    slope = port.acting_rate_per_force / max(compliance, MIN_COMPLIANCE)
    rate = -port.acting_rate - slope * free
    for _ in range(MAX_TURNS):
        after = max(0.0, y - gap)
        if before + after == 0.0:
            break  # they touch by less than a rounding
        rise = max(0.0, 1.0 + gain * (rate + slope * y))
        spring, tangent = spring_of(port, before, power, after, y)
        reply.force = spring * rise
        tangent = tangent * rise + (spring * gain * slope if rise > 0.0 else 0.0)
        change = (y - free + compliance * reply.force) / (1.0 + compliance * tangent)
        size, last = abs(change), size
        scale = max(abs(free), abs(y))  # faces may move less than a rounding: free is zero then, and y is not
        if size <= 1e-15 * scale or 0.5 * last <= size <= max(1e-11 * scale, 1e-15 * before):
            if compliance * tangent > 1.0:
                reply.force = max(0.0, (free - y) / compliance)  # rounding of y is not magnified here
            break
        y -= change
    turned = spring * gain * port.acting_rate_per_force > MAX_DAMPED
    if turned and gain * port.parameters[3] < SLOW_RATIO * port.parameters[2]:  # a slower touch is counted as such
        reply.memory[3] += 1.0
    reply.stored = stiffness * after ** (n + 1.0) / (n + 1.0)
    if after > 0.0:
        # Faces that part need no trial force: their gap dates it. A negative one dates a force lost before that.
        reply.trial = reply.force if reply.force > 0.0 else spring * (1.0 + gain * (rate + slope * y))
        reply.in_contact = 1.0 if reply.force > 0.0 else 0.0
    closing = rate + slope * y
    if port.averaged != 0.0:
        return max(0.0, spring * gain * closing * y), after
    # The force at the end of a step times its travel is not the work in it: the mean of the powers at both ends is.
    first = stiffness * before**n
    power = (first - max(0.0, first * (1.0 - gain * port.gap_rate))) * port.gap_rate + (reply.force - spring) * closing
    return 0.5 * max(0.0, power) * port.dt, after


def respond(port: Port, reply: Reply) -> None:
    """Evaluate F = K d^n (1 + a d') over one step, never pulling.

    a is the hysteresis factor over the approach speed.

    Parameters of the port: K, n, a v0, least v0. Memory: energy stored [J], approach speed v0 [m/s] (0 while open),
    number of touches slower than the least, number of steps that are long against the contact's own times.

    Where the force is a mean over the step, K d^n is the change of V = K d^(n+1)/(n+1) over the change of the gap, so
    that force times travel is the energy stored, to rounding, also where the faces meet or part inside the step. The
    indentation gained in the step, y, then solves y + (gap per force) F(y) = y without contact; F rises and is convex,
    so Newton's iteration from the right never leaves the root's right side. Where the force acts at the end of the step
    it is that of the indentation and its rate there, and the equation has the same shape.
    """
    averaged = port.averaged != 0.0
    explicit = not averaged and port.acting_gap_per_force == 0.0
    reply.memory[0], reply.memory[1] = 0.0, 0.0
    # A spring that is let go of gives nothing back; where it parts between two ends of steps, that is an error of the
    # scheme.
    held = port.memory[0] if explicit or averaged else 0.0
    reply.dissipated = held
    nearest = min(port.first_gap, port.last_gap)
    if nearest > 0.0 or (nearest == 0.0 and (not explicit or port.gap_rate >= 0.0)):
        return
    speed, after = approach_speed(port, reply), 0.0
    gain = port.parameters[2] / speed
    if explicit:
        lost = at_start(port, reply, gain)
        if reply.failed != 0.0:
            return
    else:
        lost, after = over_step(port, reply, gain)
    # Opened before it is relaxed: the damping takes the energy that the spring gives as it follows the face.
    reply.dissipated = lost if reply.force > 0.0 or not (explicit or averaged) else max(0.0, held - reply.stored)
    reply.memory[0] = reply.stored
    reply.memory[1] = speed if after > 0.0 or explicit else 0.0


def rise_of(stiffness: float, exponent: float, overlap: float) -> float:
    """Return how fast K d^n rises with the overlap d [N/m]."""
    return float(exponent * stiffness * overlap ** (exponent - 1.0))


def true_restitution(hysteresis: float) -> float:
    """Return the restitution of F = K d^n (1 + a d') between rigid bodies.

    It follows from b = a v0 and is free of K, n and masses.

    The phase curve b - ln(1 + b) = -b E - ln(1 - b E) follows from m v dv = -K d^n (1 + a v) dd.
    """
    if hysteresis < 1e-4:  # the series of the same equation, to b^3
        return 1.0 - hysteresis * 2.0 / 3.0 + hysteresis**2 * 4.0 / 9.0
    wanted = hysteresis - math.log1p(hysteresis)
    low, high = 0.0, 1.0
    while low < (middle := 0.5 * (low + high)) < high:
        if -middle - math.log1p(-middle) < wanted:
            low = middle
        else:
            high = middle
    return low / hysteresis


@final
@dataclass(frozen=True)
class Hertz(AbstractContactLaw):
    """Hertz contact: F = K d^n with n = 3/2 for rounded bodies, without loss.

    Between schemes whose force acts inside the step the force is the discrete gradient of the stored energy (deviation
    from the source, which is static: Gonzalez1996), so that a run neither gains nor loses.

    References
    ----------
    Hertz1882; Gonzalez1996 (discrete gradient).
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    zero_apart = True
    citations = ("Hertz1882", "Gonzalez1996")
    examples = ({"stiffness": 1e13}, {"stiffness": 1e24, "exponent": 3.0})
    smooth = True
    why_failed = TOO_STIFF
    noted = (COARSE,)

    stiffness: float = option(unit="N/m^n", above=0.0, description=STIFFNESS)
    exponent: float = option(1.5, at_least=1.0, at_most=10.0, description="power n of the indentation")

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(parameters=(self.stiffness, self.exponent, 0.0, 1.0), memory=(0.0, 0.0, 0.0, 0.0))

    def power_force(self, start: Start) -> PowerForce:
        return PowerForce(self.stiffness, self.exponent, COARSE_WARN, MAX_EXPLICIT, COARSE)

    def stiffness_at(self, overlap: float, left: SideFacts, right: SideFacts) -> float:
        return rise_of(self.stiffness, self.exponent, overlap)

    respond = staticmethod(respond)


@dataclass(frozen=True)
class AbstractHystereticLaw(AbstractContactLaw):
    """A power law damped by hysteresis, F = K d^n (1 + a d').

    To write one, supply `hysteresis` and the citations.
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    zero_apart = True
    smooth = True
    why_failed = TOO_STIFF
    noted = (SLOW, COARSE)
    examples = ({"stiffness": 1e13, "restitution": 0.5}, {"stiffness": 1e13, "restitution": 0.05})

    stiffness: float = option(unit="N/m^n", above=0.0, description=STIFFNESS)
    exponent: float = option(1.5, at_least=1.0, at_most=10.0, description="power n of the indentation")
    restitution: float = option(
        1.0, above=0.0, at_most=1.0, description="nominal coefficient of restitution; the true one is in the summary"
    )
    slowest_approach: float = option(
        1e-6, unit="m/s", above=0.0, description="least approach speed by which the damping is divided"
    )

    @abstractmethod
    def hysteresis(self) -> float:
        """Return a v0: the damping factor times the approach speed, from the nominal restitution."""

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        parameters = (self.stiffness, self.exponent, self.hysteresis(), self.slowest_approach)
        return Start(parameters=parameters, memory=(0.0, 0.0, 0.0, 0.0))

    def stiffness_at(self, overlap: float, left: SideFacts, right: SideFacts) -> float:
        return rise_of(self.stiffness, self.exponent, overlap)

    def restitutions(self) -> Restitution:
        return Restitution(self.restitution, true_restitution(self.hysteresis()))

    respond = staticmethod(respond)


@final
@dataclass(frozen=True)
class HuntCrossley(AbstractHystereticLaw):
    """Hunt and Crossley: F = K d^n (1 + a d'), a = 1.5(1-e)/v0.

    v0 is the approach speed at the touch. The restitution e is nominal: a mass on a wall returns faster.

    References
    ----------
    HuntCrossley1975; Gonzalez1996 (K d^n as a discrete gradient, where the scheme's force acts inside the step).
    """

    citations = ("HuntCrossley1975", "Gonzalez1996")

    def hysteresis(self) -> float:
        return 1.5 * (1.0 - self.restitution)


@final
@dataclass(frozen=True)
class LankaraniNikravesh(AbstractHystereticLaw):
    """Lankarani and Nikravesh: F = K d^n (1 + a d'), a = 0.75(1-e^2)/v0.

    v0 is the approach speed at the touch. The restitution e is nominal: a mass on a wall returns faster.

    References
    ----------
    LankaraniNikravesh1990; Gonzalez1996 (K d^n as a discrete gradient, where the scheme's force acts inside the step).
    """

    citations = ("LankaraniNikravesh1990", "Gonzalez1996")

    def hysteresis(self) -> float:
        return 0.75 * (1.0 - self.restitution**2)


@final
@dataclass(frozen=True)
class Flores(AbstractHystereticLaw):
    """Flores and others: F = K d^n (1 + a d'), also for soft contacts.

    a v0 = 8 (1 - e)/(5 e), with v0 the approach speed at the touch. The restitution e is nominal: a mass on a wall
    returns somewhat slower.

    References
    ----------
    FloresMachadoSilvaMartins2011; Gonzalez1996 (K d^n as a discrete gradient, where the scheme's force acts inside
    the step).
    """

    citations = ("FloresMachadoSilvaMartins2011", "Gonzalez1996")

    def hysteresis(self) -> float:
        return 1.6 * (1.0 - self.restitution) / self.restitution
