"""Figure of the section on instruments: a wave front after gauge length, filter and converter."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

import impactlab as il
from impactlab.report.figures import style
from studies.pages import Study

STRIKER, SPEED, AT = 0.1, 5000.0, 0.5  # m, m/s, m


def bar(*instruments: dict[str, Any]) -> il.Case:
    """Return a striker on a bar with one gauge, measured by several instruments."""
    material = {"young": 2e11, "density": 8000.0}
    probe = {"body": "bar", "at": AT, "quantity": "strain"}
    return il.Case(
        bodies={
            "striker": il.Rod(length=STRIKER, diameter="20 mm", material=material, velocity=12.0),
            "bar": il.Rod(length=1.0, diameter="20 mm", material=material),
        },
        contacts=[{"between": ["striker.right", "bar.left"], "law": {"kind": "addition_deletion"}}],
        solve={"duration": "200 us", "model": {"kind": "continuous"}},
        probes=[probe | each for each in instruments],
    )


def draw_instruments() -> Figure:
    """Return the figure of true and measured signals of three gauges.

    Each has one fault of its own.
    """
    history = il.run(
        bar(
            {"length": 0.02, "rate": 2e6},
            {"bandwidth": 1e5, "rate": 1e6},
            {"rate": 2e6, "noise": 2e-5, "bits": 6, "range": 2e-3},
        )
    )
    times = [0.0, *(1e6 * AT / SPEED + edge for edge in (0.0, 2e6 * STRIKER / SPEED)), 200.0]  # us
    figure = Figure(figsize=(style.WIDTH, 2.7), layout="constrained")
    titles = ("Gauge of 20 mm", "Bandwidth 100 kHz", "6 bits, noise 20 µε")
    for number, (axis, title) in enumerate(zip(figure.subplots(1, 3, sharey=True), titles, strict=True)):
        found = history.measured(number)
        axis.stairs([0.0, 1200.0, 0.0], times, color=style.INK, baseline=None, label="true")
        axis.plot(1e6 * found.time, 1e6 * found.values, ".-", ms=3, lw=0.8, color=style.PALETTE[1], label="measured")
        axis.set(xlim=(85.0, 155.0), ylim=(-150.0, 1400.0), xlabel="time  [µs]")
        axis.set_title(title, loc="left")
    first = figure.axes[0]
    first.set_ylabel("strain  [µε]")
    first.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 0.15))
    return figure


STUDY = Study({}, {"figures/instruments.png": draw_instruments})
