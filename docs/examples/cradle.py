"""
Newton's cradle of elastic bars
===============================

Four bars of one impedance: the first hands over its whole velocity, the last leaves with
it. Bars of falling section hand on more and more. Mean velocities are momenta over
masses.
"""

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il

case = il.load_case("chain_of_bars")
fig, axes = plt.subplots(1, 2, figsize=(8, 3.4), sharey=True)
for axis, (title, shown) in zip(
    axes,
    {"equal sections": case, "sections 8 : 4 : 2 : 1": case.variant("tapered")}.items(),
    strict=True,
):
    history = il.run(shown.method("continuous"))
    t = np.linspace(0.0, history.duration, 1500)
    for name, body in history.scene.elastic.items():
        mass = sum(piece.density * piece.area * piece.length for piece in body.segments)
        axis.plot(1e6 * t, history.evaluate(t, f"momentum:{name}") / mass, label=name)
    axis.set(xlabel="time  [µs]", title=title)
axes[0].set(ylabel="mean velocity  [m/s]")
axes[0].legend(frameon=False)
