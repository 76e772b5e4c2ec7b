"""
Where a derivative ends
=======================

A mass strikes a clamped bar. The exit velocity of the mass and its derivative over the
mass ratio, both exact; grey lines mark the ratios at which a contact appears or vanishes.
There the velocity has a kink, and one derivative is no longer enough.
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
solve = {"duration": {"round_trips": 6}, "model": {"kind": "continuous"}}
hit = il.Contact("mass", "bar.left", {"kind": "addition_deletion"})
bodies = {"mass": il.Mass("2.133 kg", velocity="1 m/s"), "bar": bar}
case = il.Case(bodies=bodies, contacts=[hit], solve=solve)
path, weight = "bodies.mass.mass", 2.133  # kg: the mass and that of the bar

ratios = np.linspace(0.3, 3.0, 91)
speeds, slopes, contacts = [], [], []
for ratio in ratios:
    at = case.with_(path, weight / ratio)
    row = il.sensitivities(at, [path], ["final_velocity"]).find("final_velocity", path, "mass")
    speeds.append(row.value)
    slopes.append(row.derivative * -weight / ratio**2)
    contacts.append(len(il.run(at).contacts))

edges = ratios[1:][np.diff(contacts) != 0]
fig, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(8, 5))
above.plot(ratios, speeds, marker=".", linewidth=0.8)
below.plot(ratios, slopes, marker=".", linewidth=0.8, color="C1")
for axis in (above, below):
    for edge in edges:
        axis.axvline(edge, color="0.8", zorder=0)
above.set_ylabel("exit velocity [m/s]")
below.set_ylabel("its derivative [m/s]")
below.set_xlabel("mass of the bar over that of the striker")
fig.tight_layout()
