"""Elastic modes of uniform beams, kept between runs.

The first of many modes have the same bits as a few that are found alone.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import NamedTuple

from impactlab.bases.beams.roots import Held
from impactlab.bases.beams.shapes import FieldOrigin, found, normalised
from impactlab.bases.beams.waves import BeamNumbers, WavePair, waves
from impactlab.types import Array

MAX_KEPT = 16  # beams whose modes stay in memory


class Elastic(NamedTuple):
    """Elastic modes of a beam without units, by rising frequency."""

    squared: Array  # B, (modes,)
    carried: WavePair  # fields of shape (modes,)
    shares: Array  # (4, modes) of even and odd fields, such that the integral of w2 + r2 theta2 is 1


_kept: OrderedDict[tuple[BeamNumbers, tuple[Held, Held]], Elastic] = OrderedDict()


def elastic_modes(numbers: BeamNumbers, kinds: tuple[Held, Held], modes: int) -> Elastic:
    """Return the first elastic modes of a beam, from an earlier run if possible.

    Each mode is found by itself, so that no bit depends on how many were sought with it.
    """
    key = numbers, kinds
    kept = _kept.get(key)
    if kept is None or kept.squared.size < modes:
        squared, shares = found(numbers, kinds, modes)
        carried = waves(numbers, squared)
        kept = _kept[key] = Elastic(squared, carried, normalised(numbers, carried, shares, FieldOrigin.of(kinds)))
    _kept.move_to_end(key)
    while len(_kept) > MAX_KEPT:
        _kept.popitem(last=False)
    squares, turning = ((first[:modes], second[:modes]) for first, second in kept.carried)
    return Elastic(kept.squared[:modes], WavePair(squares, turning), kept.shares[:, :modes])
