"""
A million exact runs
====================

A hammer strikes a free rod that stands before a wall. Each of the 1000 x 1000 pixels is one
exact run, over the mass of the hammer and the gap at the wall: small gaps are crossed by the
first wave, larger ones by the flying rod. The number of contacts changes along sharp edges,
and the speed with which the hammer leaves has a kink there.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.colors import BoundaryNorm

import impactlab as il

case = il.load_case("hammer_rod_wall").with_("solve.duration", {"round_trips": 6})
T = case.scene().round_trip  # v0 = 1 m/s and the rod weighs 1 kg
masses, gaps = np.geomspace(0.1, 10.0, 1000), np.linspace(0.0, 1.2 * T, 1000)
found = il.sweep(
    case,
    {"bodies.hammer.mass": masses, "contacts.1.gap": gaps},
    quantities=["restitution", "contacts"],
    workers=2,
)
restitution = found["restitution"].sel(pair="hammer|rod").values.T
contacts = found["contacts"].values.T  # of hammer and rod, of rod and wall
both = contacts.sum(axis=0)

fig, axes = plt.subplots(1, 2, figsize=(9.6, 4.4), sharey=True, layout="constrained")
limit = np.nanmax(np.abs(restitution))
levels = np.arange(both.min() - 0.5, both.max() + 1.5)
colours = plt.get_cmap("viridis_r", len(levels) - 1)
for axis, table, title, options in (
    (
        axes[0],
        restitution,
        "apparent restitution, hammer and rod",
        {"cmap": "RdBu", "vmin": -limit, "vmax": limit},
    ),
    (
        axes[1],
        both,
        "contacts in six round trips",
        {"cmap": colours, "norm": BoundaryNorm(levels, colours.N)},
    ),
):
    image = axis.pcolormesh(masses, gaps / T, table, rasterized=True, **options)
    bar = fig.colorbar(image, ax=axis, pad=0.02)
    axis.set(xscale="log", xlabel="mass of the hammer over that of the rod", title=title)
bar.set_ticks(np.arange(both.min(), both.max() + 1))
axes[0].set_ylabel("gap over $v_0 T$")
plt.show()
