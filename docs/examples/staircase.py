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

fig, axis = plt.subplots(figsize=(8, 3.6))
t = np.linspace(0.0, 3e-4, 3000)
for area in (1.0, 2.0, 4.0):
    bar = il.Rod(
        length="1 m", area=f"{area} cm^2", material="steel", ends={"right": "infinite"}
    )
    strikers = {
        "bar": il.Rod(length="10 cm", area="4 cm^2", material="steel", velocity="10 m/s"),
        "rigid": il.Mass("0.314 kg", velocity="10 m/s"),
    }
    for kind, striker in strikers.items():
        face = "striker.right" if kind == "bar" else "striker"
        solve = {"duration": "300 us", "tolerance": 1e-3}
        history = il.run(
            il.Case(
                bodies={"striker": striker, "rod": bar},
                contacts=[il.Contact(face, "rod.left")],
                solve=solve,
            )
        )
        style = (
            {"label": f"section {area / 4:g} of the striker's"}
            if kind == "bar"
            else {"linestyle": "--", "linewidth": 1.0}
        )
        lines = axis.plot(
            1e6 * t,
            1e-3 * history.evaluate(t, f"force:{face}|rod.left"),
            color=f"C{int(area) // 2}",
            **style,
        )
axis.set(
    xlabel="time  [µs]",
    ylabel="contact force  [kN]",
    title="Striker bars, and rigid strikers of the same mass",
)
axis.legend(frameon=False)
