"""The run of a scene: pairing, the plan, the driver, and the checks of a finished history."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from impactlab.simulate.driver import Plan, Progress, prepare, run

__all__ = ["Plan", "Progress", "prepare", "run"]


def __getattr__(name: str) -> Any:
    # Loaded on first use: rooms below import `impactlab.simulate.pairing` without the step loop.
    if name not in __all__:
        raise AttributeError(f"module 'impactlab.simulate' has no attribute {name!r}")
    return getattr(import_module("impactlab.simulate.driver"), name)
