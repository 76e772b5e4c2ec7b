"""Errors by the modes that a run leaves out, from their flexibility at contacts.

Runs with the same number of modes share this error, so that their differences do not show it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.power_law import AbstractHystereticLaw
from impactlab.history.base import AbstractHistory
from impactlab.history.frame import touched_in
from impactlab.metrics.norms import ZERO
from impactlab.refine.descriptions.contact_times import times_of
from impactlab.refine.errors.moving_frames import CELLS, moving_frames, norm
from impactlab.refine.errors.raw_records import records_of
from impactlab.scene.bodies import Beam
from impactlab.scene.facts import beams_of
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Contact, Scene

MAX_TURN = 3.0  # rad in a step, up to which a static shape follows a force that is constant over each step
UNRESOLVED_FACTOR = 2.0  # on the error without static shapes, where these turn by more in a step: a bound
VIBRATION_FACTOR = 25.0  # on the square of (1 / frequency / rise of the force), the vibration of a shape: measured
LEFT_OUT_RATIO = 1.7  # frequency of the static shape of the modes left out, over that of the last mode kept
MODES_RATIO = 1.05  # of neighbouring numbers of modes in a search for the least one


class StaticShapes(NamedTuple):
    """Static shapes that a run has in place of the modes left out.

    Only the vibrations of these are then missing.
    """

    bending: float  # rad/s, frequency of the first mode in bending; that of mode n is n^2 times it
    shear: float  # rad/s, the same in shear; that of mode n is at most n times it; inf without shear
    max_frequency: float  # rad/s, of the shapes
    min_fast: float  # rad/s, above which a mode follows the force quasi-statically
    lasting: float = 1.0  # factor for vibrations that go on after the force has ended

    def missing_share(self, modes: float, dt: float) -> float:
        """Return the missing share of flexibility beyond some modes at steps of dt [s]."""
        last = min(self.bending * modes * modes, self.shear * modes)
        if min(LEFT_OUT_RATIO * last, self.max_frequency) * dt > MAX_TURN:
            return UNRESOLVED_FACTOR
        ratio = self.min_fast / min(last, self.max_frequency)
        return self.lasting * max(ratio, VIBRATION_FACTOR * ratio * ratio)


class ModalError(NamedTuple):
    """Relative error by the modes left out of a run.

    With n modes it is factor / n^power, less with static shapes.
    """

    factor: float
    power: float
    shapes: StaticShapes | None = None

    def at(self, modes: float, dt: float = 0.0) -> float:
        """Return the error with a number of modes, under steps of dt [s]."""
        whole = float(self.factor / modes**self.power)
        return whole if self.shapes is None else whole * self.shapes.missing_share(modes, dt)

    def magnified(self, factor: float) -> ModalError:
        """Return the error times a factor."""
        return self._replace(factor=factor * self.factor)

    def modes_for(self, error: float, dt: float = 0.0) -> float:
        """Return about the fewest modes with at most this error at steps of dt [s]."""
        most = math.pow(self.factor / error, 1.0 / self.power)
        if self.shapes is None or most <= 1.0:
            return most
        low, high = -1, math.ceil(math.log(most) / math.log(MODES_RATIO))  # powers of it
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self.at(math.pow(MODES_RATIO, middle), dt) > error else (low, middle)
        return min(math.pow(MODES_RATIO, high), most)


class LeftOut(NamedTuple):
    """Flexibility factor / n^power of a beam's modes beyond the n-th at a contact [m/N]."""

    contact: Contact
    stiffness: float  # N/m, of the contact; NaN where it is not known
    channel: str  # displacement of the beam there
    factor: float
    power: float
    rotary: float  # factor: of n modes above the cut-off frequency of shear, n / rotary shear and the others rotate
    shapes: StaticShapes | None = None  # that the run has in their place


def left_out(request: Simulation, max_frequency: float | None = None) -> Iterator[LeftOut]:
    """Yield the flexibility of modes beyond n at each contact [m/N].

    Each contact of a beam has one by bending, and one by shear. At the middle of a pinned beam it is at most 2 L^3/(3
    pi^4 EI n^3) by bending (half of it, as every other mode has a node there), and L/(pi^2 kGA n) by shear below the
    cut-off frequency. Above it, of n modes c0/(c0 + cs) n shear the sections and the others rotate them, with
    c0 = sqrt(EI/(rho I)) and cs = sqrt(kGA/(rho A)). At an end that may move all modes have twice the amplitude of
    their waves inside, and the flexibility is twice as large.

    Parameters
    ----------
    request : Simulation
        The scene with its laws.
    max_frequency : float, optional
        Of the static shapes of the modes left out [rad/s], if the run has them
        (`impactlab.models.modal.Modal.residual`). Of modes that are fast beside the rise of the force, and stiffer
        than the contact, only the vibrations are then missing: a share of 1 / (frequency times rise).
    """
    beams, times = {beam.name: beam for beam in beams_of(request.scene)}, times_of(*request)
    for contact in request.scene.contacts:
        for point in contact.faces:
            body = beams.get(point.body)
            if body is None:
                continue
            name = body.face_channel(point.x)
            k = stiffened(request.method.laws[contact.name]) * times[contact.name].tangent
            soft = min(segment.bending_stiffness for segment in body.segments)
            at_end = 2.0 if is_loose(body, point.x) else 1.0
            shapes = None if max_frequency is None else _shapes(body, times[contact.name].rise, max_frequency)
            bending = at_end * 2.0 * body.length**3 / (3.0 * math.pi**4 * soft)
            yield LeftOut(contact, k, name, bending, 3.0, 1.0, _softer(shapes, math.pow(k * bending, 1.0 / 3.0)))
            if body.theory == "timoshenko":
                shear = at_end * body.length / (math.pi**2 * min(segment.shear_stiffness for segment in body.segments))
                rotary = max(
                    math.sqrt(s.shear_stiffness * s.rotary_inertia / (s.density * s.area * s.bending_stiffness))
                    for s in body.segments
                )
                yield LeftOut(contact, k, name, shear, 1.0, 1.0 + rotary, _softer(shapes, k * shear))


def stiffened(law: AbstractContactLaw) -> float:
    """Return the factor by which hysteresis raises a law's initial tangent.

    As a touch begins, K grows to K (1 + a v0).
    """
    if isinstance(law, AbstractHystereticLaw):
        return float((1.0 + law.hysteresis()) ** (2.0 / (law.exponent + 1.0)))
    return 1.0


def _shapes(beam: Beam, rise: float, max_frequency: float) -> StaticShapes:
    """Return the static shapes of a beam under a force that rises in a time [s]."""
    number, shear = math.pi / beam.length, math.inf
    bending = number**2 * min(math.sqrt(s.bending_stiffness / (s.density * s.area)) for s in beam.segments)
    if beam.theory == "timoshenko":  # modes that shear and modes that rotate sections: so many below a frequency
        shear = number * min(1.0 / (1.0 / s.shear_speed + 1.0 / s.wave_speed) for s in beam.segments)
    return StaticShapes(bending, shear, max_frequency, max(1.0 / rise, bending))


def _softer(shapes: StaticShapes | None, modes: float) -> StaticShapes | None:
    """Return static shapes whose fast modes begin at a number of modes.

    Those before it are softer than the contact.
    """
    if shapes is None:
        return None
    first = min(shapes.bending * modes * modes, shapes.shear * modes)
    return shapes._replace(min_fast=max(shapes.min_fast, first))


def is_loose(beam: Beam, x: float) -> bool:
    """Return whether a place is an end without stiff or heavy support."""
    ends = [end for at, end in ((0.0, beam.left), (beam.length, beam.right)) if at == x]
    return any(end.kind in ("free", "spring", "dashpot") for end in ends)


def beside_contacts(places: Sequence[LeftOut]) -> list[ModalError]:
    """Return the flexibility left out, relative to that of each contact.

    Both are in series. Measured errors are 0.1 to 1.2 of the ratio. Contacts whose stiffness is not known are omitted.
    """
    found = [ModalError(each.factor * each.stiffness, each.power, each.shapes) for each in places]
    return [error for error in found if error.factor > 0.0]


def beside_displacements(places: Sequence[LeftOut], scene: Scene, history: AbstractHistory) -> list[ModalError]:
    """Return errors by the flexibility left out, relative to displacements of beams.

    The absolute error is this flexibility times the contact force of a run; displacements are those at contacts. A
    stiff beam under a soft contact moves so little that this error is far larger than that of `beside_contacts`.
    """
    sizes = dict[str, float]()
    touched, raw = touched_in(history), records_of(history)
    moving = moving_frames(scene, touched)
    numbers = {contact.name: number for number, contact in enumerate(scene.contacts)}
    found: list[ModalError] = []
    for each in places:
        channel, name = each.channel, each.contact.name
        if channel not in sizes:
            if raw is not None and channel in raw.columns:
                (moved,) = raw.displacements([channel], CELLS)
            else:
                moved = history.evaluate(moving.t, channel)
            whole, own = norm(moved), norm(moved - moving.drift(channel))
            sizes[channel] = own if touched and own > ZERO * whole else whole
        if name not in sizes:
            sizes[name] = (
                norm(history.evaluate(moving.t, f"force:{name}"))
                if raw is None
                else raw.force(numbers[name], False).size(CELLS)
            )
        if sizes[channel] > 0.0 and sizes[name] > 0.0:
            factor, shapes = each.rotary * each.factor * sizes[name] / sizes[channel], each.shapes
            if shapes is not None:  # static flexibility acts as long as the force; vibrations go on after it
                shapes = shapes._replace(lasting=math.sqrt(scene.duration / _closed(scene, history, name)))
            found.append(ModalError(factor, each.power, shapes))
    return found


def _closed(scene: Scene, history: AbstractHistory, contact: str) -> float:
    """Return the time that a contact was closed in a run [s].

    It is at least a thousandth of the run.
    """
    closed = sum((scene.duration if span.end is None else span.end) - span.start for span in history.spans(contact))
    return max(closed, 1e-3 * scene.duration)


def total(errors: Sequence[ModalError], modes: int, dt: float = 0.0) -> float:
    """Return the sum of errors with a number of modes, under steps of dt [s]."""
    return sum(error.at(modes, dt) for error in errors)
