"""
A million exact runs
====================

A hammer strikes a free rod that stands before a wall. Each pixel is one exact run, over the
mass of the hammer and the gap at the wall: small gaps are crossed by the first wave, larger
ones by the flying rod. The number of contacts changes along sharp edges, and the speed with
which the hammer leaves has a kink there. (A restitution of the two is not defined where the
rod meets the wall before they part.) The page builds 200 x 200 of them; with
``COUNT = 1000`` it is a million runs, 30 s on two cores.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.colors import BoundaryNorm

import impactlab as il

rod = il.Rod(length="0.5 m", area="2.5 cm^2", material={"young": "200 GPa", "density": 8000})
bodies = {"hammer": il.Mass("1 kg", velocity="1 m/s"), "rod": rod, "wall": il.Wall()}
hard = {"kind": "wave_identification"}
contacts = [
    il.Contact("hammer", "rod.left", hard),
    il.Contact("rod.right", "wall", hard, gap="0.07 mm"),
]
solve = {"duration": {"round_trips": 6}, "model": {"kind": "continuous"}}
case = il.Case(bodies=bodies, contacts=contacts, solve=solve)
T = case.scene().round_trip  # v0 = 1 m/s and the rod weighs 1 kg
COUNT = 200
masses, gaps = np.geomspace(0.1, 10.0, COUNT), np.linspace(0.0, 1.2 * T, COUNT)
found = il.sweep(
    case,
    {"bodies.hammer.mass": masses, "contacts.1.gap": gaps},
    quantities=["final_velocity", "contacts"],
    workers=2,
)
velocity = found["final_velocity"].sel(body="hammer").values.T
touches = found["contacts"].values.T  # of hammer and rod, of rod and wall
both = touches.sum(axis=0)

fig, axes = plt.subplots(1, 2, figsize=(9.6, 4.4), sharey=True, layout="constrained")
limit = np.max(np.abs(velocity))
levels = np.arange(both.min() - 0.5, both.max() + 1.5)
colours = plt.get_cmap("viridis_r", len(levels) - 1)
for axis, table, title, options in (
    (
        axes[0],
        velocity,
        "velocity of the hammer at the end, m/s",
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
