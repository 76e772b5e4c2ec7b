"""Predicted solving time: a cost of set-up, and one per step and size.

The automatic choice orders descriptions by it, and a converged reference ends where it exceeds its budget. No clock is
read, so the same scene always has the same prediction. ``python benchmarks/cost_model.py`` measures runs of every
description, fits the constants of a step and prints them beside those in use. The exact solver counts the operations of
its first intervals instead (`impactlab.exact.cost`).
"""

from __future__ import annotations

from typing import NamedTuple

ALIKE_S = 2e-4  # s, of setting up a run that differs from an earlier one in its step alone
FIXED_S = 4.5e-5  # s, of any stepped run, however short
EIGENVECTORS_S = 1e-10  # s, over the cube of the coordinates of a mesh whose modes are found
POWER_S = 3.5e-7  # s, of a step in contact under a power law, whose force is found by iterations
CLOSED_FORM_S = 1e-5  # s, of a mode in closed form


class Cost(NamedTuple):
    """Cost of a description."""

    step_s: float  # s, per step of any size
    size_s: float = 0.0  # s, per step and unit of its size
    setup_s: float = 0.0  # s, before the first step
    fixed_s: float = FIXED_S  # s
    margin: float = 1.0  # factor where descriptions are compared: how far a prediction may be too low

    def seconds(self, steps: float, size: float = 0.0) -> float:
        """Return the predicted time of solving [s]."""
        return self.fixed_s + (self.step_s + self.size_s * size) * steps


def of_eigenvectors(coordinates: float) -> float:
    """Return the predicted time of finding the modes of a mesh [s]."""
    return EIGENVECTORS_S * coordinates**3


EXACT = Cost(1.0, setup_s=1.0e-3, fixed_s=0.0)  # steps: the seconds that `impactlab.exact.cost` predicts
RIGID = Cost(1.2e-7, 9e-7, setup_s=8e-4)  # size: contacts that share a body that moves, which are solved together
BEADS = Cost(5e-8, 4e-9, setup_s=8e-4)  # size: contacts
ADAPTIVE = Cost(6e-4, 3.4e-4)  # size: contacts beside the first
MECHANISM = Cost(1e-3, 1e-5)  # of adaptive steps; size: coordinates of all bodies
DELAY_LINE = Cost(1.5e-7, 2.5e-7, setup_s=1.0e-3)  # size: rods
LUMPED_MESH = Cost(1.7e-7, 0.65e-9, setup_s=1.2e-3, margin=1.2)  # size: elements of all rods
IMPLICIT_MESH = Cost(3.5e-7, 2.2e-9, setup_s=1.2e-3, margin=1.2)  # size: elements of all rods
BEAM_MODES = Cost(0.9e-7, 1.25e-9, setup_s=1.4e-3, margin=1.2)  # size: modes of all beams
BEAM_DAMPED_MODES = Cost(1.6e-7, 3e-9, setup_s=1.4e-3, margin=1.2)  # size: modes of all beams
BEAM_MESH = Cost(2e-7, 9e-9, setup_s=1.6e-3, margin=1.2)  # size: elements of all bodies
BEAM_DAMPED_MESH = Cost(5e-7, 1.8e-8, setup_s=1.6e-3, margin=1.2)  # size: elements of all bodies
BEAM_EXPLICIT = Cost(1.5e-7, 0.8e-9, setup_s=1.8e-3, margin=1.2)  # size: elements of all bodies
BEAM_GRIDS = Cost(4e-7, 1.1e-8, setup_s=2e-3)  # size: cells of the grids of all continuous beams
