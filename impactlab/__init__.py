"""Impacts on flexible rods: models, contact laws and integrators, compared on cases with exact answers."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from impactlab.environment import check_environment

if TYPE_CHECKING:
    from impactlab.api import Comparison, compare, run
    from impactlab.casefile import Case, load_case
    from impactlab.errors import CaseError, ImpactlabError, PairingError, PluginError, StepError

__version__ = "0.1.0"

__all__ = [
    "Case",
    "CaseError",
    "Comparison",
    "ImpactlabError",
    "PairingError",
    "PluginError",
    "StepError",
    "compare",
    "load_case",
    "run",
]

_HOMES = {
    "Case": "impactlab.casefile",
    "CaseError": "impactlab.errors",
    "Comparison": "impactlab.api",
    "ImpactlabError": "impactlab.errors",
    "PairingError": "impactlab.errors",
    "PluginError": "impactlab.errors",
    "StepError": "impactlab.errors",
    "compare": "impactlab.api",
    "load_case": "impactlab.casefile",
    "run": "impactlab.api",
}


def __getattr__(name: str) -> Any:
    # Loaded on first use, so that `import impactlab` and `impactlab --help` stay quick.
    if name not in _HOMES:
        raise AttributeError(f"module 'impactlab' has no attribute {name!r}")
    check_environment()
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
