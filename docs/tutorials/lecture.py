"""
Waves in a lecture
==================

Three pictures for a course on impact: the wave diagram of a struck bar, why some masses
strike twice, and a ball that meets a beam three times while everybody sees one bounce.
Each is a few lines; change a number and run it again.
"""

# %%
# Place and time
# --------------
# The picture of textbooks: place to the right, time upwards. A mass strikes a clamped
# bar. Fronts are straight lines of slope :math:`1/c`; compression comes back as
# compression from the clamped end.

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il


def struck(alpha, trips=3.0):
    """Return a clamped steel bar struck at 1 m/s by a mass of 1/alpha times its own."""
    bar = il.Rod(
        length="0.3 m",
        area="9 cm^2",
        material={"young": 2.1e11, "density": 7900},
        ends={"right": "clamped"},
    )
    bodies = {"mass": il.Mass(2.133 / alpha, velocity=1.0), "bar": bar}
    solve = {"duration": {"round_trips": trips}, "tolerance": 1e-3}
    return il.Case(
        name="struck", bodies=bodies, contacts=[il.Contact("mass", "bar.left")], solve=solve
    )


case = struck(1.0)
history = il.run(case)
T = history.scene.round_trip
t, x = np.linspace(0.0, history.duration, 500), np.linspace(0.0, 0.3, 121)
stress = np.stack([history.evaluate(t, f"stress:bar@{place:.6g}") for place in x], axis=1)
limit = 1e-6 * np.abs(stress).max()
fig, axis = plt.subplots(figsize=(5.6, 5.2))
image = axis.imshow(
    1e-6 * stress,
    origin="lower",
    aspect="auto",
    extent=(0, 300, 0, 1e6 * history.duration),
    cmap="RdBu_r",
    vmin=-limit,
    vmax=limit,
)
for span in history.contacts:
    axis.plot(
        [0, 0],
        [1e6 * span.start, 1e6 * span.until(history.duration)],
        color="black",
        linewidth=5,
        solid_capstyle="butt",
    )
axis.grid(visible=False)
axis.set(xlabel="place  [mm]", ylabel="time  [µs]", title="Stress; black: in contact")
fig.colorbar(image, label="stress  [MPa]")

# %%
# ``history.plot_xt()`` draws this picture in one line, with several bars end to end. With the
# file of the second tab, ``impactlab run struck.yaml --out page`` writes a page whose scene
# moves, with a cursor that links diagram and traces, and ``impactlab animate struck.yaml -o
# waves.gif`` (or ``waves.mp4``) films it for a slide; so does ``history.animate("waves.gif")``.

# %%
# One blow or two?
# ----------------
# The force jumps by :math:`2 Z v_0` with each front that returns while they touch, and
# falls between them, the faster the larger :math:`\alpha`, the mass of the bar over that
# of the hammer. A heavy hammer stays for many round trips; a mass as heavy as the bar is
# met again after the first rebound. Ask the class before showing the second contact: it
# exists only for :math:`0.5786 < \alpha < 1.0107`.

fig, axes = plt.subplots(3, 1, figsize=(8, 5.6), sharex=True, layout="constrained")
for axis, alpha in zip(axes, (0.25, 1.0, 3.0), strict=True):
    run = il.run(struck(alpha, trips=3.5))
    at = np.linspace(0.0, run.duration, 3000)
    axis.fill_between(at / T, 1e-3 * run.evaluate(at, "force:mass|bar.left"), alpha=0.3)
    axis.plot(at / T, 1e-3 * run.evaluate(at, "force:mass|bar.left"))
    hits = len(run.contacts)
    axis.set(
        title=f"hammer of {1 / alpha:.2g} bars: {hits} contact{'s' if hits > 1 else ''}",
        ylabel="force  [kN]",
    )
axes[-1].set(xlabel="time in round trips  t/T", xlim=(0, 3.5))

# %%
# A ball on a beam
# ----------------
# Timoshenko's second example of 1913. A steel ball of 2 cm meets a simply supported beam
# at 1 cm/s, and meets it three times in one collision. The restitution that a bystander
# measures is no property of steel: it is the vibration left in the beam.

case = il.load_case("sphere_on_long_beam")
run = il.run(case)
at = np.linspace(0.0, run.duration, 3000)
ball, beam = (
    run.evaluate(at, "position:sphere"),
    run.evaluate(at, "displacement:beam@0.1535"),
)
fig, (path, force) = plt.subplots(2, 1, figsize=(8, 4.6), sharex=True)
path.plot(1e3 * at, 1e6 * ball, label="ball")
path.plot(1e3 * at, 1e6 * beam, label="middle of the beam")
path.set(ylabel="displacement  [µm]", title="One collision, three contacts")
path.legend(frameon=False)
force.fill_between(1e3 * at, run.evaluate(at, "force:sphere|beam.at(0.1535)"))
force.set(xlabel="time  [ms]", ylabel="force  [N]")
arrived, left = 0.01, float(run.evaluate(run.duration, "velocity:sphere"))
print(f"contacts: {len(run.contacts)}; apparent restitution {-left / arrived:.3f}")
