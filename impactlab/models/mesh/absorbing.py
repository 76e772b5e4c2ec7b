"""Where the elements of a beam lie, and the layer in which an infinite end of a mesh lets waves die out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy import int64
from numpy.typing import NDArray

from impactlab.errors import PairingError
from impactlab.models.mesh.bar_elements import elements_per_segment
from impactlab.scene.bodies import Beam
from impactlab.types import Array

Ints = NDArray[int64]

REACH = 2.0  # lengths of the beam that a layer is long
FEWEST, MOST = 40, 200  # elements of a layer
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
    """Return the elements of a beam; beyond an infinite end the mesh goes on in a layer whose damping grows.

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
    counts = elements_per_segment(beam.segments, elements)
    inner = np.concatenate([np.full(n, piece.length / n) for n, piece in zip(counts, beam.segments, strict=True)])
    number: Ints = np.repeat(np.arange(len(counts)), counts)
    viscous = np.array([piece.viscosity / piece.young for piece in beam.segments])[number]
    beams = tuple(np.flatnonzero(number == each) for each in range(len(counts)))
    layers = [end.kind == "infinite" for end in (beam.left, beam.right)]
    if any(layers):
        _check(beam, gravity)
    before = _layer(beam, 0, float(inner[0]), elements, lumped) if layers[0] else _nothing()
    after = _layer(beam, len(counts) - 1, float(inner[-1]), elements, lumped) if layers[1] else _nothing()
    n, m = before.lengths.size, before.lengths.size + inner.size
    return Layout(
        start=-float(before.lengths.sum()),
        lengths=np.concatenate((before.lengths[::-1], inner, after.lengths)),
        segment=np.concatenate((np.zeros(n, int), number, np.full(after.lengths.size, len(counts) - 1))),
        drag=np.concatenate((before.drag[::-1], np.zeros(inner.size), after.drag)),
        retardation=np.concatenate((before.retardation[::-1], viscous, after.retardation)),
        alike=(
            *(np.array([i]) for i in range(n)),
            *(each + n for each in beams),
            *(np.array([i]) for i in range(m, m + after.lengths.size)),
        ),
    )


class Layer(NamedTuple):
    """Elements of a layer from the beam outwards."""

    lengths: Array
    drag: Array
    retardation: Array


def _nothing() -> Layer:
    return Layer(np.zeros(0), np.zeros(0), np.zeros(0))


def _layer(beam: Beam, segment: int, h: float, elements: int, lumped: bool) -> Layer:
    """Return a layer that goes on from an element of length h [m]."""
    from scipy.optimize import brentq

    length, count = REACH * beam.length, min(max(elements, FEWEST), MOST)
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
    return Layer(lengths, drag, retardation)


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
