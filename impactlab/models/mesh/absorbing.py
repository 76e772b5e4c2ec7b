"""Absorbing layers at infinite ends of a beam: more elements, with damping that grows outwards."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from impactlab.errors import CaseError, PairingError
from impactlab.models.mesh.bar_elements import spread
from impactlab.scene.bodies import Beam
from impactlab.types import Array, Ints

REACH = 2.0  # lengths of the beam that a layer is long at least
SPREAD = 16.0  # lengths (EI/(rho A))^(1/4) sqrt(t) that a layer is long at least, t the duration of the run
GROWTH, GROWTHS = 0.02, 2.0  # most that an element exceeds the one before by; most of that times the elements
COARSENING = 0.05  # of a lumped mesh: length of the last element over that of the layer
TURNING, TURNING_ALONE = 1.0, 2.0  # drag of the rotation at the far end over sqrt(rho A EI)
RETARDATION = 0.001  # at the far end over l^2 sqrt(rho A/EI), l the length of the layer
SHEAR_DRAG = 60.0  # of a lumped mesh that shears: drag at the far end over the shear speed and 1/l
MAX_ELEMENTS = 20_000  # of a layer
SENT_BACK, SENT_BACK_LUMPED = 5e-5, 2e-4  # of the largest displacement: errors by layers, of meshes of any fineness


class MeshLayout(NamedTuple):
    """Elements from left to right, layers included."""

    start: float  # m, of the first node: below 0 where a layer precedes the beam
    lengths: Array  # (n_elements,) m
    segment: Ints  # (n_elements,) number of the segment
    drag: Array  # (n_elements,) 1/s, damping over mass beyond that of the body
    turning: Array  # (n_elements,) N s, drag of the rotation, a moment over rate and length
    retardation: Array  # (n_elements,) s, damping over stiffness: that of the material, and of a layer
    alike: tuple[Ints, ...]  # numbers of elements that have the same matrices


def laid_out(beam: Beam, elements: int, lumped: bool, duration: float = 0.0) -> MeshLayout:
    """Return the elements of a beam, with an absorbing layer beyond each infinite end.

    The layer is twice as long as the beam at least, and 16 times the way (EI/(rho A))^(1/4) sqrt(t) that bending
    spreads in the ``duration`` t [s] of the run: waves longer than those that it absorbs are then too slow to come
    back. Where the beam shears, half the way of the fastest front is enough. Over its length l the drag of the rotation
    per length grows as sqrt(rho A EI) s^4, s from 0 to 1, and the retardation time of the material as 0.001 l^2
    sqrt(rho A/EI) s^3. A drag of the rotation damps all waves alike, over a number of their lengths, and leaves
    translation alone. Elements grow by 2 % and less, the less the more elements the beam has.

    Measured on an Euler-Bernoulli beam of 20 to 1000 elements, in runs of up to 10^4 times the period of its length:
    less than 0.05 % of a wave longer than 9 elements comes back that can be back before the end of the run. A mass that
    stays on a beam moves as on one of 30 m within 5e-5 of its largest displacement. With a lumped mass, for the sake of
    explicit schemes, there is no retardation and the drag is 2 sqrt(rho A EI) s^3; up to 0.3 % comes back, and the mass
    errs by 2e-4. Its elements stay short until the waves that they carry are damped, and are many. Where such a beam
    shears, a drag of the translation takes up shear waves.

    Raises `CaseError` where a layer would have more than 20000 elements.

    References
    ----------
    IsraeliOrszag1981 (sponge layers); KosloffKosloff1986 (damping that grows gradually).
    """
    inner, number = spread(beam.segments, elements)
    viscous = np.array([piece.viscosity / piece.young for piece in beam.segments])[number]
    layers = [end.kind == "infinite" for end in (beam.left, beam.right)]
    if not any(layers):
        alike = tuple((number == each).nonzero()[0] for each in range(len(beam.segments)))
        return MeshLayout(0.0, inner, number, np.zeros(inner.size), np.zeros(inner.size), viscous, alike)
    _check_tension(beam)
    before = _layer(beam, 0, float(inner[0]), elements, lumped, duration) if layers[0] else np.zeros((4, 0))
    after = _layer(beam, -1, float(inner[-1]), elements, lumped, duration) if layers[1] else np.zeros((4, 0))
    n, last = before.shape[1], len(beam.segments) - 1
    none = np.zeros(inner.size)
    lengths, drag, turning, retardation = np.hstack((before[:, ::-1], (inner, none, none, viscous), after))
    beams = (n + np.flatnonzero(number == each) for each in range(last + 1))
    alone = (np.array([i]) for i in range(lengths.size) if not n <= i < n + inner.size)
    return MeshLayout(
        start=-float(before[0].sum()),
        lengths=lengths,
        segment=np.concatenate((np.zeros(n, int), number, np.full(after.shape[1], last))),
        drag=drag,
        turning=turning,
        retardation=retardation,
        alike=(*beams, *alone),
    )


def _layer(beam: Beam, segment: int, h: float, elements: int, lumped: bool, duration: float) -> Array:
    """Return the elements of a layer as four rows (4, n), outwards.

    The first follows an element of length h [m]. The rows are length [m], drag [1/s], drag of the rotation [N s] and
    retardation [s], for a run of a duration [s].
    """
    piece = beam.segments[segment]
    mass, stiffness = piece.density * piece.area, piece.bending_stiffness
    length = SPREAD * (stiffness / mass) ** 0.25 * math.sqrt(duration)
    if math.isfinite(piece.shear_stiffness):
        length = min(length, 0.5 * piece.front_speed * duration)
    lengths = _lengths(beam, max(length, REACH * beam.length), h, elements, lumped)
    length = float(lengths.sum())
    place = (np.cumsum(lengths) - 0.5 * lengths) / length
    drag, retardation = np.zeros(lengths.size), np.full(lengths.size, piece.viscosity / piece.young)
    if lumped:
        turning = TURNING_ALONE * math.sqrt(mass * stiffness) * place**3
        if math.isfinite(piece.shear_stiffness):  # so late that it does not brake slow motion
            drag = SHEAR_DRAG * piece.shear_speed / length * place**8
    else:
        turning = TURNING * math.sqrt(mass * stiffness) * place**4
        retardation += RETARDATION * length**2 * math.sqrt(mass / stiffness) * place**3
    return np.array((lengths, drag, turning, retardation))


def _lengths(beam: Beam, length: float, h: float, elements: int, lumped: bool) -> Array:
    """Return the element lengths [m] of a layer, outwards from one of length h [m], (n,)."""
    growth = min(GROWTH, GROWTHS / elements)
    found: list[float] = []
    x = 0.0
    while x < length and len(found) <= MAX_ELEMENTS:
        found.append(h + (COARSENING * length * (x / length) ** 4 if lumped else growth * x))
        x += found[-1]
    if len(found) > MAX_ELEMENTS:
        raise CaseError(
            f"the layer that absorbs waves at the infinite end of '{beam.name}' must be {length:.3g} m long in a run "
            f"of this duration, and would need more than {MAX_ELEMENTS} elements. Allowed: {MAX_ELEMENTS}",
            remedy="Give fewer elements, a shorter duration, a consistent mass, or model continuous.",
            path=f"bodies.{beam.name}.ends",
        )
    return np.array(found)


def _check_tension(beam: Beam) -> None:
    """Raise `PairingError` where a layer, which nothing pulls, would hold a beam under tension."""
    if beam.tension != 0.0:
        raise PairingError(
            f"the beam '{beam.name}' has a tension, and the layer that absorbs waves at its infinite "
            "end cannot have one",
            remedy="Leave tension out, or give the ends another support.",
            path=f"bodies.{beam.name}.ends",
        )
