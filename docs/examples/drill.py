"""
A percussive drill and its rock
===============================

A piston strikes a drill rod; at the bit rock yields like a spring. Which share of the
energy of the piston is in the rock at the deepest point of the bit? Soft rock lets the
wave turn back as tension, hard rock as compression.
"""

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il

case = il.Case(
    bodies={
        "piston": il.Rod(length="0.4 m", diameter="40 mm", material="steel", velocity="10 m/s"),
        "rod": il.Rod(length="3 m", diameter="38 mm", material="steel"),
        "bit": il.Mass("4 kg"),
        "rock": il.Wall(),
    },
    contacts=[
        il.Contact("piston.right", "rod.left", {"kind": "addition_deletion"}),
        il.Contact("rod.right", "bit", {"kind": "addition_deletion"}),
        il.Contact("bit", "rock", {"kind": "penalty", "stiffness": 3e8}),
    ],
    solve={"duration": "1.2 ms", "model": {"kind": "continuous"}},
)
energy = 0.5 * 7850 * np.pi * 0.02**2 * 0.4 * 10.0**2
t = np.linspace(0.0, 1.2e-3, 4000)
stiffness, share = np.geomspace(2e7, 2e10, 40), []
for k in stiffness:
    deepest = (
        -il.run(case.with_("contacts.2.law.stiffness", k)).evaluate(t, "gap:bit|rock").min()
    )
    share.append(0.5 * k * deepest**2 / energy)
fig, axis = plt.subplots(figsize=(8, 3.4))
axis.semilogx(1e-6 * stiffness, 100.0 * np.array(share))
axis.set(
    xlabel="stiffness of the rock  [MN/m]",
    ylabel="energy in the rock  [%]",
    ylim=(0, None),
    title="One blow of a percussive drill",
)
