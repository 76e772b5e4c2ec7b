"""The warning of a beam, held and straight at t = 0, that gravity swings about its static sag."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from impactlab.history.base import Warned
from impactlab.models.base import AbstractDiscreteModel, Operators
from impactlab.models.mesh.base import AbstractMesh
from impactlab.numerics.banded import multiply, solve
from impactlab.scene.bodies import Beam
from impactlab.scene.facts import beams_of
from impactlab.scene.problem import Scene
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.types import Array

SWING_WARN = 0.01  # of the motion of a face or a probe in the run: the share that the swing has in it
# Static deflection of a uniform beam under q per length over q/(24 EI), as a formula of x and L.
SAGS = {
    ("clamped", "free"): "x**2*(6*L**2 - 4*L*x + x**2)",
    ("free", "clamped"): "(L - x)**2*(3*L**2 + 2*L*x + x**2)",
    ("pinned", "pinned"): "x*(L - x)*(L**2 + L*x - x**2)",
    ("clamped", "clamped"): "x**2*(L - x)**2",
    ("clamped", "pinned"): "x**2*(L - x)*(1.5*L - x)",
    ("pinned", "clamped"): "x*(L - x)**2*(0.5*L + x)",
}


def warnings(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Yield a warning for each beam whose swing by gravity matters.

    The swing about the static sag is a large share of its motion. None of a scene in which gravity alone moves a beam,
    as one that is held straight and let go, nor of a beam with a given displacement at t = 0.
    """
    scene = history.scene
    if scene.gravity == 0.0:
        return
    for body in beams_of(scene):
        if body.displacement is not None or not _something_else_moves(scene, body.name):
            continue
        model, system = history.built[body.name].model, history.built[body.name].system
        if not _is_held(model, system) or system.load.size == 0:
            continue
        weight = model.momentum_row() * scene.gravity
        sag = solve(system.stiffness, weight)
        swing = _share_of_sag(sag, weight, system, history.duration)
        found = []
        for x, channel in _places(history, body):
            at = float(model.row(x, "displacement") @ sag)
            moved = float(np.ptp(history.recorded[channel].values))
            limit = 0.5 * abs(scene.gravity) * history.duration**2  # of a free fall from rest
            found.append((min(swing * abs(at), limit) / moved if moved > 0.0 else 0.0, x, at, moved))
        share, x, at, moved = max(found, default=(0.0, 0.0, 0.0, 0.0))
        if share > SWING_WARN:
            yield Warned("static_sag", _text(body, scene.gravity, (x, at, moved), share * moved))


def _something_else_moves(scene: Scene, beam: str) -> bool:
    """Return whether more than the weight of a beam moves it.

    It may be another body, a force, or an overlap.
    """
    others = (body for name, body in scene.bodies.items() if name != beam)
    at_rest = scene.bodies[beam].velocity == 0.0 and not scene.loaded_ends
    return not at_rest or any(body.moves for body in others) or any(each.gap < 0.0 for each in scene.contacts)


def _is_held(model: AbstractDiscreteModel, system: Operators) -> bool:
    """Return whether the supports of a body bear its weight."""
    if isinstance(model, AbstractMesh):
        return model.is_held
    return system.modes and bool(np.all(system.stiffness[0] > 0.0))


def _share_of_sag(sag: Array, weight: Array, system: Operators, duration: float) -> float:
    """Return how far a beam swings within a run, over its sag.

    It is 1 - cos of the phase of its slowest motion, at most 2. The frequency is Rayleigh's quotient of the sag.
    """
    frequency = math.sqrt(float(weight @ sag) / float(sag @ multiply(system.mass, sag)))
    return 1.0 - math.cos(min(frequency * duration, math.pi))


def _places(history: AbstractRecordedHistory, beam: Beam) -> Iterator[tuple[float, str]]:
    """Yield the places of a beam [m] whose displacement is recorded, and their channels."""
    places = [point.x for point in history.scene.faces if point.body == beam.name]
    places += [probe.x for probe in history.scene.recorded_probes if probe.body == beam.name]
    for x in dict.fromkeys(places):
        if (channel := beam.face_channel(x)) in history.recorded:
            yield x, channel


def _text(beam: Beam, gravity: float, largest: tuple[float, float, float], swing: float) -> str:
    """Return the text of a warning of a beam's sag.

    ``largest`` holds place [m], sag there [m] and motion there [m]; ``swing`` is how far the weight swings the place
    [m].
    """
    x, at, moved = largest
    start = "start from the sag by its displacement at t = 0"
    segment = beam.segments[0]
    shape = SAGS.get((beam.left.kind, beam.right.kind))
    if shape is not None and len(beam.segments) == 1 and beam.tension == 0.0 and beam.rotation is None:
        factor = gravity * segment.density * segment.area / (24.0 * segment.bending_stiffness)
        start = f"start from the sag, displacement: {factor:.6g}*{shape}"
    return (
        f"'{beam.name}' is straight at t = 0, and its weight acts from then on: it vibrates about "
        f"its static sag, {at:.3g} m at {x:.6g} m, by up to {swing:.3g} m within the run, while "
        f"it moves by {moved:.3g} m there. If it hangs at rest at the start, {start} (gaps count "
        "from the straight beam), or leave gravity out: displacements, gaps and moments then "
        "count from the sag"
    )
