"""
When a mass strikes twice
=========================

Contacts of a mass with a clamped bar, for 400 masses from a tenth to twenty bars. Each
row is one exact run; coloured while they touch. The islands of later contacts end where
the faces only just miss each other.
"""

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il

bar = il.Rod(
    length="0.3 m",
    area="9 cm^2",
    material={"young": 2.1e11, "density": 7900},
    ends={"right": "clamped"},
)
solve = {"duration": {"round_trips": 8}, "model": {"kind": "continuous"}}
hit = il.Contact("mass", "bar.left", {"kind": "addition_deletion"})
bodies = {"mass": il.Mass("2.133 kg", velocity="1 m/s"), "bar": bar}
case = il.Case(bodies=bodies, contacts=[hit], solve=solve)

fig, axis = plt.subplots(figsize=(8, 4.2))
ratios = np.geomspace(0.1, 20.0, 400)
for ratio in ratios:
    history = il.run(case.with_("bodies.mass.mass", 2.133 * ratio))
    T = history.scene.round_trip
    for number, span in enumerate(history.contacts):
        end = span.until(history.duration)
        axis.plot(
            [span.start / T, end / T],
            [ratio, ratio],
            color=f"C{number % 8}",
            linewidth=1.3,
            solid_capstyle="butt",
        )
axis.set(
    yscale="log",
    xlabel="time in round trips  t/T",
    ylabel="mass over that of the bar",
    title="In contact",
    xlim=(0, 8),
)
