"""Fitted parameters with their intervals, as records, text and files."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from impactlab.casefile import Case
from impactlab.types import Array


class Fitted(NamedTuple):
    """A fitted parameter in SI, with the ends of its 95 % interval."""

    path: str  # of the case; or ``shift of CHANNEL`` [s]
    value: float
    lower: float
    upper: float
    unit: str
    note: str = ""


@dataclass(frozen=True)
class Fit:
    """A case fitted to signals."""

    case: Case  # with the fitted values
    parameters: tuple[Fitted, ...]
    covariance: Array  # (parameters, parameters), of their logarithms where they are positive
    residuals: tuple[Array, ...]  # of each signal, over its noise
    noise: float  # standard deviation of the residuals, in units of the given noise
    autocorrelation: float  # of neighbouring residuals
    warnings: tuple[str, ...] = ()
    undetermined: tuple[str, ...] = field(default=())  # directions that the signals do not see
    cases: tuple[Case, ...] = ()  # of several experiments, with the fitted values; `case` is the first

    def __getitem__(self, path: str) -> Fitted:
        for each in self.parameters:
            if each.path == path:
                return each
        raise KeyError(path)

    @property
    def correlations(self) -> Array:
        """Correlations of the parameters, shape of the covariance."""
        size = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(size, size))

    def to_dict(self) -> dict[str, Any]:
        """Return plain values: None in place of NaN and infinity."""
        rows = [
            {
                key: None if isinstance(value, float) and not math.isfinite(value) else value
                for key, value in row.items()
            }
            for row in (each._asdict() for each in self.parameters)
        ]
        return {
            "schema_version": 1, "case": self.case.label, "parameters": rows, "noise": self.noise,
            "autocorrelation": self.autocorrelation, "warnings": list(self.warnings),
            "undetermined": list(self.undetermined),
        }  # fmt: skip

    def write(self, folder: str | Path) -> None:
        """Write ``fitted.yaml``, a case that runs (of more experiments ``fitted-2.yaml`` ...), and ``fit.json``."""
        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        for number, case in enumerate(self.cases or (self.case,), start=1):
            name = "fitted.yaml" if number == 1 else f"fitted-{number}.yaml"
            (path / name).write_text(case.to_yaml(), encoding="utf-8")
        (path / "fit.json").write_text(json.dumps(self.to_dict(), indent=1), encoding="utf-8")

    def __str__(self) -> str:
        rows = [("parameter", "value", "95 % between", "")]
        for each in self.parameters:
            between = f"{each.lower:.6g} and {each.upper:.6g}"
            rows.append((each.path, f"{each.value:.6g} {each.unit}".rstrip(), between, each.note))
        widths = [max(len(row[k]) for row in rows) for k in range(4)]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
        return "\n".join([*lines, *self.warnings, *self.undetermined])
