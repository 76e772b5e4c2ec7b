"""Laws that do not declare what they are, so that the exact solver leaves them to the delay line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import final

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.energy_conserving import EnergyConserving
from impactlab.types import SideFacts, Start


@cache
def asked(law: AbstractContactLaw) -> AbstractContactLaw:
    """Return a law that is evaluated step by step and does the same; `addition_deletion` as one without impulses."""
    inner = EnergyConserving() if isinstance(law, AdditionDeletion) else law

    @final
    @dataclass(frozen=True)
    class Asked(AbstractContactLaw):
        """A law under another name."""

        needs = inner.needs
        two_sided = inner.two_sided

        def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
            return inner.begin(left, right, dt)

        def set_of(self, memory: Sequence[float]) -> float | None:
            return inner.set_of(memory)

        respond = staticmethod(type(inner).respond)

    return Asked()
