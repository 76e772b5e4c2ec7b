"""The run of a scene: pairing, plan, driver, and checks of its history."""

from __future__ import annotations

from typing import TYPE_CHECKING

from impactlab.startup.lazy import lazy_names, public_names

if TYPE_CHECKING:
    from impactlab.simulate.driver import run
    from impactlab.simulate.plan import Plan, prepare

__all__ = ["Plan", "prepare", "run"]

# Packages below import `impactlab.simulate.planning.pairing` without the step loop.
__getattr__ = lazy_names(__name__, {"impactlab.simulate.driver": "run", "impactlab.simulate.plan": "Plan prepare"})
__dir__ = public_names(__all__)
