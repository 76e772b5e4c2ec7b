"""Time integrators: base class, records and kernels for authors of one.

AbstractIntegrator  base class of schemes with fixed steps
AbstractAdaptive    base class of schemes that choose their own steps
Step                a scheme for one body and one step length, as its author writes it
Stepper             a prepared step with its response columns
Problem             a first-order system y' = rates(t, y), as an adaptive scheme gets it
Operators           mass, damping and stiffness of a body, as a scheme gets them
springs_of          a stiffness as springs: to the ground, then the bands below its diagonal
pull                forces of springs at given displacements, subtracted
in_springs          x K y/2 of springs: their energy
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from impactlab.startup.lazy import lazy_names, public_names

if TYPE_CHECKING:
    from impactlab.integrators.base import AbstractAdaptive, AbstractIntegrator, Problem, Step, Stepper
    from impactlab.integrators.flat_matrices import springs_of
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
        "impactlab.integrators.base": "AbstractAdaptive AbstractIntegrator Problem Step Stepper",
        "impactlab.integrators.flat_matrices": "springs_of",
        "impactlab.models.base": "Operators",
        "impactlab.numerics.banded_kernels": "in_springs pull",
    },
)
__dir__ = public_names(__all__)
