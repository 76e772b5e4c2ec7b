"""The stated error of a chosen run beside its error against a reference."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from impactlab.history.base import AbstractHistory, Warned
from impactlab.refine.references.reference_record import Reference
from impactlab.scene.method import Counted

METRICS: Mapping[Counted, tuple[str, ...]] = {
    "displacements": ("mass_displacement", "face_displacement"),
    "impulses": ("impulse",),
    "peak_forces": ("peak_force",),
}
"""Metrics of the quantities that a tolerance bounds."""


def measured_error(errors: Mapping[str, Any], reference: Reference, on: Sequence[Counted]) -> float | None:
    """Return the largest error in the quantities that count, less the uncertainty of the reference.

    Parameters
    ----------
    errors : mapping
        Metrics against the reference by name; None where a metric has no value.
    reference : Reference
        Gives the uncertainties of the metrics.
    on : sequence of str
        Quantities that count, as in `impactlab.scene.method.Tolerance`.

    Returns
    -------
    float or None
        None where no metric has a value.
    """
    found = [
        max(0.0, errors[name] - reference.uncertainties.get(name, reference.uncertainty))
        for counted in on
        for name in METRICS[counted]
        if errors.get(name) is not None
    ]
    return max(found, default=None)


def set_measured_error(history: AbstractHistory, measured: float | None) -> None:
    """Set the measured error of a chosen run; warn where it exceeds the stated one."""
    choice = history.choice
    if choice is None or measured is None or choice.measured_error == measured:
        return
    history.choice = dataclasses.replace(choice, measured_error=measured)
    if measured <= choice.expected_error:
        return
    both = f"the error against the reference is {measured:.2g}, and {choice.expected_error:.2g} was stated"
    if measured <= choice.tolerance:
        history.warnings.insert(0, Warned("stated_error", f"{both}: the estimate was too small"))
    elif choice.met:
        text = f"{both}: the tolerance {choice.tolerance:g} is not met"
        history.warnings.insert(0, Warned("tolerance_not_met", text))
