"""Schemes in time. Whoever writes one imports from here."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from impactlab.integrators.base import AbstractAdaptive, AbstractIntegrator, Problem, Step, Stepper
    from impactlab.integrators.packing import springs_of
    from impactlab.models.base import Operators
    from impactlab.numerics.banded_kernels import in_springs, pull

__all__ = [
    "AbstractAdaptive",
    "AbstractIntegrator",
    "Operators",
    "Problem",
    "Step",
    "Stepper",
    "in_springs",
    "pull",
    "springs_of",
]

_HOMES = dict.fromkeys(__all__, "impactlab.integrators.base") | {
    "Operators": "impactlab.models.base",
    "in_springs": "impactlab.numerics.banded_kernels",
    "pull": "impactlab.numerics.banded_kernels",
    "springs_of": "impactlab.integrators.packing",
}


def __getattr__(name: str) -> Any:
    # Loaded on first use: a case is read without compiled code.
    if name not in _HOMES:
        raise AttributeError(f"module 'impactlab.integrators' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
