"""Checks of a model's array shapes, as compiled code reads arrays without checking their bounds."""

from __future__ import annotations

import numpy as np

from impactlab.errors import PairingError
from impactlab.models.base import Operators
from impactlab.types import Array

BANDS = frozenset(("mass", "damping", "stiffness"))
OPTIONAL = frozenset(("ground_springs", "ground_dashpots", "end_dashpots", "momentum"))
ARRAYS = ("mass", "damping", "stiffness", "load", "displacement", "velocity", *sorted(OPTIONAL))
FLOAT = np.dtype(float)


def check_operators(body: str, system: Operators) -> None:
    """Raise `PairingError` unless a body's arrays agree in their coordinates.

    `Operators` states their shapes.
    """
    n_dof = np.size(system.load)
    for name in ARRAYS:
        array = getattr(system, name)
        if array is None and name in OPTIONAL:
            continue
        if not isinstance(array, np.ndarray) or array.dtype != FLOAT:
            raise _fault(f"`{name}` in the operators of '{body}' is {_shown(array)}, and must be an array of floats")
        shape, banded = array.shape, name in BANDS
        if (len(shape) != 2 or shape[0] == 0 or shape[1] != n_dof) if banded else shape != (n_dof,):
            allowed = f"(bandwidth + 1, {n_dof})" if banded else f"({n_dof},)"
            text = f"`{name}` in the operators of '{body}' has the shape {shape}, and the load {n_dof} entries"
            raise _fault(f"{text}. Allowed: {allowed}")


def checked_row(body: str, row: Array, n_dof: int, method: str = "row") -> Array:
    """Return a row over the coordinates of a body.

    Raises `PairingError` unless it is an array of the shape (n_dof,).
    """
    if not isinstance(row, np.ndarray) or row.shape != (n_dof,):
        given = f"the shape {row.shape}" if isinstance(row, np.ndarray) else _shown(row)
        text = f"`{method}` of the model of '{body}' returned {given}, and the body has {n_dof} coordinates"
        raise _fault(f"{text}. Allowed: an array of the shape ({n_dof},)")
    return row


def _shown(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype}"
    return "None" if value is None else f"a {type(value).__name__}"


def _fault(text: str) -> PairingError:
    return PairingError(text, remedy="This is a fault of the model, not of the case: fix its body.", path="solve.model")
