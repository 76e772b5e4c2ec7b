"""The body of a mechanism that a class describes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.mechanisms.base import AbstractMechanism, Reading
from impactlab.scene.bodies import MechanismBody
from impactlab.types import Quantity


@final
@dataclass(frozen=True)
class PartMechanism(MechanismBody):
    """A mechanism that a class describes, by its name in a case."""

    part: AbstractMechanism

    @property
    def moving_mass(self) -> float:
        return self.part.mass

    @property
    def readings(self) -> tuple[Reading, ...]:
        """Parameters read by its class, in order."""
        return self.part.readings

    @property
    def recorded(self) -> tuple[tuple[str, float, Quantity], ...]:
        found: list[tuple[str, float, Quantity]] = []
        for number, reading in enumerate(self.readings):
            value, rate = ("angle", "rate") if reading.is_angle else ("position", "velocity")
            place = f"{self.name}.{reading.name}"
            found += [(f"{value}:{place}", number, "displacement"), (f"{rate}:{place}", number, "velocity")]
        return tuple(found)

    def face_channel(self, x: float) -> str:
        return f"position:{self.name}.{self.readings[int(x)].name}"
