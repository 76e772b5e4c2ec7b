"""A contact in an adaptive run: its law at one instant, and whether it is closed."""

from __future__ import annotations

import ctypes
from typing import NamedTuple

from impactlab.contact.base import AbstractContactLaw
from impactlab.types import MEMORY, PORT, REPLY, Port, Reply, Start

OVERFLOWN = 1e150  # N or J: no step that meets it is accepted, and its square is still a number


PORT_MEMORY = int(PORT.fields["memory"][1])  # type: ignore[index] # bytes from the start of the record
REPLY_MEMORY = int(REPLY.fields["memory"][1])  # type: ignore[index]


class LawFailed(Exception):  # noqa: N818 - it never leaves the package
    """A law failed or raised."""


class Answer(NamedTuple):
    """Force, loss and stored energy of a contact at one instant."""

    force: float  # N; while closed its signed trial, which goes on smoothly beyond the opening
    power: float  # W, lost
    stored: float  # J


class Touch:
    """One contact: open or closed, with its law's memory.

    The law is evaluated at one instant: all gaps and rates of the port are those of it, and compliances are zero. While
    the contact is closed its force is the trial force; the power lost is (F - F(rate = 0)) d', with d' the rate of
    indentation. Where a contact opens before it is relaxed, F = 0 and the same formula is the fall of the stored energy
    as the law follows the face.
    """

    def __init__(self, law: AbstractContactLaw, start: Start, dt: float) -> None:
        self.port, self.reply = Port(), Reply()
        self.port.dt, self.port.first_weight = dt, 1.0
        self.port.parameters[: len(start.parameters)] = [*start.parameters]
        self.port.memory[: len(start.memory)] = [*start.memory]
        self.closed, self.held = False, 0.0
        self._respond, self._why_failed = type(law).respond, law.why_failed
        self._remembered = ctypes.addressof(self.port) + PORT_MEMORY

    def ask(self, gap: float, rate: float) -> Reply:
        """Return the reply of the law at a gap [m] and its rate [m/s]; the next call overwrites the record.

        A trial stage of a step that is far too long may reach an overlap whose force overflows: it is then `OVERFLOWN`,
        so that the solver rejects the step and takes a shorter one.
        """
        port, reply = self.port, self.reply
        port.gap = port.free_gap = port.acting_gap = port.first_gap = port.last_gap = port.travel_start = gap
        port.gap_rate = port.free_gap_rate = port.acting_rate = rate
        port.in_contact = 1.0 if self.closed else 0.0
        ctypes.memset(ctypes.addressof(reply), 0, ctypes.sizeof(reply))
        ctypes.memmove(ctypes.addressof(reply) + REPLY_MEMORY, self._remembered, 8 * MEMORY)
        try:
            self._respond(port, reply)
        except OverflowError:
            reply.force = reply.trial = reply.stored = OVERFLOWN
        except Exception as raised:
            raise LawFailed(f"a contact law raised {type(raised).__name__}: {raised}") from raised
        if reply.failed:
            raise LawFailed(self._why_failed)
        return reply

    def answer(self, gap: float, rate: float) -> Answer:
        """Return force, lost power and stored energy; zero where the contact is open (see `released`)."""
        if not self.closed:
            return Answer(0.0, 0.0, 0.0)
        at_rest = self.ask(gap, 0.0)
        elastic, stored = at_rest.trial, at_rest.stored
        force = self.ask(gap, rate).trial
        return Answer(force, (elastic - force) * rate, stored)

    def stored(self, gap: float) -> float:
        """Return the energy [J] that the contact stores, closed or not."""
        return float(self.ask(gap, 0.0).stored) if gap < 0.0 else 0.0

    def released(self, gap: float) -> float:
        """Return the energy [J] lost since the opening, as the law follows the face."""
        return 0.0 if self.closed else max(0.0, self.held - self.stored(gap))

    def carry(self, gap: float, rate: float) -> None:
        """Keep the memory of the law at an accepted instant."""
        self.ask(gap, rate)
        ctypes.memmove(self._remembered, ctypes.addressof(self.reply) + REPLY_MEMORY, 8 * MEMORY)

    def close(self, gap: float, rate: float, away: float) -> None:
        """Begin a contact: faces that met at zero gap were apart, by ``away`` [m], before."""
        if gap > -away:
            self.carry(away, rate)
            gap = 0.0
        self.carry(gap, rate)
        self.closed, self.held = True, 0.0

    def open(self, gap: float, rate: float) -> None:
        """End a contact."""
        self.held = self.stored(gap)
        self.carry(gap, rate)
        self.closed = False
