"""Modes that a run leaves out: their flexibility at contacts, and the errors that runs with as many modes share."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

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

FASTEST = 3.0  # rad in a step, of static shapes that follow a force which is constant over each step
FINER = 1.05  # of a number of modes that is sought
UNRESOLVED = 2.0  # times as much as without the shapes is missing where they are faster, at most
SWINGS = 25.0  # times the square of the share of a force that rises in their time, as it sets them swinging: measured
NEXT = 1.7  # frequency of the modes left out together, over that of the last one kept


class Lag(NamedTuple):
    """Modes whose static shapes a run has: of fast ones no more than their vibrations behind the force are missing."""

    bends: float  # rad/s, of the first mode: the n-th has n^2 of it
    shears: float  # rad/s, at most n of it; inf where nothing shears
    most: float  # rad/s, of the shapes
    least: float  # rad/s, beyond which modes are fast
    lasting: float = 1.0  # factor, as vibrations go on where the force has ended

    def left(self, modes: float, dt: float) -> float:
        """Return which share of the flexibility beyond so many modes is missing under steps of dt [s]."""
        last = min(self.bends * modes * modes, self.shears * modes)
        if min(NEXT * last, self.most) * dt > FASTEST:
            return UNRESOLVED
        behind = self.least / min(last, self.most)
        return self.lasting * max(behind, SWINGS * behind * behind)


class Share(NamedTuple):
    """Error factor / n^power of a run with n modes, or the share of it by ``lag``."""

    factor: float
    power: float
    lag: Lag | None = None  # None where static shapes are left out, too

    def at(self, modes: float, dt: float = 0.0) -> float:
        """Return the error with so many modes, under steps of dt [s]."""
        whole = float(self.factor / modes**self.power)
        return whole if self.lag is None else whole * self.lag.left(modes, dt)

    def magnified(self, factor: float) -> Share:
        """Return an error so many times as large."""
        return self._replace(factor=factor * self.factor)

    def modes_for(self, error: float, dt: float = 0.0) -> float:
        """Return about the least number of modes that leave an error."""
        most = math.pow(self.factor / error, 1.0 / self.power)
        if self.lag is None or most <= 1.0:
            return most
        least = 1.0
        while least < most and self.at(least, dt) > error:
            least *= FINER
        return min(least, most)


class LeftOut(NamedTuple):
    """Flexibility of the modes of a beam beyond n at a contact, factor / n^power [m/N]."""

    contact: Contact
    stiffness: float  # N/m, of the contact; NaN where it is not known
    channel: str  # displacement of the beam there
    factor: float
    power: float
    between: float  # factor where modes that turn sections lie between those that shear them
    lag: Lag | None = None  # where a run has their static shapes


def left_out(request: Simulation, fastest: float | None = None) -> Iterator[LeftOut]:
    """Give the flexibility beyond n modes at every contact of a beam: by bending, and by shear.

    At the middle of a pinned beam it is 2 L^3/(3 pi^4 EI n^3) by bending, and L/(pi^2 kGA n) by shear as long as the
    modes lie below the cut-off frequency. Above it modes that turn sections lie between those that shear them: of n,
    c0/(c0 + cs) shear, with c0 = sqrt(EI/(rho I)) and cs = sqrt(kGA/(rho A)). At an end that may move, where all modes
    have twice the amplitude of their waves inside, it is twice as much.

    With ``fastest`` [rad/s] a run has the static shapes of the modes left out, at most so fast
    (`impactlab.models.modal.Modal.residual`). Of modes that are fast beside the rise of the force, and stiffer than the
    contact, no more than their vibrations are missing, a share 1/(w rise).
    """
    beams, times = {beam.name: beam for beam in beams_of(request.scene)}, times_of(*request)
    for contact in request.scene.contacts:
        for point in contact.faces:
            body = beams.get(point.body)
            if body is None:
                continue
            name, k = body.face_channel(point.x), times[contact.name].tangent
            soft = min(segment.bending_stiffness for segment in body.segments)
            here = 2.0 if _is_loose(body, point.x) else 1.0
            lag = None if fastest is None else _lag(body, times[contact.name].rise, fastest)
            bends = here * 2.0 * body.length**3 / (3.0 * math.pi**4 * soft)
            yield LeftOut(contact, k, name, bends, 3.0, 1.0, _beyond(lag, math.pow(k * bends, 1.0 / 3.0)))
            if body.theory == "timoshenko":
                shears = here * body.length / (math.pi**2 * min(segment.shear_stiffness for segment in body.segments))
                between = max(
                    math.sqrt(s.shear_stiffness * s.rotary_inertia / (s.density * s.area * s.bending_stiffness))
                    for s in body.segments
                )
                yield LeftOut(contact, k, name, shears, 1.0, 1.0 + between, _beyond(lag, k * shears))


def _lag(beam: Beam, rise: float, most: float) -> Lag:
    """Return the lag of modes behind a force that rises in a time [s]; below the cut-off as if nothing sheared."""
    number, shears = math.pi / beam.length, math.inf
    bends = number**2 * min(math.sqrt(s.bending_stiffness / (s.density * s.area)) for s in beam.segments)
    if beam.theory == "timoshenko":  # modes that shear and modes that turn sections: so many below a frequency
        shears = number * min(1.0 / (1.0 / s.shear_speed + 1.0 / s.wave_speed) for s in beam.segments)
    return Lag(bends, shears, most, max(1.0 / rise, bends))


def _beyond(lag: Lag | None, modes: float) -> Lag | None:
    """Return a lag whose fast modes lie beyond a number of modes, whose flexibility is that of the contact, too."""
    if lag is None:
        return None
    return lag._replace(least=max(lag.least, min(lag.bends * modes * modes, lag.shears * modes)))


def _is_loose(beam: Beam, x: float) -> bool:
    """Return whether a place is an end of a beam that nothing stiff or heavy holds."""
    ends = [end for at, end in ((0.0, beam.left), (beam.length, beam.right)) if at == x]
    return any(end.kind in ("free", "spring", "dashpot") for end in ends)


def beside_contacts(places: Sequence[LeftOut]) -> list[Share]:
    """Return the errors by the flexibility left out beside that of the contact, with which it stands in series.

    Measured, the errors are 0.1 to 1.2 of it. Contacts whose stiffness is not known are left out.
    """
    found = [Share(each.factor * each.stiffness, each.power, each.lag) for each in places]
    return [share for share in found if share.factor > 0.0]


def beside_displacements(places: Sequence[LeftOut], scene: Scene, history: AbstractHistory) -> list[Share]:
    """Return the errors of the displacements of beams at contacts: the flexibility left out under the forces of a run.

    A stiff beam under a soft contact moves so little that this is far more than the share of the contact's own.
    """
    sizes = dict[str, float]()
    touched, raw = touched_in(history), records_of(history)
    moving = moving_frames(scene, touched)
    numbers = {contact.name: number for number, contact in enumerate(scene.contacts)}
    found: list[Share] = []
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
            factor, lag = each.between * each.factor * sizes[name] / sizes[channel], each.lag
            if lag is not None:  # static flexibility acts as long as the force, and vibrations go on
                lag = lag._replace(lasting=math.sqrt(scene.duration / _closed(scene, history, name)))
            found.append(Share(factor, each.power, lag))
    return found


def _closed(scene: Scene, history: AbstractHistory, contact: str) -> float:
    """Return how long a contact was closed in a run [s], at least a thousandth of it."""
    closed = sum((scene.duration if span.end is None else span.end) - span.start for span in history.spans(contact))
    return max(closed, 1e-3 * scene.duration)


def total(shares: Sequence[Share], modes: int, dt: float = 0.0) -> float:
    """Return the sum of the errors with so many modes, under steps of dt [s]."""
    return sum(share.at(modes, dt) for share in shares)
