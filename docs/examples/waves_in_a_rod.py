"""
Waves in a struck rod
=====================

A rigid mass strikes a clamped rod. The exact solver gives the stress everywhere.
"""

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il

rod = il.Rod(length="0.3 m", diameter="20 mm", material="steel", ends={"right": "clamped"})
hard = il.Contact("hammer", "rod.left", {"kind": "addition_deletion"})
case = il.Case(
    bodies={"hammer": il.Mass("0.74 kg", velocity=1.0), "rod": rod},
    contacts=[hard],
    solve={"model": {"kind": "continuous"}, "duration": "0.3 ms"},
)
history = il.run(case)
t = np.linspace(0.0, history.duration, 500)
plt.plot(1e3 * t, 1e-3 * history.evaluate(t, "force:hammer|rod.left"))
