"""Impacts of rods, beams and mechanisms: models, contact laws and integrators.

They are compared on cases with exact results.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from impactlab.startup.environment import check_environment
from impactlab.startup.lazy import lazy_names, public_names

if TYPE_CHECKING:
    from impactlab import dispersion, drilling, granular, hopkinson, piling
    from impactlab.api import Comparison, compare, run
    from impactlab.casefile import (
        Beam,
        Case,
        Chain,
        Contact,
        Joint,
        Link,
        Mass,
        Mechanism,
        Probe,
        Rod,
        Shaft,
        Wall,
        load_case,
    )
    from impactlab.derivatives import Sensitivities, sensitivities
    from impactlab.errors import (
        CaseError,
        DoubtfulResult,
        ExtraError,
        ImpactlabError,
        PairingError,
        PluginError,
        RunNote,
        RunWarning,
        StepError,
        UnusualValue,
    )
    from impactlab.files import open_netcdf
    from impactlab.fits import Fit, Signal, fit, fit_problem, read_signals
    from impactlab.sweeps import Sampled, open_sweep, plot_sweep, sweep
    from impactlab.uncertainties import Uncertainty, uncertainty

__version__ = "0.1.0"

__all__ = [
    "Beam",
    "Case",
    "CaseError",
    "Chain",
    "Comparison",
    "Contact",
    "DoubtfulResult",
    "ExtraError",
    "Fit",
    "ImpactlabError",
    "Joint",
    "Link",
    "Mass",
    "Mechanism",
    "PairingError",
    "PluginError",
    "Probe",
    "Rod",
    "RunNote",
    "RunWarning",
    "Sampled",
    "Sensitivities",
    "Shaft",
    "Signal",
    "StepError",
    "Uncertainty",
    "UnusualValue",
    "Wall",
    "compare",
    "dispersion",
    "drilling",
    "fit",
    "fit_problem",
    "granular",
    "hopkinson",
    "load_case",
    "open_netcdf",
    "open_sweep",
    "piling",
    "plot_sweep",
    "read_signals",
    "run",
    "sensitivities",
    "sweep",
    "uncertainty",
]

__getattr__ = lazy_names(  # `import impactlab` and `impactlab --help` stay quick
    __name__,
    {
        "impactlab.api": "Comparison compare run",
        "impactlab.casefile": "Beam Case Chain Contact Joint Link Mass Mechanism Probe Rod Shaft Wall load_case",
        "impactlab.errors": "CaseError DoubtfulResult ExtraError ImpactlabError PairingError PluginError RunNote "
        "RunWarning StepError UnusualValue",
        "impactlab.files": "open_netcdf",
        "impactlab.fits": "Fit Signal fit fit_problem read_signals",
        "impactlab.derivatives": "Sensitivities sensitivities",
        "impactlab.sweeps": "Sampled open_sweep plot_sweep sweep",
        "impactlab.uncertainties": "Uncertainty uncertainty",
    },
    check_environment,
    modules="dispersion drilling granular hopkinson piling",
)

__dir__ = public_names(["__version__", *__all__])
