"""
A Hopkinson bar
===============

A striker sends a square pulse down the incident bar. At the specimen a part comes back as tension and a part goes
on into the transmission bar. Two strain gauges see it all. Which stress and which strain did the specimen have, and
how good is the usual analysis of the gauges?
"""

# %%
# The bars
# --------
# Steel bars of 16 mm, an aluminium specimen of 10 mm, a striker of 200 mm at 10 m/s. With a tolerance and no
# method, the cheapest description that keeps it is chosen: here the exact waves of all four bars.

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
faces = [
    ("striker.right", "incident.left"),
    ("incident.right", "specimen.left"),
    ("specimen.right", "transmission.left"),
]
contacts = [il.Contact(left, right) for left, right in faces]
gauges = [{"body": name, "at": "0.5 m", "quantity": "strain"} for name in ("incident", "transmission")]
case = il.Case(
    name="shpb", bodies=bodies, contacts=contacts, probes=gauges, solve={"duration": "400 us", "tolerance": 1e-3}
)
history = il.run(case)
print(history.choice.chosen)

# %%
# The same case as a file, for ``impactlab run shpb.yaml``:

print(case.to_yaml())

# %%
# The gauges
# ----------
# Strain is positive in compression. The incident gauge reads :math:`v/(2c)` = 967 µε while the pulse passes, then
# the reflected tension; the steps of the transmitted pulse are the waves that go back and forth inside the
# specimen.

t = np.linspace(0.0, history.duration, 2000)
incident = history.evaluate(t, "strain:incident@0.5")
transmitted = history.evaluate(t, "strain:transmission@0.5")

fig, axis = plt.subplots(figsize=(8, 3.2))
axis.plot(1e6 * t, 1e6 * incident, label="incident bar")
axis.plot(1e6 * t, 1e6 * transmitted, label="transmission bar")
axis.set(xlabel="time  [µs]", ylabel="strain  [µε]", title="Gauges in the middle of the bars")
axis.legend(frameon=False)

# %%
# The two waves at the gauge
# --------------------------
# An experiment needs gauges far from the ends, so that pulses do not overlap. A run has both waves at every
# section: here at 40 mm from the specimen, where the incident and the reflected wave overlap for most of their
# time.

waves = history.waves("incident", 0.96, "strain", t)

fig, axis = plt.subplots(figsize=(8, 3.2))
axis.plot(1e6 * t, 1e6 * waves.total, color="0.75", linewidth=4, label="the gauge")
axis.plot(1e6 * t, 1e6 * waves.to_right, label="to the right")
axis.plot(1e6 * t, 1e6 * waves.to_left, label="to the left")
axis.set(xlabel="time  [µs]", ylabel="strain  [µε]", title="40 mm before the specimen")
axis.legend(frameon=False)

# %%
# The specimen, from the gauges
# -----------------------------
# The usual analysis takes the reflected wave for the rate of strain and the transmitted one for the stress,
#
# .. math:: \dot\varepsilon_s = -\frac{2c}{L_s}\,\varepsilon_R, \qquad \sigma_s = \frac{A}{A_s}\,E\,\varepsilon_T,
#
# which assumes that the stress is the same on both sides of the specimen. Both gauges are as far from it, so the
# two signals need no shift.

steel, aluminium = 210e9, 70e9
c = np.sqrt(steel / 7850)
reflected = history.waves("incident", 0.5, "strain", t).to_left
rate = -2.0 * c / 8e-3 * reflected
strain = np.concatenate(([0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))))
stress = (16.0 / 10.0) ** 2 * steel * transmitted

fig, axis = plt.subplots(figsize=(8, 3.6))
axis.plot(1e3 * strain, 1e-6 * stress, label="from the gauges")
axis.plot([0.0, 1e3 * strain.max()], [0.0, 1e-6 * aluminium * strain.max()], "--", label="aluminium, 70 GPa")
axis.set(xlabel="strain of the specimen  [‰]", ylabel="stress  [MPa]", title="Stress against strain")
axis.legend(frameon=False)
slope = np.polyfit(strain[strain < 0.8 * strain.max()], stress[strain < 0.8 * strain.max()], 1)[0]
print(f"modulus from the gauges: {slope / 1e9:.1f} GPa")
