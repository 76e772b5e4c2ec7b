"""All families of random cases by name."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from studies.audit import scenes, smooth_scenes
from studies.audit.scenes import TOLERANCES, Doc, Drawn, Random

FAMILIES: dict[str, Callable[[Random, float], Doc]] = {
    "exact": lambda rng, tolerance: scenes.on_rods(rng, scenes.hard_or_spring, tolerance),
    "power_law": lambda rng, tolerance: scenes.on_rods(rng, scenes.power_on_rods, tolerance),
    "rigid": lambda rng, tolerance: scenes.rigid(rng, scenes.compliant, tolerance),
    "dashpot": scenes.dashpot,
    "damped": smooth_scenes.damped,
    "beam": smooth_scenes.beam,
}
FIXED = {"scan": scenes.scan, "scan_rods": scenes.scan_rods}  # the same whatever the seed


def draw(family: str, seed: int, number: int) -> Drawn:
    """Return one case of a family; the tolerances take turns."""
    rng = np.random.default_rng([seed, number, *family.encode()])
    return Drawn(family, number, FAMILIES[family](rng, TOLERANCES[number % len(TOLERANCES)]))
