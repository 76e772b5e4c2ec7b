"""
One impact, six methods
=======================

The impact of the paper by methods of the field (coloured), and exactly (dark). The second
contact, at 2.12 round trips, is a test of them all.
"""

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il

case = il.load_case("all_methods")
exact = il.run(case.method("continuous"))
T = exact.scene.round_trip
t = np.linspace(0.0, 2.5 * T, 2500)
names = [
    name
    for name in ("base", "penalty", "newmark", "moreau_jean", "nitsche", "craig_bampton")
    if name in case.method_names
]
fig, axes = plt.subplots(2, 3, figsize=(8, 4.4), sharex=True, sharey=True, layout="constrained")
for number, (axis, name) in enumerate(zip(axes.flat, names, strict=False)):
    history = il.run(case.method(name))
    axis.plot(
        t / T, 1e-3 * history.evaluate(t, "force:hammer|rod.left"), color=f"C{number % 8}"
    )
    axis.plot(
        t / T,
        1e-3 * exact.evaluate(t, "force:hammer|rod.left"),
        color="black",
        linewidth=0.9,
    )
    axis.set(title=name, ylim=(0, 110))
for axis in axes[-1]:
    axis.set_xlabel("t/T")
for axis in axes[:, 0]:
    axis.set_ylabel("force  [kN]")
