"""
A contact law of your own
=========================

A cushion of wood under a pile hammer unloads along a steeper line than it was loaded
along, and keeps a permanent set. impactlab has this law as ``bilinear``, after Smith
(1960). This page writes it again, in 35 lines, to show the parts of a law. It checks the
law against a known result, puts it under a ram, and compares it with ``bilinear``.
"""

# %%
# The law
# -------
# On loading the cushion follows :math:`F = k\delta`, on unloading :math:`F =
# (k/e^2)(\delta - \delta_p)` with the set :math:`\delta_p = (1 -
# e^2)\,\delta_\text{max}`: it returns the share :math:`e^2` of the energy that it
# absorbed, so that :math:`e` is its coefficient of restitution. The force is the lower of
# both lines: :math:`F = \max(0, \min(k\delta,\ (k/e^2)(\delta - \delta_p)))`.
#
# A law sees one record, the *port*: the gap of its contact without force, and the gap per
# unit force. With overlap :math:`\delta = \delta_0 - Y F` each line gives its force in
# closed form, so any stiffness is stable under an implicit scheme.

from dataclasses import dataclass, replace

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.bilinear import Bilinear
from impactlab.types import Level, Port, Reply, SideFacts, Start, option


@dataclass(frozen=True)
class Cushion(AbstractContactLaw):
    """Cushion: loads along k, unloads along k/e^2, with a permanent set."""

    needs = frozenset({Level.POSITION})
    citations = ("Smith1960",)
    gains_energy = 0.01  # of the initial energy, in steps that resolve the contact

    stiffness: float = option(unit="N/m", above=0.0, description="k, on loading")
    restitution: float = option(
        0.5, above=0.0, at_most=1.0, description="coefficient of restitution e"
    )

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(
            parameters=(self.stiffness, self.stiffness / self.restitution**2),
            memory=(0.0, 0.0),
        )

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        k, k_back, deepest, stored = (
            port.parameters[0],
            port.parameters[1],
            port.memory[0],
            port.memory[1],
        )
        overlap, compliance = (
            -port.acting_gap,
            port.acting_gap_per_force,
        )  # m without force; m per N, by which a force reduces it
        loading = k * overlap / (1.0 + k * compliance)
        unloading = (
            k_back * (overlap - (1.0 - k / k_back) * deepest) / (1.0 + k_back * compliance)
        )
        reply.trial = min(loading, unloading)
        reply.force = max(0.0, reply.trial)
        reply.in_contact = 1.0 if reply.force > 0.0 else 0.0
        end = -(
            port.free_gap + port.gap_per_force * reply.force
        )  # overlap at the end of the step
        reply.memory[0] = max(deepest, end)
        held = max(0.0, min(k * end, k_back * (end - (1.0 - k / k_back) * reply.memory[0])))
        reply.memory[1] = reply.stored = 0.5 * held**2 / k_back
        work = -reply.force * (port.free_travel + port.travel_per_force * reply.force)
        reply.dissipated = max(0.0, work - (reply.stored - stored))


# %%
# A known result
# --------------
# A mass on a rigid wall returns with :math:`e` times its speed, whatever its mass and the
# stiffness.

ball = il.Case(
    bodies={"ball": il.Mass("1 kg", velocity="1 m/s"), "wall": il.Wall()},
    contacts=[il.Contact("ball", "wall", {"kind": "penalty", "stiffness": 1e6})],
    solve={"duration": "8 ms", "integrator": {"kind": "midpoint"}, "step": {"dt": "5 us"}},
)
t = np.linspace(0.0, 8e-3, 1000)
fig, axis = plt.subplots(figsize=(8, 3.4))
for e in (0.3, 0.6, 0.9):
    history = il.run(ball.simulation().but(law=Cushion(stiffness=1e6, restitution=e)))
    left = history.evaluate(8e-3, "velocity:ball")
    overlap, force = (
        -history.evaluate(t, "gap:ball|wall"),
        history.evaluate(t, "force:ball|wall"),
    )
    axis.plot(
        1e3 * overlap[force > 0.0],
        1e-3 * force[force > 0.0],
        label=f"e = {e}: returns with {-left:.4f} of its speed",
    )
axis.set(
    xlabel="overlap  [mm]",
    ylabel="force  [kN]",
    title="The cushion between a ball and a wall",
    xlim=(0.0, None),
)
axis.legend(frameon=False)

# %%
# Under the ram
# -------------
# A ram drives a concrete pile whose toe rests on a dashpot (``impactlab new pile.yaml --like
# pile`` writes a larger case to start from). The law states no branches, so the exact solver
# does not support it and the rod steps as a delay line: both waves are kept exactly, and
# the contact is solved once in a step.

pile = il.Case(
    bodies={
        "ram": il.Mass("6 t", velocity="4 m/s"),
        "cap": il.Mass("400 kg"),
        "pile": il.Rod(
            length="12 m",
            width="300 mm",
            height="300 mm",
            material="concrete",
            ends={"right": {"dashpot": 4e5}},
        ),
    },
    contacts=[
        il.Contact("ram", "cap", {"kind": "penalty", "stiffness": 8e8}),
        il.Contact("cap", "pile.left", {"kind": "penalty", "stiffness": 5e9}),
    ],
    probes=[{"body": "pile", "at": 0.0, "quantity": "stress"}],
    solve={"duration": "20 ms", "model": {"kind": "continuous"}, "step": {"dt": "10 us"}},
)
scene, method = pile.simulation()
t = np.linspace(0.0, 20e-3, 2000)


def force_with(law: AbstractContactLaw) -> np.ndarray:
    """Return the force between ram and cap with a law of the cushion."""
    laws = {**method.laws, "ram|cap": law}
    history = il.run(il.api.Simulation(scene, replace(method, laws=laws)))
    return history.evaluate(t, "force:ram|cap")


forces = {e: force_with(Cushion(stiffness=8e8, restitution=e)) for e in (1.0, 0.5)}
fig, axis = plt.subplots(figsize=(8, 3.2))
for e, force in forces.items():
    axis.plot(1e3 * t, 1e-6 * force, label=f"cushion with e = {e}")
axis.set(xlabel="time  [ms]", ylabel="force  [MN]", title="Force of the cushion")
axis.legend(frameon=False)

# %%
# The same as ``bilinear``
# ------------------------
# The law of impactlab, with the same stiffness and the same e, gives the same force except
# for the error of the steps.

for e, force in forces.items():
    same = force_with(Bilinear(stiffness=8e8, restitution=e))
    largest = np.max(np.abs(force - same)) / np.max(same)
    print(f"e = {e}: largest difference {largest:.1e} of the peak force")
    assert largest < 1e-3

# %%
# Next
# ----
# Register the class as an entry point, and case files can name it
# (:doc:`/how-to-write-a-plugin`). Then
#
# - ``impactlab plugins --check cushion`` runs the contract of laws (momentum, energy, no pull)
#   and measures order, energy and cost per step;
# - ``impactlab bench two_rods`` with a family of yours draws speed against error beside all
#   other methods (:doc:`/bench`);
# - integrators, models and bodies work the same way: :doc:`/how-to-add-an-integrator`,
#   :doc:`/how-to-add-a-model`.
