"""
A Hopkinson bar
===============

A striker sends a square pulse down the incident bar. At the specimen a part of it is
reflected as tension, and a part is transmitted into the transmission bar. Two strain
gauges record the three waves. Which stress and which strain did the specimen have, and how
accurate is the usual analysis of the gauges?
"""

# %%
# From bars to gauge signals
# --------------------------
# Steel bars of 16 mm, an aluminium specimen of 10 mm, a striker of 200 mm at 10 m/s. With
# a tolerance and no method, the cheapest description that keeps it is chosen: here the
# exact waves of all four bars.

from itertools import pairwise

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il

bar = {"diameter": "16 mm", "material": "steel"}
bodies = {
    "striker": il.Rod(length="200 mm", velocity="10 m/s", **bar),
    "incident": il.Rod(length="1 m", **bar),
    "specimen": il.Rod(length="8 mm", diameter="10 mm", material="aluminium"),
    "transmission": il.Rod(length="1 m", **bar),
}
contacts = [il.Contact(f"{a}.right", f"{b}.left") for a, b in pairwise(bodies)]
gauges = [{"body": b, "at": 0.5, "quantity": "strain"} for b in ("incident", "transmission")]
solve = {"duration": "400 us", "tolerance": 1e-3}
case = il.Case(name="shpb", bodies=bodies, contacts=contacts, probes=gauges, solve=solve)
history = il.run(case)
data = history.to_xarray()  # gauges, forces, fields, energies, with their units
waves = history.waves("incident", 0.96)  # 40 mm before the specimen
fig, (gauge, parted) = plt.subplots(2, 1, figsize=(8, 5.4), sharex=True, layout="constrained")
gauge.plot(1e6 * data["time"], 1e6 * data["strain"].T, label=data["strain_at"].values)
three = np.transpose([waves.to_right, waves.to_left, waves.total])
parted.plot(1e6 * waves.time, 1e6 * three, label=["to the right", "to the left", "sum"])
for axis, title in ((gauge, "Gauges"), (parted, "40 mm before the specimen")):
    axis.set(xlabel="time  [µs]", ylabel="strain  [µm/m]", title=title)
    axis.legend()

# %%
# **Above**, the gauges in the middle of the bars. Strain is positive in compression:
# :math:`v/(2c)` = 967 µε while the pulse passes, then the reflected tension. The steps of
# the transmitted pulse are the waves that go back and forth inside the specimen.
#
# **Below**, the two waves 40 mm before the specimen, and their sum, which a
# gauge there would read. An experiment needs gauges far from the ends, so that pulses do
# not overlap; a run has both waves at every section.
#
# The second tab holds the same case as a file, for ``impactlab run shpb.yaml --out page``;
# ``impactlab new shpb.yaml --like hopkinson`` writes one with comments.

# %%
# The specimen, from the gauges
# -----------------------------
# The usual analysis takes the reflected wave for the rate of strain and the transmitted
# one for the stress,
#
# .. math::
#
#     \dot\varepsilon_s = -\frac{2c}{L_s}\,\varepsilon_R, \qquad
#     \sigma_s = \frac{A}{A_s}\,E\,\varepsilon_T,
#
# which assumes that the stress is the same on both sides of the specimen. Both gauges are
# as far from it, so the two signals need no shift.

steel, aluminium = 210e9, 70e9
t = np.linspace(0.0, history.duration, 2000)
transmitted = history.evaluate(t, "strain:transmission@0.5")
c = np.sqrt(steel / 7850)
reflected = history.waves("incident", 0.5, "strain", t).to_left
rate = -2.0 * c / 8e-3 * reflected
strain = np.concatenate(([0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))))
stress = (16.0 / 10.0) ** 2 * steel * transmitted

fig, axis = plt.subplots(figsize=(8, 3.6))
axis.plot(1e3 * strain, 1e-6 * stress, label="from the gauges")
axis.plot(
    [0.0, 1e3 * strain.max()],
    [0.0, 1e-6 * aluminium * strain.max()],
    "--",
    label="aluminium, 70 GPa",
)
axis.set(
    xlabel="strain of the specimen  [‰]",
    ylabel="stress  [MPa]",
    title="Stress against strain",
)
axis.legend(frameon=False)
slope = np.polyfit(strain[strain < 0.8 * strain.max()], stress[strain < 0.8 * strain.max()], 1)[
    0
]
print(f"modulus from the gauges: {slope / 1e9:.1f} GPa")

# %%
# The same with ``il.hopkinson``
# ------------------------------
# ``hopkinson.of_history`` takes the signals of both gauges and moves the waves to the
# specimen; ``evaluate`` gives stress, strain and rate by one, two or three waves. Of signals
# from a laboratory, ``hopkinson.measured`` makes the same ``Test``: :doc:`/hopkinson`.
# ``test.plot()`` draws the waves and the forces on both faces, ``curve.plot()`` the curve.

test = il.hopkinson.of_history(history)
specimen = il.hopkinson.Specimen(length="8 mm", diameter="10 mm")
fig, axis = plt.subplots(figsize=(8, 3.6))
for count in (1, 2, 3):
    curve = il.hopkinson.evaluate(test, specimen, waves=count)
    axis.plot(1e3 * curve.strain, 1e-6 * curve.stress, label=f"waves={count}")
axis.set(xlabel="strain of the specimen  [‰]", ylabel="stress  [MPa]", title="By gauges")
axis.legend()
print(curve)
