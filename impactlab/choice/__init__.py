"""The automatic choice: the cheapest description of a scene that keeps a tolerance, and why."""

from __future__ import annotations

from impactlab.choice.record import Choice, Rung
from impactlab.choice.search import first_guess, run

__all__ = ["Choice", "Rung", "first_guess", "run"]
