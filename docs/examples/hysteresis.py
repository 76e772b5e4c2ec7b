"""
What a nominal restitution means
================================

Four laws for the same ball on a wall, all given a restitution of 0.5 where they take one.
The area of a loop is the energy lost, and the ball returns with another restitution than
the one that was asked for (:doc:`/theory/contact-laws`).
"""

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il

case = il.Case(
    bodies={"ball": il.Mass("33 g", velocity="2 m/s"), "wall": il.Wall()},
    contacts=[il.Contact("ball", "wall", {"kind": "hertz", "stiffness": 1.54e10})],
    solve={
        "duration": "120 us",
        "integrator": {"kind": "midpoint"},
        "step": {"dt": "0.05 us"},
    },
)
t = np.linspace(0.0, 120e-6, 4000)
fig, axis = plt.subplots(figsize=(8, 3.8))
for kind in ("hertz", "lankarani_nikravesh", "hunt_crossley", "flores"):
    law = {"kind": kind, "stiffness": 1.54e10} | (
        {} if kind == "hertz" else {"restitution": 0.5}
    )
    history = il.run(case.with_("contacts.0.law", **law))
    overlap, force = (
        -history.evaluate(t, "gap:ball|wall"),
        history.evaluate(t, "force:ball|wall"),
    )
    back = -float(history.evaluate(120e-6, "velocity:ball")) / 2.0
    axis.plot(
        1e6 * overlap[force > 0],
        1e-3 * force[force > 0],
        label=f"{kind}: returns with {back:.3f}",
    )
axis.set(xlabel="overlap  [µm]", ylabel="force  [kN]", title="Force over overlap")
axis.legend(frameon=False)
