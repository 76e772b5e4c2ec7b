"""A contact in an adaptive run: its law and state at one instant."""

from __future__ import annotations

import ctypes
from typing import Any

from impactlab.contact.base import AbstractContactLaw
from impactlab.simulate.planning.preparation import law_raised
from impactlab.simulate.stepping.ports import fill_instant
from impactlab.types import MEMORY, Port, Reply, Start

OVERFLOW = 1e150  # N or J: no step that meets it is accepted, and its square is still a number


def memory_of(record: Any) -> int:
    """Return the address of the memory of a port or a reply."""
    return int(ctypes.addressof(record) + type(record).memory.offset)


class LawFailed(Exception):  # noqa: N818 - it never leaves the package
    """A law failed or raised."""


class InstantContact:
    """One contact: open or closed, with its law's memory.

    The law is evaluated at one instant: all gaps and rates of the port are those of it, and compliances are zero. While
    the contact is closed its force is the trial force, which is smooth beyond the opening; the power lost is
    (F - F(rate = 0)) d', with d' the rate of indentation. Where a contact opens before it is relaxed, F = 0 and the
    same formula is the fall of the stored energy as the law follows the face.
    """

    def __init__(self, law: AbstractContactLaw, contact: str, start: Start, dt: float) -> None:
        self.port, self.reply = Port(), Reply()
        self.port.dt = dt
        self.port.parameters[: len(start.parameters)] = [*start.parameters]
        self.port.memory[: len(start.memory)] = [*start.memory]
        self.closed, self.held = False, 0.0
        self._law, self._name = law, contact
        self._respond, self._why_failed = type(law).respond, law.why_failed
        self._kept, self._replied = memory_of(self.port), memory_of(self.reply)

    def evaluate(self, gap: float, rate: float) -> Reply:
        """Return the reply at a gap [m] and rate [m/s], valid until the next call.

        A trial stage of a step that is far too long may reach an overlap whose force overflows: it is then `OVERFLOW`,
        so that the solver rejects the step and takes a shorter one.
        """
        port, reply = self.port, self.reply
        fill_instant(port, gap, rate)
        port.in_contact = 1.0 if self.closed else 0.0
        ctypes.memset(ctypes.addressof(reply), 0, ctypes.sizeof(reply))
        ctypes.memmove(self._replied, self._kept, 8 * MEMORY)
        try:
            self._respond(port, reply)
        except OverflowError:
            reply.force = reply.trial = reply.stored = OVERFLOW
        except Exception as raised:
            raise LawFailed(law_raised(self._law, self._name, raised)) from raised
        if reply.failed:
            raise LawFailed(self._why_failed)
        return reply

    def force_and_loss(self, gap: float, rate: float) -> tuple[float, float]:
        """Return force [N] and power lost [W]; zero in an open contact (see `released`)."""
        if not self.closed:
            return 0.0, 0.0
        elastic, force = self.evaluate(gap, 0.0).trial, self.evaluate(gap, rate).trial
        return force, (elastic - force) * rate

    def stored(self, gap: float) -> float:
        """Return the energy [J] that the contact stores, closed or not."""
        return float(self.evaluate(gap, 0.0).stored) if gap < 0.0 else 0.0

    def released(self, gap: float) -> float:
        """Return the energy [J] lost since the opening, as the law follows the face."""
        return 0.0 if self.closed else max(0.0, self.held - self.stored(gap))

    def carry(self, gap: float, rate: float) -> None:
        """Keep the memory of the law at an accepted instant."""
        self.evaluate(gap, rate)
        ctypes.memmove(self._kept, self._replied, 8 * MEMORY)

    def close(self, gap: float, rate: float, away: float) -> None:
        """Begin a contact: faces that met at zero gap were apart, by ``away`` [m], before."""
        if gap > -away:
            self.carry(away, rate)
            gap = 0.0
        self.carry(gap, rate)
        self.closed, self.held = True, 0.0

    def open(self, gap: float, rate: float) -> None:
        """End a contact, at a gap [m] and rate [m/s]."""
        self.held = self.stored(gap)
        self.carry(gap, rate)
        self.closed = False
