"""Cases for tests: how a run in steps is solved and by which model, and the paper's mass on its rod."""

from __future__ import annotations

from typing import Any

import impactlab as il


def in_steps(duration: Any, integrator: Any, model: dict[str, Any] | None = None, **step: Any) -> dict[str, Any]:
    """Return the block ``solve`` of a run in steps; an integrator without options by its name.

    As in ``in_steps(1e-3, "newmark", mesh(20), dt=1e-6)``.
    """
    kind = integrator if isinstance(integrator, dict) else {"kind": integrator}
    return {"duration": duration, **({} if model is None else {"model": model}), "integrator": kind, "step": step}


def mesh(elements: int, mass: str | None = None) -> dict[str, Any]:
    """Return the block of a mesh with consistent masses, or others."""
    return {"kind": "finite_element", "elements": elements, **({} if mass is None else {"mass": mass})}


def struck_rod(
    law: dict[str, Any], solve: dict[str, Any], *, mass: float = 2.133, gap: float | None = None,
    rod: dict[str, Any] | None = None, **others: Any,
) -> il.Case:  # fmt: skip
    """Return the paper's case, a mass at 1 m/s on a clamped steel rod; ``rod`` has other keys of the rod."""
    material = {"young": 2.1e11, "density": 7900.0}
    keys = {"length": 0.3, "area": 9e-4, "material": material, "ends": {"right": "clamped"}, **(rod or {})}
    bodies = {"hammer": il.Mass(mass, velocity=1.0), "rod": il.Rod(**keys)}
    return il.Case(bodies=bodies, contacts=[il.Contact("hammer", "rod.left", law, gap=gap)], solve=solve, **others)


def run_case(**keys: Any) -> il.history.AbstractHistory:
    """Return the run of the case with these keys: bodies, contacts, solve ..."""
    return il.run(il.Case(**keys))
