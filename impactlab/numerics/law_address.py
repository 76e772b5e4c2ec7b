"""Addresses of contact laws, compiled or as callbacks into Python.

A callback keeps the errors of a law in plain Python.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from operator import attrgetter
from typing import Any

from impactlab.numerics.addresses import COMPILED, RESPOND, compiled, plain_address
from impactlab.types import Port, Reply


class LawAddress:
    """The address of a law's `respond`, and the objects it needs.

    These must live as long as it may be called. A law that stays plain Python is called back; its exception is kept in
    ``raised`` and the reply marked failed.
    """

    def __init__(self, respond: Callable[[Any, Any], None], as_compiled: bool) -> None:
        self.raised: Exception | None = None
        self._keep: Any = None
        if COMPILED and as_compiled:
            self.value = int(compiled(respond, RESPOND).address)
            return

        def guarded(port: Port, reply: Reply) -> None:
            try:
                respond(port, reply)
            except Exception as raised:  # noqa: BLE001 - carried out of the loop, raised there as StepError
                self.raised = raised
                reply.failed = 1.0

        if COMPILED:
            known: dict[int, Any] = {}  # by address: the loop gives the same records in every step

            def called(port: int, reply: int) -> None:
                if port not in known:
                    known[port] = at_hand(PortAtHand, port)
                if reply not in known:
                    known[reply] = at_hand(ReplyAtHand, reply)
                guarded(known[port], known[reply])

            self._keep = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(called)
            self.value = int(ctypes.cast(self._keep, ctypes.c_void_p).value or 0)
        else:
            self.value = plain_address(guarded)


def held(kind: type[ctypes.Structure], name: str) -> Any:
    """Return a property for a record or array field.

    Its object is made once.
    """
    return property(attrgetter(f"_{name}"), getattr(kind, name).__set__)


class PortAtHand(Port):
    """A port whose sides and arrays are made once.

    Making them at every access dominates the time of plain Python.
    """

    left, right = held(Port, "left"), held(Port, "right")
    readings, memory, parameters = held(Port, "readings"), held(Port, "memory"), held(Port, "parameters")


class ReplyAtHand(Reply):
    """A reply whose memory is made once."""

    memory = held(Reply, "memory")


def at_hand(kind: type[ctypes.Structure], address: int) -> Any:
    """Return the record at an address of the running loop."""
    record = kind.from_address(address)
    for name, made in vars(kind).items():
        if isinstance(made, property):
            setattr(record, f"_{name}", getattr(kind.__base__, name).__get__(record))
    return record
