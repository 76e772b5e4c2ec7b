"""Impedance residual: a spring and a dashpot in place of the modes left out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw, needs_waves
from impactlab.errors import PairingError
from impactlab.types import Level, Port, Reply, SideFacts, Start


@final
@dataclass(frozen=True)
class ImpedanceResidual(AbstractContactLaw):
    """Impedance residual: the modes left out are a spring and a dashpot of impedance Z.

    Both act between the faces. F = k x + Z x', with k the inverse of the static compliance left out and x the
    compression: the overlap of the modal faces while closed. While open x relaxes by k x + Z x' = 0 and the true faces
    stand at the modal ones plus x. The contact opens where F would pull. The energy of the dashpot, Z x'^2 dt, has gone
    into modes that are left out and is booked as unresolved. At touch F = Z (approach speed), as in one-dimensional
    wave theory.

    References
    ----------
    MacNeal1971 (residual flexibility); the dashpot is our own: the modes left out carry waves away at the impedance Z.
    """

    needs = frozenset({Level.POSITION})
    citations = ("MacNeal1971",)
    hard = True
    # Measured: touches found a step late. 0.008 at ends (docs/bounds.md), 0.078 at inner points with ten points per
    # period, where more contacts follow each other.
    gains_energy = 0.1

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        rods = [facts for facts in (left, right) if facts.kind == "rod"]
        if not rods:
            needs_waves("impedance_residual", left, right)
            raise PairingError(
                "impedance_residual stands for the axial modes that the model of a rod leaves out, and this contact "
                f"has no rod: '{left.body}' is a {left.kind}, '{right.body}' a {right.kind}",
                remedy="Use addition_deletion, penalty or hertz; on a beam also dispersive_identification.",
            )
        compliance, dashes = 0.0, 0.0
        for facts in rods:
            if math.isnan(facts.impedance):
                raise PairingError(
                    f"impedance_residual needs the impedance of a rod, and the rod '{facts.body}' has none here",
                    remedy="Use addition_deletion.",
                )
            # A body without modes left out adds no compliance, nor does a basis with the static response of the face:
            # the remainder on a free rod is a spring that no step resolves.
            if facts.left_out * facts.element_stiffness > 1e-2:
                compliance += facts.left_out
                dashes += 1.0 / facts.impedance
        if compliance == 0.0:
            raise PairingError(
                "impedance_residual represents modes that are left out, and no body of this contact leaves any out",
                remedy="Use modal with basis eigenvectors and fewer modes than its mesh has, or addition_deletion.",
            )
        return Start(parameters=(1.0 / compliance, 1.0 / dashes), memory=(0.0,))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        stiffness, impedance, compression = port.parameters[0], port.parameters[1], port.memory[0]
        dt = port.dt
        if port.in_contact == 0.0 and port.gap + compression <= 0.0:
            compression = -port.gap  # a touch found late: the overlap is the compression
        if port.in_contact > 0.0 or port.gap + compression <= 0.0:
            # The spring's force is the mean over the travel, so that it returns the energy it took; an explicit scheme
            # keeps another energy, in which it is that of the start.
            spring = 0.0 if port.acting_gap_per_force == 0.0 else 0.5 * stiffness
            dash = impedance / dt
            push = stiffness * compression - (spring + dash) * port.free_travel
            reply.trial = push / (1.0 + (spring + dash) * port.travel_per_force)
        if reply.trial > 0.0:
            reply.force = reply.trial
            reply.in_contact = 1.0
            now = -(port.free_gap + port.gap_per_force * reply.force)
            reply.unresolved = impedance * (now - compression) ** 2 / dt
        else:
            compression = port.memory[0]
            now = compression * math.exp(-stiffness * dt / impedance)
            reply.unresolved = 0.5 * stiffness * (compression + now) * (compression - now)
        reply.stored = 0.5 * stiffness * now * now
        reply.memory[0] = now
        reply.offset = now
