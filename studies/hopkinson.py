"""Figures of the page on Hopkinson bars."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

import impactlab as il
from impactlab import hopkinson
from impactlab.measurement import dispersion
from impactlab.report.figures import style
from studies.pages import CASES, Study

SPECIMEN = hopkinson.Specimen(length=5e-3, diameter=10e-3)
YOUNG, YIELD, TANGENT = 70e9, 300e6, 500e6  # Pa, of the specimen that was put in
LOADED = 300e-6  # s, when the pulse arrives at the specimen


def draw_test() -> Figure:
    """Return the figure of both gauges, and of the curves.

    They are the curve of the evaluation and that of the law.
    """
    history = il.run(il.load_case(CASES / "hopkinson_aluminium.yaml"))
    figure = Figure(figsize=(style.WIDTH, 3.1), layout="constrained")
    left, right = figure.subplots(1, 2)
    for body, colour, dash in (("incident", style.INK, "-"), ("transmission", style.PALETTE[1], "--")):
        dt, strain = hopkinson.sampled(history, f"strain:{body}@0.75", 10e6)
        left.plot(1e6 * dt * np.arange(len(strain)), 1e6 * strain, color=colour, ls=dash, label=f"{body} bar")
    left.set(xlim=(100.0, 600.0), ylim=(-1300.0, 1900.0), xlabel="time  [µs]", ylabel="strain  [µm/m]")
    left.set_title("Gauges in the middle of the bars", loc="left")
    left.legend(frameon=False, loc="upper right")
    curve = hopkinson.evaluate(hopkinson.of_history(history), SPECIMEN).between(LOADED, LOADED + 100e-6)
    strain = np.array([0.0, YIELD / YOUNG, 0.16])
    stress = np.array([0.0, YIELD, YIELD + TANGENT * (0.16 - YIELD / YOUNG)])
    right.plot(100.0 * strain, 1e-6 * stress, color=style.MUTED, lw=4.0, alpha=0.5, label="law of the case")
    right.plot(100.0 * curve.strain, 1e-6 * curve.stress, color=style.INK, label="nominal, evaluated")
    right.plot(100.0 * curve.true.strain, 1e-6 * curve.true.stress, color=style.PALETTE[1], ls="--", label="true")
    right.set(xlim=(0.0, 18.0), ylim=(0.0, 420.0), xlabel="strain  [%]", ylabel="stress  [MPa]")
    right.set_title("Specimen", loc="left")
    right.legend(frameon=False, loc="lower right")
    return figure


def draw_ring_up() -> Figure:
    """Return the figure of a specimen with mass by three evaluations.

    It shows stress over strain by one, two and three waves, and its equilibrium ratio.
    """
    test = hopkinson.of_history(il.run(il.load_case(CASES / "hopkinson_ring_up.yaml")), rate=10e6)
    figure = Figure(figsize=(style.WIDTH, 2.9), layout="constrained")
    left, right = figure.subplots(1, 2)
    for waves, colour, dash in ((1, style.PALETTE[0], "--"), (2, style.PALETTE[1], "-."), (3, style.INK, "-")):
        curve = hopkinson.evaluate(test, SPECIMEN, waves).between(LOADED, LOADED + 20e-6)
        label = f"{waves} wave{'s' if waves > 1 else ''}"
        left.plot(100.0 * curve.strain, 1e-6 * curve.stress, color=colour, ls=dash, label=label)
    left.set(xlim=(0.0, None), ylim=(0.0, None), xlabel="strain  [%]", ylabel="stress  [MPa]")
    left.set_title("The first 20 µs", loc="left")
    left.legend(frameon=False, loc="lower right")
    right.plot(1e6 * (test.time - LOADED), 100.0 * hopkinson.equilibrium(test), color=style.INK)
    right.set(xlim=(0.0, 30.0), ylim=(-70.0, 210.0), xlabel="time since loading  [µs]", ylabel="equilibrium ratio  [%]")
    right.set_title("Front and back", loc="left")
    return figure


def draw_dispersion() -> Figure:
    """Return the figure of phase speeds and of a dispersed pulse.

    Speeds are over diameter by wavelength; the pulse is shown before and after 1.5 m of bar.
    """
    figure = Figure(figsize=(style.WIDTH, 2.9), layout="constrained")
    left, right = figure.subplots(1, 2)
    ratio = np.linspace(0.0, 2.0, 201)
    left.plot(ratio, dispersion.phase_speed(0.29, ratio), color=style.INK, label="Pochhammer and Chree")
    left.plot(ratio, dispersion.love_speed(0.29, ratio), color=style.PALETTE[1], ls="--", label="Love")
    left.set(xlim=(0.0, 2.0), ylim=(0.4, 1.02), xlabel="diameter / wavelength", ylabel="phase speed / c0")
    left.set_title("Poisson's ratio 0.29", loc="left")
    left.legend(frameon=False, loc="lower left")
    t = 1e-7 * np.arange(6000)
    pulse = np.interp(t, [40e-6, 45e-6, 135e-6, 140e-6], [0.0, 1200.0, 1200.0, 0.0])
    bar = hopkinson.Bar(diameter=0.02, wave_speed=5000.0, density=8000.0, poisson=0.29)
    moved = hopkinson.shift(pulse, 1e-7, 1.5, bar)
    right.plot(1e6 * t, pulse, color=style.MUTED, label="at the gauge, moved by 1.5 m/c0")
    right.lines[0].set_xdata(1e6 * t + 300.0)
    right.plot(1e6 * t, moved, color=style.INK, label="1.5 m further on")
    right.set(xlim=(320.0, 480.0), ylim=(-300.0, 2100.0), xlabel="time  [µs]", ylabel="strain  [µm/m]")
    right.set_title("A pulse in a bar of 20 mm", loc="left")
    right.legend(frameon=False, loc="upper left")
    return figure


STUDY = Study(
    {},
    {
        "figures/hopkinson_test.png": draw_test,
        "figures/hopkinson_ring_up.png": draw_ring_up,
        "figures/hopkinson_dispersion.png": draw_dispersion,
    },
)
