"""Hopkinson bars: stress and strain of the specimen from gauge signals.

Signals are arrays, or come from histories of runs.

    from impactlab import hopkinson

    bar = hopkinson.Bar(diameter="20 mm", wave_speed=5000.0, density=8000.0, poisson=0.29)
    test = hopkinson.measured(incident_gauge, transmission_gauge, dt, bar, distances=("75 cm", "75 cm"))
    curve = hopkinson.evaluate(test, hopkinson.Specimen(length="5 mm", diameter="10 mm"), waves=1)
    curve.strain, curve.stress, curve.true.stress

Bar                 round bar: diameter, wave speed, density, Poisson's ratio, theory of its dispersion
Specimen            cylinder between the bars: length and diameter
measured            waves at the specimen from two gauges, one on each bar: a Test
of_history          the same from the strain probes of a run
Test                incident, reflected and transmitted wave at the specimen
evaluate            stress, strain and rate of the specimen by 1, 2 or 3 waves: a Curve
Curve               stress, strain and rate over time; ``.true``, ``.between``, ``.plot()``, ``.to_pandas()``
equilibrium         ratio of the forces on both faces, 2 (F1 - F2)/(F1 + F2)
pulses, Pulse       pulses of a signal: start, end, peak, mean
cut                 a signal between two times, zero elsewhere
shift               a signal moved along a bar, with its dispersion
one_gauge           both waves at the end of a bar from one gauge that pulses pass one after the other
two_gauges          both waves at a place from two gauges, for pulses of any length
force_and_velocity  both waves at a place from force and velocity
TwoWaves            the result of these three: strains to the right and to the left, force, velocity
bar_of              a rod of a run as a Bar
sampled             a channel of a run at equal intervals

Strain, stress, force are positive in compression, as everywhere here; a signal whose compression is negative is given
with the other sign. A tension test gives negative ones. Signals are in m/m and seconds; lengths, diameters and
distances are in metres, or strings with a unit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from impactlab.startup.lazy import lazy_names, public_names

if TYPE_CHECKING:
    from impactlab.hopkinson.evaluation import Curve, Specimen, Test, equilibrium, evaluate
    from impactlab.hopkinson.gauges import measured
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
        "impactlab.hopkinson.evaluation": "Curve Specimen Test equilibrium evaluate",
        "impactlab.hopkinson.gauges": "measured",
        "impactlab.hopkinson.histories": "bar_of of_history sampled",
        "impactlab.hopkinson.windows": "Pulse cut pulses",
        "impactlab.hopkinson.separation": "TwoWaves force_and_velocity one_gauge two_gauges",
        "impactlab.measurement.dispersion": "Bar shift",
    },
)
__dir__ = public_names(__all__)
