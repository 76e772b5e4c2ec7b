"""
A band gap in a precompressed chain
===================================

Large and small steel beads alternate between two walls, pressed together by 20 N. The first
bead gets a small velocity, which excites all frequencies. Which of them arrive 80 beads
further on?
"""

# %%
# Under a static force Hertz's contacts are springs for small motion. ``granular.bands`` gives
# the frequencies that can travel through cells of one large and one small bead.

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il
from impactlab import granular

radii, force = np.array([5e-3, 2.5e-3]), 20.0  # m, N
masses = granular.sphere_mass(radii, 7850.0)
stiffness = granular.sphere_stiffness(210e9, 0.3, *radii)
bands = granular.bands(masses, stiffness, force)
print(bands, bands.gaps)

# %%
# In the case each contact begins with the overlap :math:`(F/k)^{2/3}`, so that all forces
# balance and the chain is at rest except for the first bead. The formula of :math:`i` gives the
# large mass to even beads, the small one to odd beads.

large, small = masses
overlap = (force / stiffness) ** (2.0 / 3.0)
case = il.Case(
    bodies={
        "left": il.Wall(),
        "first": il.Mass(large, velocity="1 mm/s"),
        "bead": il.Mass(f"{small} + {large - small}*((i + 1) % 2)", repeat=99),
        "right": il.Wall(),
    },
    contacts=[
        il.Chain(
            ["left", "first", "bead", "right"],
            {"kind": "hertz", "stiffness": stiffness},
            gap=-overlap,
            overlap="allowed",
        )
    ],
    solve={
        "duration": "6 ms",
        "integrator": {"kind": "central_difference"},
        "step": {"dt": "0.5 us"},
        "records": 12_000,
    },
)
history = il.run(case)

# %%
# The spectrum of the motion of bead 80, with a Hann window against leakage. Within the gap
# almost nothing arrives.

time = np.linspace(0.0, history.duration, 12_000, endpoint=False)
velocity = np.hanning(time.size) * history.evaluate(time, "velocity:bead_80")
spectrum = np.abs(np.fft.rfft(velocity))
frequency = np.fft.rfftfreq(time.size, time[1])

fig, (curves, arrived) = plt.subplots(1, 2, sharey=True, figsize=(8, 3.6), layout="constrained")
curves.plot(bands.phase / np.pi, 1e-3 * bands.frequency.T, color="k")
curves.set(xlabel="phase from cell to cell  q / π", ylabel="frequency  [kHz]", xlim=(0, 1))
shown = frequency < 60e3
arrived.semilogx(spectrum[shown] / spectrum.max(), 1e-3 * frequency[shown])
arrived.set(xlabel="amplitude at bead 80, relative", xlim=(1e-6, 2))
for axis in (curves, arrived):
    for low, high in bands.gaps:
        axis.axhspan(1e-3 * low, 1e-3 * high, alpha=0.15)

(low, high), top = bands.gaps[0], bands.edges[-1][1]
print(f"gap {low / 1e3:.1f} to {high / 1e3:.1f} kHz, no wave above {top / 1e3:.1f} kHz")
inside = (frequency > 1.2 * low) & (frequency < high / 1.05)
passing = (frequency > 0.3 * low) & (frequency < 0.95 * low)
print(
    f"{spectrum[inside].mean() / spectrum[passing].mean():.1e} of the amplitude within the gap"
)
