"""The schema of the table of a bench: one row per case, method and setting."""

from __future__ import annotations

import json
from collections.abc import Iterable
from functools import cache
from typing import Any, NamedTuple, get_type_hints

from impactlab.metrics.norms import ORDER

COMPLETED = "completed"
ENDED = (COMPLETED, "tolerance_not_met")  # with all their numbers
STATUSES = (*ENDED, "refused", "failed", "hung", "crashed")
BASE = "base"  # name of the scene that a case describes without a variant
OWN = "own."  # before the name of a method of a case: these differ from case to case, so they are not ranked


class Row(NamedTuple):
    """One run of one method at one setting on one scene.

    Its fields are the columns of the table, None an empty cell.

    Units: SI; errors are relative, those of event times in round trips.
    """

    key: str = ""
    suite: str = ""
    case: str = ""
    variant: str = ""
    method: str = ""
    level: str = ""
    settings: str = ""  # JSON: path to value
    model: str = ""
    basis: str = ""
    law: str = ""
    integrator: str = ""
    events: str = ""
    dt: float | None = None
    steps: int | None = None
    unknowns: int | None = None
    elements: int | None = None
    modes: int | None = None
    status: str = ""
    reason: str = ""
    remedy: str = ""
    reached_time: float | None = None
    reference: str = ""
    reference_uncertainty: float | None = None
    mass_displacement: float | None = None
    face_displacement: float | None = None
    force: float | None = None
    force_away_from_jumps: float | None = None
    force_graph: float | None = None
    impulse: float | None = None
    peak_force: float | None = None
    event_times: float | None = None
    events_missed: int | None = None
    events_extra: int | None = None
    displacement: float | None = None
    energy_initial: float | None = None
    energy_gain: float | None = None
    energy_loss: float | None = None
    energy_final_error: float | None = None
    momentum_error: float | None = None
    force_oscillation: float | None = None
    warnings: str = ""
    contacts: int | None = None
    events_found: int | None = None
    rhs_evaluations: int | None = None
    factorisations: int | None = None
    repeats: int | None = None
    setup_s: float | None = None
    setup_spread_s: float | None = None
    solve_s: float | None = None
    solve_spread_s: float | None = None
    tolerance_asked: float | None = None
    expected_error: float | None = None
    choosing_s: float | None = None
    round_trips: float | None = None
    code: str = ""
    machine: str = ""
    python: str = ""
    numpy: str = ""
    scipy: str = ""
    numba: str = ""

    @property
    def scene(self) -> str:
        """Return the name of the scene: ``case`` or ``case/variant``."""
        return self.case if self.variant in ("", BASE) else f"{self.case}/{self.variant}"

    @property
    def completed(self) -> bool:
        """Return whether the run came to its end."""
        return self.status in ENDED

    @property
    def stepless(self) -> bool:
        """Return whether the run went from event to event: no step, nothing to refine."""
        return self.completed and self.dt is None and not self.integrator

    @property
    def courant(self) -> float | None:
        """Return c dt/h of the settings; None where they set the step in another way."""
        return courant_of(self.settings)

    @property
    def special(self) -> bool:
        """Return whether dt = h/c, the special step.

        On a uniform rod waves then travel from node to node without any error.
        """
        return self.courant == 1.0

    @property
    def total_s(self) -> float | None:
        """Return the time to set up and solve [s]."""
        return None if self.solve_s is None else self.solve_s + (self.setup_s or 0.0)


NEEDED = ("case", "method", "status", "displacement", "impulse", "solve_s", "setup_s", "steps", "unknowns")
"""Columns that a table must have; others may be missing."""
FIELDS = get_type_hints(Row)
FURTHER = list(FIELDS).index("displacement")  # place of the columns of further metrics


def columns(metrics: Iterable[str]) -> tuple[str, ...]:
    """Return the columns of a table whose rows hold these metrics."""
    known, further = tuple(FIELDS), {name for name in metrics if name not in FIELDS}
    ordered = (*(name for name in ORDER if name in further), *sorted(further.difference(ORDER)))
    return (*known[:FURTHER], *ordered, *known[FURTHER:])


@cache
def settings_of(text: str) -> dict[str, Any]:
    """Return the column ``settings`` of a row, path to value; empty for no JSON object."""
    try:
        settings = json.loads(text or "{}")
    except ValueError:
        return {}
    return settings if isinstance(settings, dict) else {}


@cache
def courant_of(text: str) -> float | None:
    """Return c dt/h of the column ``settings`` of a row."""
    value = setting(settings_of(text), "solve.step.courant")
    return float(value) if isinstance(value, int | float) else None


def setting(block: Any, path: str) -> Any:
    """Return the value at a dotted path such as ``solve.step.courant``.

    The blocks may be nested in any way; None without a value.
    """
    if not isinstance(block, dict):
        return None
    if path in block:
        return block[path]
    inner = (setting(value, path[len(key) + 1 :]) for key, value in block.items() if path.startswith(f"{key}."))
    return next((value for value in inner if value is not None), None)
