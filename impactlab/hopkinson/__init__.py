"""Hopkinson bars: from gauge signals to the stress and strain of the specimen, on arrays and on histories of runs.

    from impactlab import hopkinson

    bar = hopkinson.Bar(diameter=0.02, wave_speed=5000.0, density=8000.0, poisson=0.29)
    test = hopkinson.measured(incident_gauge, transmission_gauge, dt, bar, distances=(0.75, 0.75))
    curve = hopkinson.evaluate(test, hopkinson.Specimen(length=0.005, diameter=0.01), waves=1)
    curve.strain, curve.stress, curve.true.stress

Strain, stress, force are positive in compression, as everywhere here; a signal whose compression is negative is given
with the other sign. A tension test gives negative ones.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from impactlab.lazy import lazy_names

if TYPE_CHECKING:
    from impactlab.hopkinson.evaluation import Curve, Specimen, Test, equilibrium, evaluate, measured
    from impactlab.hopkinson.histories import bar_of, of_history, sampled
    from impactlab.hopkinson.separation import TwoWaves, force_and_velocity, one_gauge, two_gauges
    from impactlab.hopkinson.windows import Pulse, cut, pulses
    from impactlab.measurement.dispersion import Bar, shift

__all__ = [
    "Bar",
    "Curve",
    "Pulse",
    "Specimen",
    "Test",
    "TwoWaves",
    "bar_of",
    "cut",
    "equilibrium",
    "evaluate",
    "force_and_velocity",
    "measured",
    "of_history",
    "one_gauge",
    "pulses",
    "sampled",
    "shift",
    "two_gauges",
]

__getattr__ = lazy_names(
    __name__,
    {
        "impactlab.hopkinson.evaluation": ("Curve", "Specimen", "Test", "equilibrium", "evaluate", "measured"),
        "impactlab.hopkinson.histories": ("bar_of", "of_history", "sampled"),
        "impactlab.hopkinson.windows": ("Pulse", "cut", "pulses"),
        "impactlab.hopkinson.separation": ("TwoWaves", "force_and_velocity", "one_gauge", "two_gauges"),
        "impactlab.measurement.dispersion": ("Bar", "shift"),
    },
)
