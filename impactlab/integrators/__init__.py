"""Time integrators: base class, records and kernels for those who write one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from impactlab.lazy import lazy_names

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

__getattr__ = lazy_names(  # a case is read without compiled code
    __name__,
    {
        "impactlab.integrators.base": ("AbstractAdaptive", "AbstractIntegrator", "Problem", "Step", "Stepper"),
        "impactlab.integrators.packing": ("springs_of",),
        "impactlab.models.base": ("Operators",),
        "impactlab.numerics.banded_kernels": ("in_springs", "pull"),
    },
)
