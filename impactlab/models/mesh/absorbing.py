"""Absorbing layers: the elements of a beam, continued at an infinite end with damping that grows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from impactlab.errors import PairingError
from impactlab.models.mesh.bar_elements import Ints, spread
from impactlab.scene.bodies import Beam
from impactlab.types import Array

REACH = 2.0  # lengths of the beam that a layer is long
MIN_ELEMENTS, MAX_ELEMENTS = 40, 200  # elements of a layer
DRAG, DRAG_ALONE, RETARDATION = 400.0, 1600.0, 0.01  # over the time l^2 sqrt(rho A/EI) of the layer's length l


class Layout(NamedTuple):
    """Elements from left to right, layers included."""

    start: float  # m, of the first node: below 0 where a layer precedes the beam
    lengths: Array  # (n_elements,) m
    segment: Ints  # (n_elements,) number of the segment
    drag: Array  # (n_elements,) 1/s, damping over mass beyond that of the body
    retardation: Array  # (n_elements,) s, damping over stiffness: that of the material, and of a layer
    alike: tuple[Ints, ...]  # numbers of elements that have the same matrices


def laid_out(beam: Beam, elements: int, lumped: bool, gravity: float) -> Layout:
    """Return the elements of a beam, with an absorbing layer beyond each infinite end.

    The layer is twice as long as the beam. Over its length l the drag grows as 400 s^2 and the retardation time of the
    material as 0.01 s^3, over and times l^2 sqrt(rho A/EI), s from 0 to 1; its elements grow steadily. Measured on an
    Euler-Bernoulli beam of 100 elements, of a wave of number k it sends back 3 % at k l = 8, 0.5 % at 10, 0.2 % at 15
    and less than 0.1 % from 20 on; waves as long as l and longer, k l < 6, come back by 10 % and more: give a longer
    piece of beam for these. With a lumped mass, for the sake of explicit schemes, there is only drag, 1600 s^2, and 5 %
    comes back at k l = 10, less than 1.5 % from 12 to 60, 13 % at 160.

    References
    ----------
    IsraeliOrszag1981 (sponge layers); KosloffKosloff1986 (damping that grows gradually).
    """
    inner, number = spread(beam.segments, elements)
    viscous = np.array([piece.viscosity / piece.young for piece in beam.segments])[number]
    layers = [end.kind == "infinite" for end in (beam.left, beam.right)]
    if not any(layers):
        alike = tuple((number == each).nonzero()[0] for each in range(len(beam.segments)))
        return Layout(0.0, inner, number, np.zeros(inner.size), viscous, alike)
    _check(beam, gravity)
    before = _layer(beam, 0, float(inner[0]), elements, lumped) if layers[0] else np.zeros((3, 0))
    after = _layer(beam, -1, float(inner[-1]), elements, lumped) if layers[1] else np.zeros((3, 0))
    n, last = before.shape[1], len(beam.segments) - 1
    lengths, drag, retardation = np.hstack((before[:, ::-1], (inner, np.zeros(inner.size), viscous), after))
    beams = (n + np.flatnonzero(number == each) for each in range(last + 1))
    alone = (np.array([i]) for i in range(lengths.size) if not n <= i < n + inner.size)
    return Layout(
        start=-float(before[0].sum()),
        lengths=lengths,
        segment=np.concatenate((np.zeros(n, int), number, np.full(after.shape[1], last))),
        drag=drag,
        retardation=retardation,
        alike=(*beams, *alone),
    )


def _layer(beam: Beam, segment: int, h: float, elements: int, lumped: bool) -> Array:
    """Return lengths, drag and retardation (3, n) of the elements of a layer, outwards from one of length h [m]."""
    from scipy.optimize import brentq

    length, count = REACH * beam.length, min(max(elements, MIN_ELEMENTS), MAX_ELEMENTS)
    powers = np.arange(1, count + 1)
    if h * count >= length:
        lengths = np.full(max(1, round(length / h)), h)
    else:
        growth = brentq(lambda ratio: h * np.sum(ratio**powers) - length, 1.0, (length / h) ** (1.0 / count))
        lengths = h * growth**powers
    piece = beam.segments[segment]
    middle = (np.cumsum(lengths) - 0.5 * lengths) / lengths.sum()
    time = length**2 * np.sqrt(piece.density * piece.area / piece.bending_stiffness)
    drag = (DRAG_ALONE if lumped else DRAG) / time * middle**2
    retardation = (0.0 if lumped else RETARDATION * time) * middle**3 + piece.viscosity / piece.young
    return np.array((lengths, drag, retardation))


def _check(beam: Beam, gravity: float) -> None:
    """Raise `PairingError` where a layer, which rests, would hold a beam that moves as a whole."""
    for fault, has_it in (
        ("moves as a whole at t = 0", beam.velocity != 0.0),
        ("is under tension", beam.tension != 0.0),
        ("has weight", gravity != 0.0),
    ):
        if has_it:
            raise PairingError(
                f"the beam '{beam.name}' {fault}, and the layer that absorbs waves at its infinite end rests",
                remedy="Let the other body move, leave tension and gravity out, or give the ends another support.",
                path=f"bodies.{beam.name}.ends",
            )
