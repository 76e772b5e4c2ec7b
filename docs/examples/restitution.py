"""
Restitution without loss
========================

A mass strikes a free bar and leaves after one round trip. No energy is lost, and still
the coefficient of restitution is below 1: part of it vibrates in the bar. Circles are
runs, the line is :math:`(1 - e^{-2\\alpha})/\\alpha - e^{-2\\alpha}`.
"""

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il

bar = il.Rod(length="0.3 m", diameter="20 mm", material="steel")
bodies = {"mass": il.Mass("0.74 kg", velocity="1 m/s"), "bar": bar}
case = il.Case(
    bodies=bodies,
    contacts=[il.Contact("mass", "bar.left")],
    solve={"duration": {"round_trips": 1.5}, "tolerance": 1e-3},
)
of_bar = 7850 * np.pi * 0.01**2 * 0.3

found = []
alphas = np.geomspace(0.02, 20.0, 25)
for alpha in alphas:
    history = il.run(case.with_("bodies.mass.mass", of_bar / alpha))
    end = history.duration
    found.append(
        history.evaluate(end, "momentum:bar") / of_bar - history.evaluate(end, "velocity:mass")
    )
fig, axis = plt.subplots(figsize=(8, 3.4))
fine = np.geomspace(0.02, 20.0, 300)
axis.semilogx(fine, (1 - np.exp(-2 * fine)) / fine - np.exp(-2 * fine), label="d'Alembert")
axis.semilogx(alphas, found, "o", markerfacecolor="none", label="exact runs")
axis.set(
    xlabel="mass of the bar over that of the striker",
    ylabel="apparent restitution",
    ylim=(0, 1.05),
    title="A mass on a free bar",
)
axis.legend(frameon=False)
