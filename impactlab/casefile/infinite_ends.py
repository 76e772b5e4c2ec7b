"""Checks of bodies with an infinite end at t = 0: at rest, unstrained there, and without weight."""

from __future__ import annotations

import numpy as np

from impactlab.casefile.blocks.shared import ElasticBlock
from impactlab.casefile.schema import CaseBlock
from impactlab.errors import CaseError
from impactlab.scene.bodies import Beam, ElasticBody
from impactlab.types import Array

SLOPES = 401  # places along a body whose slopes are compared
# Of a length: differences of the second order have an error of 1e-9, with rounding, of a smooth shape.
SLOPE_STEP = 1e-5
MAX_SLOPE = 1e-6  # of the largest slope, that an end may have, as of the tail of a pulse
MAX_ROUNDING = 1e-14  # of the largest displacement, in the sum of three of them
BEND_STEPS = 4e-3, 1e-3, 2.5e-4  # of a length: a derivative of a shape is 0 where it is by one of these steps
MAX_BEND = 1e-3  # of the largest of its kind along the beam: bending moment and shear force that an end may have
MAX_BEND_ROUNDING = 1e-13  # of the largest deflection, in the sum of six of them
# One-sided differences over six places: the second derivative to fourth order, the third to third order.
CURVATURE = 15.0 / 4.0, -77.0 / 6.0, 107.0 / 6.0, -13.0, 61.0 / 12.0, -5.0 / 6.0
ITS_SLOPE = -17.0 / 4.0, 71.0 / 4.0, -59.0 / 2.0, 49.0 / 2.0, -41.0 / 4.0, 7.0 / 4.0


def check_rest(case: CaseBlock, body: ElasticBody, gravity: float) -> None:
    """Raise `CaseError` where a body with an infinite end cannot rest.

    It moves, is strained at that end, or has weight [m/s2]. The end is a dashpot of the impedance, which stands for a
    far part at rest: it would brake a body that moves with its far part, let go of one that is strained with it, and
    bear a weight that nothing bears. Of beams only the strain is checked here; where they move or have weight is
    checked where they are built, in all models.
    """
    block = case.bodies[body.name]
    if isinstance(body, Beam):
        _check_straight(body)
        return
    if not isinstance(block, ElasticBlock):
        return
    for side in ("left", "right"):
        if getattr(block.ends, side).kind != "infinite":
            continue
        key = "twist_rate" if body.kind == "shaft" else "velocity"
        given, unit = getattr(block, key), "rad/s" if body.kind == "shaft" else "m/s"
        path, dashpot = f"bodies.{body.name}", f"ends: {{{side}: {{dashpot: {_impedance(body, side):.6g}}}}}"
        if given != 0.0:
            raise CaseError(
                f"'{body.name}' has {key} {given:.6g} {unit} at t = 0 and an infinite end ({side}). The "
                "part beyond this end is at rest and would slow the body down. Allowed with an infinite "
                f"end: {key} 0",
                remedy=(
                    f"Give the velocity to the other body, or make the {body.kind} so long that no wave "
                    "returns from a free end within the run. For a dashpot that acts on the velocity give "
                    f"{dashpot}."
                ),
                path=f"{path}.{key}",
            )
        if slope := slope_at_end(body, side):
            raise _strained(body, side, slope, path, dashpot)
        if gravity != 0.0 and body.falls:
            raise CaseError(
                f"gravity acts on '{body.name}', which has an infinite end ({side}): the weight of the "
                "part beyond this end has no bound. Allowed with an infinite end: no gravity",
                remedy=(
                    f"Leave gravity out, or make the {body.kind} so long that no wave returns from its end "
                    f"within the run. For a dashpot that acts on the velocity give {dashpot}."
                ),
                path=f"{path}.ends.{side}",
            )


def _strained(body: ElasticBody, side: str, slope: float, path: str, dashpot: str) -> CaseError:
    """Return the error of a body with strain, a slope, at an infinite end."""
    key, given = "displacement", f"strain of {slope:.6g}"
    if body.kind == "shaft":
        key, given = "twist", f"twist of {slope / getattr(body, 'lever_arm', 1.0):.6g} rad/m"
    return CaseError(
        f"'{body.name}' has a {given} at t = 0 at its infinite end ({side}). The part beyond this "
        "end has no strain, so that the end would spring back. Allowed with an infinite end: a "
        f"{key} whose slope is 0 there",
        remedy=(
            f"Let the {key} be constant near that end, or make the {body.kind} so long that no wave "
            "returns from its end within the run. For a dashpot that acts on the velocity give "
            f"{dashpot}."
        ),
        path=f"{path}.{key}",
    )


def _check_straight(beam: Beam) -> None:
    """Raise `CaseError` where a beam is bent at an infinite end.

    It is bent at t = 0: its far part is straight, and lets go.
    """
    for side in ("left", "right"):
        if getattr(beam, side).kind != "infinite" or beam.displacement is None:
            continue
        stiffness = beam.segments[0 if side == "left" else -1].bending_stiffness
        bent, sheared = (stiffness * found for found in bend_at_end(beam, side))
        faults = [f"a bending moment of {bent:.6g} N m"] if bent else []
        faults += [f"a shear force of {sheared:.6g} N"] if sheared else []
        if faults:
            raise CaseError(
                f"'{beam.name}' has {' and '.join(faults)} at t = 0 at its infinite end ({side}). The "
                "part beyond this end is straight, so that the end would spring back. Allowed with an "
                "infinite end: a displacement without curvature, and without slope of the curvature, "
                "there",
                remedy=(
                    "Let the displacement be a straight line near that end, or give the beam another end, "
                    "and a length from which no wave returns within the run."
                ),
                path=f"bodies.{beam.name}.displacement",
            )


def bend_at_end(beam: Beam, side: str) -> tuple[float, float]:
    """Return a displacement's curvature [1/m] and minus its slope [1/m2].

    They are those at an end at t = 0; 0 where negligible.
    """
    if beam.displacement is None:
        return 0.0, 0.0
    whole, profile = beam.length, beam.displacement
    x = np.linspace(0.0, whole, SLOPES)
    along = profile(x)
    deepest, apart = float(np.abs(along).max()), float(x[1] - x[0])

    def at_end(order: int, weights: tuple[float, ...]) -> float:
        largest = float(np.abs(np.diff(along, order)).max()) / apart**order
        found = 0.0
        for step in (share * whole for share in BEND_STEPS):
            steps: Array = step * np.arange(float(len(weights)))
            u = profile(steps if side == "left" else whole - steps)
            value = float(np.dot(weights, u)) / step**order
            if abs(value) <= MAX_BEND * largest:
                return 0.0
            if abs(value) > MAX_BEND_ROUNDING * deepest / step**order:
                found = found or value
        return found

    inwards = -1.0 if side == "right" else 1.0  # of x, to which odd derivatives turn
    return at_end(2, CURVATURE), -inwards * at_end(3, ITS_SLOPE)


def slope_at_end(body: ElasticBody, side: str) -> float:
    """Return the slope of the displacement at an end at t = 0.

    It is 0 where it is rounding, or negligible beside the largest slope.
    """
    if body.displacement is None:
        return 0.0
    step = SLOPE_STEP * body.length
    steps = np.array([0.0, step, 2.0 * step])
    u = body.displacement(steps if side == "left" else body.length - steps)
    slope = float(-1.5 * u[0] + 2.0 * u[1] - 0.5 * u[2]) / step * (1.0 if side == "left" else -1.0)
    x = np.linspace(0.0, body.length, SLOPES)
    along = body.displacement(x)
    largest = float(np.abs(np.diff(along)).max()) / (x[1] - x[0])
    least = max(MAX_SLOPE * largest, MAX_ROUNDING * float(np.abs(along).max()) / step)
    return slope if abs(slope) > least else 0.0


def _impedance(body: ElasticBody, side: str) -> float:
    """Return the dashpot of an infinite end in N s/m, of a shaft in N m s."""
    value = (body.left if side == "left" else body.right).value
    return value * getattr(body, "lever_arm", 1.0) ** 2
