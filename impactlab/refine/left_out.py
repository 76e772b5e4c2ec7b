"""Modes that a run leaves out: their flexibility at contacts, and the errors that runs with as many modes share."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from impactlab.history.base import AbstractHistory
from impactlab.history.frame import touched_in
from impactlab.metrics.norms import ZERO
from impactlab.refine.contact_times import times_of
from impactlab.refine.moving_frames import CELLS, moving_frames, norm
from impactlab.refine.raw_records import records_of
from impactlab.scene.bodies import Beam
from impactlab.scene.facts import beams_of
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Contact, Scene


class Share(NamedTuple):
    """Error factor / n^power of a run with n modes."""

    factor: float
    power: float

    def at(self, modes: int) -> float:
        """Return the error with so many modes."""
        return float(self.factor / modes**self.power)

    def magnified(self, factor: float) -> Share:
        """Return an error so many times as large."""
        return Share(factor * self.factor, self.power)

    def modes_for(self, error: float) -> float:
        """Return the number of modes that leave an error."""
        return math.pow(self.factor / error, 1.0 / self.power)


class LeftOut(NamedTuple):
    """Flexibility of the modes of a beam beyond n at a contact, factor / n^power [m/N]."""

    contact: Contact
    stiffness: float  # N/m, of the contact; NaN where it is not known
    channel: str  # displacement of the beam there
    factor: float
    power: float
    between: float  # factor where modes that turn sections lie between those that shear them


def left_out(asked: Simulation) -> Iterator[LeftOut]:
    """Give the flexibility beyond n modes at every contact of a beam: by bending, and by shear.

    At the middle of a pinned beam it is 2 L^3/(3 pi^4 EI n^3) by bending, and L/(pi^2 kGA n) by shear as long as the
    modes lie below the cut-off frequency. Above it modes that turn sections lie between those that shear them: of n,
    c0/(c0 + cs) shear, with c0 = sqrt(EI/(rho I)) and cs = sqrt(kGA/(rho A)). At an end that may move, where all modes
    have twice the amplitude of their waves inside, it is twice as much.
    """
    beams, times = {beam.name: beam for beam in beams_of(asked.scene)}, times_of(*asked)
    for contact in asked.scene.contacts:
        for point in contact.faces:
            body = beams.get(point.body)
            if body is None:
                continue
            known = contact, times[contact.name].tangent, body.face_channel(point.x)
            soft = min(segment.bending_stiffness for segment in body.segments)
            here = 2.0 if _is_loose(body, point.x) else 1.0
            yield LeftOut(*known, here * 2.0 * body.length**3 / (3.0 * math.pi**4 * soft), 3.0, 1.0)
            if body.theory == "timoshenko":
                shear = min(segment.shear_stiffness for segment in body.segments)
                between = max(
                    math.sqrt(s.shear_stiffness * s.rotary_inertia / (s.density * s.area * s.bending_stiffness))
                    for s in body.segments
                )
                yield LeftOut(*known, here * body.length / (math.pi**2 * shear), 1.0, 1.0 + between)


def _is_loose(beam: Beam, x: float) -> bool:
    """Return whether a place is an end of a beam that nothing stiff or heavy holds."""
    ends = [end for at, end in ((0.0, beam.left), (beam.length, beam.right)) if at == x]
    return any(end.kind in ("free", "spring", "dashpot") for end in ends)


def beside_contacts(places: Sequence[LeftOut]) -> list[Share]:
    """Return the errors by the flexibility left out beside that of the contact, with which it stands in series.

    Measured, the errors are 0.1 to 1.2 of it. Contacts whose stiffness is not known are left out.
    """
    found = [Share(each.factor * each.stiffness, each.power) for each in places]
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
            found.append(Share(each.between * each.factor * sizes[name] / sizes[channel], each.power))
    return found


def total(shares: Sequence[Share], modes: int) -> float:
    """Return the sum of the errors with so many modes."""
    return sum(share.at(modes) for share in shares)
