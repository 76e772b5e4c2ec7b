"""Hopkinson bars that differ, against the closed form of an elastic specimen under a rectangular pulse.

Under the incident force F1 the force on a massless spring k between bars of the impedances Z1 and Z2 rises as
F (1 - exp(-t/s)), F = 2 F1 Z2/(Z1 + Z2), s = Z1 Z2/(k (Z1 + Z2)).
"""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from impactlab import hopkinson
from impactlab.types import Array

DT = 1e-7
STEEL = hopkinson.Bar("20 mm", 5000.0, 8000.0, dispersion="none")
POLYMER = hopkinson.Bar("25 mm", 2000.0, 1200.0, dispersion="none")
SPECIMEN = hopkinson.Specimen("8 mm", "12 mm")
SPRING, STRAIN, PULSE = 2.0e7, 4e-4, 1.2e-4  # N/m, of the incident wave, s
WAYS = 1.0, 0.5  # m from the specimen


def force(t: Array, first: hopkinson.Bar, second: hopkinson.Bar) -> Array:
    """Return the force on the specimen [N] after the arrival of the incident pulse."""
    z1, z2 = first.impedance, second.impedance
    late = z1 * z2 / (SPRING * (z1 + z2))
    whole = 2.0 * STRAIN * first.young * first.area * z2 / (z1 + z2)

    def risen(since: Array) -> Array:
        return np.where(since > 0.0, whole * -np.expm1(-np.maximum(since, 0.0) / late), 0.0)

    return risen(t) - risen(t - PULSE)


def gauges(first: hopkinson.Bar, second: hopkinson.Bar) -> tuple[Array, Array]:
    """Return the strains of both gauges; the incident wave passes its gauge at 10 us."""
    t = DT * np.arange(16_000) - 1e-5
    lags = [way / bar.wave_speed for way, bar in zip(WAYS, (first, second), strict=True)]
    incident = np.where((t >= 0.0) & (t < PULSE), STRAIN, 0.0)
    back = t - 2.0 * lags[0]
    coming = np.where((back >= 0.0) & (back < PULSE), STRAIN, 0.0)
    reflected = force(back, first, second) / (first.young * first.area) - coming
    transmitted = force(t - sum(lags), first, second) / (second.young * second.area)
    return incident + reflected, transmitted


@pytest.mark.parametrize("bars", [(STEEL, POLYMER), (POLYMER, STEEL), (STEEL, STEEL)])
@pytest.mark.parametrize("waves", [1, 2, 3])
def test_an_elastic_specimen_between_any_bars_has_its_stiffness(
    bars: tuple[hopkinson.Bar, hopkinson.Bar], waves: int
) -> None:
    found = hopkinson.measured(
        *gauges(*bars), DT, bars[0], WAYS, far_ends=(1.0, 1.0), transmission_bar=None if bars[0] == bars[1] else bars[1]
    )
    curve = hopkinson.evaluate(found, SPECIMEN, waves)
    arrives = 1e-5 + WAYS[0] / bars[0].wave_speed
    inside = (curve.time > arrives + 2e-6) & (curve.time < arrives + PULSE - 2e-6)
    exact = force(curve.time - arrives, *bars)[inside]
    np.testing.assert_allclose(curve.stress[inside] * SPECIMEN.area, exact, rtol=1e-9)
    # The strain is a sum over samples: at the front, where the rate jumps, it is right to a sample.
    step = 2.0 * STRAIN * bars[0].wave_speed * DT
    np.testing.assert_allclose(curve.strain[inside] * SPECIMEN.length, exact / SPRING, atol=step)


def test_bars_of_a_run_that_differ_are_read_from_the_history() -> None:
    """The three evaluations of an elastic specimen agree, and give the force that the run itself has."""
    rods = {
        name: il.Rod(
            length=length,
            diameter=bar.diameter,
            material={"young": bar.young, "density": bar.density},
        )
        for name, length, bar in (("incident", 2.0, STEEL), ("transmission", 1.0, POLYMER))
    }
    striker = il.Rod(
        length=0.25, diameter=0.02, material={"young": STEEL.young, "density": STEEL.density}, velocity=4.0
    )
    case = il.Case(
        bodies={"striker": striker, **rods},
        contacts=[
            il.Contact("striker.right", "incident.left", {"kind": "addition_deletion"}),
            il.Contact("incident.right", "transmission.left", {"kind": "penalty", "stiffness": SPRING}),
        ],
        solve={"duration": "0.75 ms", "model": {"kind": "continuous"}},
        probes=[
            {"body": "incident", "at": 1.0, "quantity": "strain"},
            {"body": "transmission", "at": 0.5, "quantity": "strain"},
        ],
    )
    history = il.run(case)
    found = hopkinson.of_history(history, smooth=0.0)
    assert found.bars[0].wave_speed == pytest.approx(5000.0)
    assert found.bars[1].wave_speed == pytest.approx(2000.0)
    name = history.scene.contacts[1].name
    inside = (found.time > 4.02e-4) & (found.time < 4.95e-4)
    exact = history.evaluate(found.time[inside], f"force:{name}")
    for side in found.forces:
        np.testing.assert_allclose(side[inside], exact, rtol=1e-9)
    strains = [hopkinson.evaluate(found, SPECIMEN, waves).strain[inside] for waves in (1, 2, 3)]
    for strain in strains:
        # The striker at 4 m/s sends the strain v/(2 c) = 4e-4; the sum is right to a sample, as above.
        np.testing.assert_allclose(strain * SPECIMEN.length, exact / SPRING, atol=2.0 * STRAIN * STEEL.wave_speed * DT)
