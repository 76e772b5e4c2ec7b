"""Blocks of cases for tests: how a run in steps is solved, and by which model."""

from __future__ import annotations

from typing import Any


def in_steps(duration: Any, integrator: Any, model: dict[str, Any] | None = None, **step: Any) -> dict[str, Any]:
    """Return the block ``solve`` of a run in steps; an integrator without options by its name.

    As in ``in_steps(1e-3, "newmark", mesh(20), dt=1e-6)``.
    """
    kind = integrator if isinstance(integrator, dict) else {"kind": integrator}
    return {"duration": duration, **({} if model is None else {"model": model}), "integrator": kind, "step": step}


def mesh(elements: int, mass: str | None = None) -> dict[str, Any]:
    """Return the block of a mesh with consistent masses, or others."""
    return {"kind": "finite_element", "elements": elements, **({} if mass is None else {"mass": mass})}
