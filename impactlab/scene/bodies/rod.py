"""Rods: elastic bodies that move along their axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.scene.bodies.base import WaveBody


@final
@dataclass(frozen=True)
class Rod(WaveBody):
    """A straight elastic rod: it moves along its axis."""

    kind = "rod"
