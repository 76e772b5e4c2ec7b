"""
Driving a pile
==============

A ram falls on a cushion; below it are a cap, a concrete pile and the toe. How large is
the stress at the head, and where does tension crack the pile? The one-dimensional wave
equation gives both, exactly, for one blow and a linear toe.
"""

# %%
# One blow
# --------
# Positions and velocities are positive downwards, stress is positive in compression. A
# tolerance in place of a method: hard contact between cap and pile, and the cheapest
# description that keeps 0.1 %.

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il


def blow(cushion=8e8, toe=1e5):
    """Return the case of one blow: cushion [N/m], dashpot of the toe [N s/m]."""
    bodies = {
        "ram": il.Mass("6 t", velocity="4 m/s"),
        "cap": il.Mass("400 kg"),
        "pile": il.Rod(
            length="12 m",
            width="300 mm",
            height="300 mm",
            material="concrete",
            ends={"right": {"dashpot": toe}},
        ),
    }
    contacts = [
        il.Contact("ram", "cap", {"kind": "penalty", "stiffness": cushion, "damping": 2e5}),
        il.Contact("cap", "pile.left"),
    ]
    probes = [
        {"body": "pile", "at": at, "quantity": "stress"} for at in ("0 m", "3 m", "6 m", "11 m")
    ]
    solve = {"duration": "20 ms", "tolerance": 1e-3}
    return il.Case(name="pile", bodies=bodies, contacts=contacts, probes=probes, solve=solve)


case = blow()
history = il.run(case)
t = np.linspace(0.0, history.duration, 2000)
fig, axis = plt.subplots(figsize=(8, 3.2))
for x in (0, 3, 6, 11):
    axis.plot(
        1e3 * t,
        1e-6 * history.evaluate(t, f"stress:pile@{x}"),
        label=f"{x} m below the head",
    )
axis.axhline(0.0, color="0.6", linewidth=0.8)
axis.set(
    xlabel="time  [ms]",
    ylabel="stress  [MPa]",
    title="Stress in the pile; tension is negative",
)
axis.legend(frameon=False)

# %%
# The second tab holds the same case as a file, for ``impactlab run pile.yaml --out page``.

# %%
# The waves
# ---------
# The impedance of the pile is :math:`Z = \rho c A`. A toe with the dashpot :math:`D` sends
# back the share :math:`(D - Z)/(D + Z)` of what arrives (:doc:`/theory/bar-impact`): a soft
# toe sends compression back as tension.

c = np.sqrt(30e9 / 2400)
impedance = 2400 * c * 0.09
x = np.linspace(0.0, 12.0, 121)
stress = np.stack([history.evaluate(t, f"stress:pile@{place:.6g}") for place in x])
limit = 1e-6 * np.abs(stress).max()
fig, axis = plt.subplots(figsize=(8, 3.6))
image = axis.imshow(
    1e-6 * stress,
    aspect="auto",
    extent=(0, 20, 12, 0),
    cmap="RdBu_r",
    vmin=-limit,
    vmax=limit,
    interpolation="nearest",
)
axis.grid(visible=False)
axis.set(
    xlabel="time  [ms]",
    ylabel="depth below the head  [m]",
    title="Stress; red is compression, blue tension",
)
fig.colorbar(image, label="stress  [MPa]")
share = (1e5 - impedance) / (1e5 + impedance)
print(f"Z = {1e-3 * impedance:.0f} kN s/m; the toe returns {share:+.2f} of each wave")

# %%
# Largest stresses along the pile
# -------------------------------
# A stiff toe (large :math:`D`) nearly doubles the compression there; a soft one sends
# tension back up the pile.

fig, axes = plt.subplots(1, 2, figsize=(8, 3.6), sharey=True)
for toe in (1e5, 4e5, impedance, 4e6):
    run = il.run(blow(toe=toe))
    all_of_it = np.stack([run.evaluate(t, f"stress:pile@{place:.6g}") for place in x])
    label = f"D = {toe / impedance:.2g} Z"
    axes[0].plot(1e-6 * all_of_it.max(axis=1), x, label=label)
    axes[1].plot(-1e-6 * all_of_it.min(axis=1), x, label=label)
axes[0].set(
    xlabel="compression  [MPa]",
    ylabel="depth below the head  [m]",
    ylim=(12, 0),
    title="Largest compression",
)
axes[1].set(xlabel="tension  [MPa]", title="Largest tension")
axes[1].legend(frameon=False)

# %%
# The cushion
# -----------
# A softer cushion lowers both the stress at the head and the tension below it. Each of
# these 24 runs is exact.

stiffness = np.geomspace(5e7, 5e9, 24)
head, middle = [], []
for k in stiffness:
    run = il.run(blow(cushion=k))
    head.append(1e-6 * run.evaluate(t, "stress:pile@0").max())
    middle.append(-1e-6 * run.evaluate(t, "stress:pile@3").min())
fig, axis = plt.subplots(figsize=(8, 3.2))
axis.semilogx(1e-6 * stiffness, head, label="compression at the head")
axis.semilogx(1e-6 * stiffness, middle, label="tension 3 m below it")
axis.set(
    xlabel="stiffness of the cushion  [MN/m]",
    ylabel="stress  [MPa]",
    title="Effect of the cushion",
    ylim=(0, None),
)
axis.legend(frameon=False)

# %%
# Soil that yields
# ----------------
# A dashpot at the toe is enough for **driving stresses and waves in one blow**. Set, blow
# count and residual forces need soil that yields along the shaft and under the toe; the
# capacity is found from signals at the head: see :doc:`/pile-driving`. Diesel hammers are not
# included. A cushion with a law of its own is written in :doc:`own_law`.
