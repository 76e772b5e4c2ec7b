"""
The staircase of a striker bar
==============================

A striker bar meets a long bar of a quarter, a half and the whole of its section. The
contact force falls in steps, each by the factor :math:`(Z_1 - Z_2)/(Z_1 + Z_2)`; a rigid
striker of the same mass gives the dashed exponential (:doc:`/theory/bar-impact`).
"""

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il

rod = il.Rod(length="1 m", area="1 cm^2", material="steel", ends={"right": "infinite"})
striker = il.Rod(length="10 cm", area="4 cm^2", material="steel", velocity="10 m/s")
solve = {"duration": "300 us", "tolerance": 1e-3}
bar = il.Case(
    bodies={"striker": striker, "rod": rod},
    contacts=[il.Contact("striker.right", "rod.left")],
    solve=solve,
)
rigid = il.Case(
    bodies={"striker": il.Mass("0.314 kg", velocity="10 m/s"), "rod": rod},
    contacts=[il.Contact("striker", "rod.left")],
    solve=solve,
)
fig, axis = plt.subplots(figsize=(8, 3.6))
t = np.linspace(0.0, 3e-4, 3000)
for number, area in enumerate((1, 2, 4)):
    for case, face, style in ((bar, "striker.right", "-"), (rigid, "striker", "--")):
        history = il.run(case.with_("bodies.rod.area", f"{area} cm^2"))
        axis.plot(
            1e6 * t,
            1e-3 * history.evaluate(t, f"force:{face}|rod.left"),
            style,
            color=f"C{number}",
            linewidth=None if case is bar else 1.0,
            label=f"section {area / 4:g} of the striker's" if case is bar else None,
        )
axis.set(
    xlabel="time  [µs]",
    ylabel="contact force  [kN]",
    title="Striker bars, and rigid strikers of the same mass",
)
axis.legend(frameon=False)
