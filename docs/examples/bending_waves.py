"""
Bending waves run ahead
=======================

A steel ball strikes the middle of a long beam. Short waves outrun long ones, so that the
deflection spreads as :math:`\\sqrt t` while ripples race away: the picture has no
straight line in it, unlike that of a bar.
"""

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il

case = il.Case(
    bodies={
        "ball": il.Mass("32.9 g", velocity="1 m/s"),
        "beam": il.Beam(
            length="2 m",
            section={"width": "10 mm", "height": "10 mm"},
            material={"young": "210 GPa", "density": 7850, "poisson": 0.3},
            ends={"left": "pinned", "right": "pinned"},
        ),
    },
    contacts=[il.Contact("ball", "beam.at(1.0)", {"kind": "hertz", "stiffness": 1.54e10})],
    solve={
        "duration": "0.8 ms",
        "model": {"kind": "modal", "modes": 120},
        "integrator": {"kind": "exact_modal"},
        "step": {"dt": "0.5 us"},
    },
    snapshots={"every": "4 us"},
)
history = il.run(case)
times = history.field_times("beam")
x = np.linspace(0.4, 1.6, 301)
moment = np.stack([history.field("beam", t, "bending_moment", x).values for t in times])
limit = 0.35 * np.abs(moment).max()
fig, axis = plt.subplots(figsize=(8, 4.2))
image = axis.imshow(
    moment,
    origin="lower",
    aspect="auto",
    extent=(-0.6, 0.6, 0.0, 1e3 * times[-1]),
    cmap="RdBu_r",
    vmin=-limit,
    vmax=limit,
)
axis.grid(visible=False)
axis.set(xlabel="distance from the blow  [m]", ylabel="time  [ms]", title="Bending moment")
fig.colorbar(image, label="bending moment  [N m]")
