"""Rounding errors of meshes displaced as a whole, whose forces cancel except for the last digits."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from impactlab.scene.bodies import ElasticBody
from impactlab.scene.method import modelled
from impactlab.simulate.channels import AbstractRecordedHistory

MAX_ROUNDED = 1e-5  # of the momentum or energy of its motion: more would show beside the smallest errors that count


class Rounded(NamedTuple):
    """Momentum and energy that rounding may give a body."""

    momentum: float  # N s
    energy: float  # J


NOTHING = Rounded(0.0, 0.0)


def rounded(history: AbstractRecordedHistory, time: float) -> dict[str, Rounded]:
    """Return momentum and energy by rounding of bodies on meshes, by name.

    They are bounds over [0, time]. The displacement u0 + v t of a body at first and by its flight is multiplied by the
    stiffness k of its slow motion and the share ``mesh_rounding`` of it that remains as a force. The energy E of a body
    bounds v = sqrt(2 E/m).
    """
    found = {}
    for body, model in modelled(history.scene, history.method):
        if not model.has_mesh:
            continue
        h = model.element_length(body)
        if (share := body.mesh_rounding(h)) > 0.0:
            energy = float(np.abs(history.energy.bodies[body.name]).max())
            found[body.name] = _rounded(body, share, body.length / h, energy, time)
    return found


def _rounded(body: ElasticBody, share: float, elements: float, energy: float, time: float) -> Rounded:
    mass, turn = body.moving_mass, math.sqrt(body.stiffness / body.moving_mass) * time  # phase of its slow motion
    turn = min(turn, 1.0) if body.is_held else turn  # a body that is held does not fly
    displaced = 0.0 if body.displacement is None else _largest(body)
    start, flight = math.sqrt(body.stiffness * mass) * displaced, math.sqrt(2.0 * mass * energy)  # N s
    momentum = min(MAX_ROUNDED, share * turn) * start + min(MAX_ROUNDED, share * turn**2) * flight
    share *= math.sqrt(elements)  # the strain energies of elements, each k u^2 where nothing is strained, are added up
    strain = min(MAX_ROUNDED, share) * start**2 + min(MAX_ROUNDED, share * turn**2) * flight**2
    return Rounded(momentum, strain / mass)


def _largest(body: ElasticBody) -> float:
    """Return the largest displacement at t = 0 [m], of 101 places."""
    assert body.displacement is not None  # noqa: S101 - the caller knows
    return float(np.abs(body.displacement(np.linspace(0.0, body.length, 101))).max())
