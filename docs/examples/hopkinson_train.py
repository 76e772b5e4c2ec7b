"""
Three bars, one wave diagram
============================

Striker, incident and transmission bar laid end to end. The transmission bar has twice the
section: 4/3 of the force passes, 1/3 comes back as compression.
"""

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il

case = il.load_case("hopkinson_chain").method("continuous")
history = il.run(case)
t = np.linspace(0.0, history.duration, 700)
fig, axis = plt.subplots(figsize=(8, 4.4))
start = 0.0
for name, body in history.scene.elastic.items():
    x = np.linspace(0.0, body.length, 200)
    force = np.stack([history.evaluate(t, f"force:{name}@{place:.6g}") for place in x], axis=1)
    where = (start, start + body.length, 0.0, 1e6 * history.duration)
    image = axis.imshow(
        1e-3 * force,
        origin="lower",
        aspect="auto",
        extent=where,
        cmap="RdBu_r",
        vmin=-53,
        vmax=53,
    )
    axis.text(
        start + body.length / 2,
        1e6 * history.duration,
        name,
        ha="center",
        va="bottom",
        fontsize=9,
    )
    start += body.length + 0.03
axis.grid(visible=False)
axis.set(
    xlim=(0.0, start - 0.03),
    ylim=(0.0, 1e6 * history.duration),
    xlabel="place  [m]",
    ylabel="time  [µs]",
)
fig.colorbar(image, label="force, positive in compression  [kN]")
