"""Eigenfunctions of a uniform beam, in closed form except for their frequencies."""

from __future__ import annotations

import itertools
from functools import lru_cache
from typing import NamedTuple, cast, final

import numpy as np

from impactlab.bases.base import Completable, even_grid, quadrature
from impactlab.bases.beams.roots import Held
from impactlab.bases.beams.shapes import FieldOrigin, are_sines, found, normalised
from impactlab.bases.beams.statics import WORDS, BeamStatics
from impactlab.bases.beams.waves import BeamNumbers, WavePair, even_odd, field, quantity_of, shapes_at, waves
from impactlab.errors import CaseError
from impactlab.models.mesh.beams import no_such
from impactlab.scene.bodies import Beam, BeamSegment, Profile
from impactlab.scene.recent import Recent
from impactlab.types import QUANTITIES_OF_BEAM, Array, Quantity

STEP = 1e-6  # of the length, over which the slope of an initial deflection is taken
MAX_KEPT = 16  # beams whose modes stay in memory


@final
class BeamModes(Completable):
    """The first modes of a uniform beam with clamped, pinned or free ends, mass-normalised.

    Its rigid motions come first and are not counted: a translation and a rotation of a free beam, a rotation of one
    that is pinned and free. Each elastic mode is made of the four fields of one frequency (`waves`), even and
    odd about the middle, or about the pinned end where only one end is pinned; its first quantity at the left end that
    is not zero is positive.

    Attributes
    ----------
    frequencies : (n_dof,)
        rad/s; exactly zero for rigid motions.

    References
    ----------
    Huang1961; Rayleigh1894, section 174.
    """

    def __init__(self, beam: Beam, modes: int) -> None:
        _check(beam)
        segment = self._segment = beam.segments[0]
        self._kinds = (cast(Held, beam.left.kind), cast(Held, beam.right.kind))
        layout = self._layout = FieldOrigin.of(self._kinds)
        unit, line_mass = layout.unit * beam.length, segment.density * segment.area
        numbers = BeamNumbers(
            segment.rotary_inertia / (line_mass * unit**2),
            segment.bending_stiffness / (segment.shear_stiffness * unit**2),
        )
        self._squared, self._waves, shares = elastic_modes(numbers, self._kinds, modes)
        self._shares = shares / np.sqrt(line_mass * unit)
        self._sines = are_sines(shares)
        self._rotary = numbers.rotary * layout.unit**2
        self._rigid = rigid_motions(self._kinds, self._rotary)
        self._scales = (1.0, 1.0 / unit, segment.bending_stiffness / unit**2, segment.bending_stiffness / unit**3)
        elastic = np.sqrt(self._squared * segment.bending_stiffness / (line_mass * unit**4))
        self.frequencies = np.concatenate((np.zeros(len(self._rigid)), elastic))
        self._rows: dict[tuple[float, int], Array] = {}  # that were read
        first = {"free": 0, "pinned": 1, "clamped": 2}[self._kinds[0]]
        self._shares *= np.where(self._at(np.zeros(1), first)[0, len(self._rigid) :] < 0.0, -1.0, 1.0)

    def row(self, x: float, quantity: Quantity) -> Array:
        if quantity not in QUANTITIES_OF_BEAM:
            raise no_such(quantity)
        which = 0 if quantity == "velocity" else WORDS.index(quantity)
        if (row := self._rows.get((x, which))) is None:
            row = self._rows[x, which] = np.asarray(self._at(np.array([x]), which)[0])
            row.flags.writeable = False
        return row

    def static(self, x: float, quantity: Quantity, face: float) -> float:
        return statics_of(self._segment, self._kinds, self._rotary, face).at(x, quantity)

    def project(self, profile: Profile) -> Array:
        """Return the modal coordinates of a deflection by Gauss quadrature, shape (n_dof,).

        Cross sections start square to the deflected axis, as where nothing shears.
        """
        length, segment = self._segment.length, self._segment
        x, weight = quadrature(length, self.frequencies.size)
        found = self._at(x, 0).T @ (weight * segment.density * segment.area * profile(x))
        if segment.rotary_inertia > 0.0:
            before, after = np.maximum(x - STEP * length, 0.0), np.minimum(x + STEP * length, length)
            slope = (profile(after) - profile(before)) / (after - before)
            found += self._at(x, 1).T @ (weight * segment.rotary_inertia * slope)
        return np.asarray(found)

    def project_uniform(self) -> Array:
        segment, mass = self._segment, self._segment.mass
        rigid = [np.sqrt(mass) * (offset + 0.5 * slope) for offset, slope in self._rigid]
        momenta = []
        each = zip(self._waves.squares, self._shares[:2], self._shares[2:], strict=True)
        for square, even, odd in itertools.islice(each, int(self._sines), None):
            cosine, sine = even_odd(square, 1.0)
            if self._layout.central:
                momenta.append(2.0 * even * sine)  # odd fields cancel
            else:
                momenta.append(odd * (cosine - even_odd(square, 0.0)[0]))
        scale = segment.density * segment.area * self._layout.unit * segment.length
        total = scale * (momenta[0] if self._sines else momenta[0] + momenta[1])
        return np.concatenate((rigid, total))

    def grid(self) -> Array:
        return even_grid(self._segment.length, self.frequencies.size)

    def _at(self, x: Array, which: int) -> Array:
        """Return displacement (0), rotation, bending moment or shear force (3) of each mode, (n, n_dof)."""
        length, mass = self._segment.length, self._segment.mass
        rigid = np.zeros((x.size, len(self._rigid)))
        for number, (offset, slope) in enumerate(self._rigid):
            if which == 0:
                rigid[:, number] = (offset + slope * x / length) / np.sqrt(mass)
            elif which == 1:
                rigid[:, number] = slope / (length * np.sqrt(mass))
        layout = self._layout
        place = layout.sign * (x[:, None] / length - layout.origin) / layout.unit
        elastic = np.zeros((x.size, self._squared.size))
        if self._sines:  # the other wave and the even fields have no share
            square, turning = self._waves.squares[1], self._waves.turning[1]
            elastic += self._shares[3] * quantity_of(
                which, False, self._squared, square, turning, even_odd(square, place)
            )
        else:
            shapes = shapes_at(self._waves, place)
            for even, shares in ((True, self._shares[:2]), (False, self._shares[2:])):
                if np.count_nonzero(shares):
                    pair = field(self._waves, self._squared, shapes, even, which)
                    elastic += shares[0] * pair[0] + shares[1] * pair[1]
        turned = layout.sign if which in (1, 3) else 1.0
        return np.hstack((rigid, elastic * (turned * self._scales[which])))


def rigid_motions(kinds: tuple[Held, Held], rotary: float) -> Array:
    """Return offset and slope (n_rigid, 2) of the rigid motions of a beam.

    They are mass-normalised for a beam of unit mass and length.
    """
    if kinds == ("free", "free"):
        scale = 1.0 / np.sqrt(1.0 / 12.0 + rotary)
        return np.array([[1.0, 0.0], [-0.5 * scale, scale]])
    if set(kinds) == {"pinned", "free"}:
        scale = 1.0 / np.sqrt(1.0 / 3.0 + rotary)
        return np.array([[0.0, scale]]) if kinds[0] == "pinned" else np.array([[scale, -scale]])
    return np.zeros((0, 2))


@lru_cache(maxsize=64)
def statics_of(segment: BeamSegment, kinds: tuple[Held, Held], rotary: float, face: float) -> BeamStatics:
    """Return the statics of a beam, whatever its modes, under a force at ``face`` [m]."""
    return BeamStatics(segment, kinds, rigid_motions(kinds, rotary), face)


def has_closed_form(beam: Beam) -> bool:
    """Return whether the modes of a beam are known in closed form.

    They are for a uniform beam at rest without tension, with plain ends.
    """
    plain = all(end.kind in ("clamped", "pinned", "free") for end in (beam.left, beam.right))
    return plain and len(beam.segments) == 1 and beam.tension == 0.0 and beam.rotation is None


def _check(beam: Beam) -> None:
    """Raise `CaseError` where the modes of the beam are not known without a mesh."""
    if has_closed_form(beam):
        return
    ends = [end.kind for end in (beam.left, beam.right)]
    if beam.rotation is not None:
        raise CaseError(
            f"the modes of a beam that turns have no closed form, and '{beam.name}' turns at "
            f"{beam.rotation.rate:.6g} rad/s",
            remedy="Give 'elements' for the eigenvectors of a mesh.",
            path="solve.model",
        )
    raise CaseError(
        f"analytic modes need a uniform beam without tension, its ends clamped, pinned or free; '{beam.name}' has "
        f"{len(beam.segments)} segment(s), a tension of {beam.tension:.6g} N and ends {ends[0]}, {ends[1]}",
        remedy="Give 'elements' for the eigenvectors of a mesh.",
        path="solve.model",
    )


class Elastic(NamedTuple):
    """Elastic modes of a beam without units, by rising frequency."""

    squared: Array  # B, (modes,)
    carried: WavePair  # fields of shape (modes,)
    shares: Array  # (4, modes) of even and odd fields, such that the integral of w2 + r2 theta2 is 1


_kept: Recent[tuple[BeamNumbers, tuple[Held, Held]], Elastic] = Recent(MAX_KEPT)


def elastic_modes(numbers: BeamNumbers, kinds: tuple[Held, Held], modes: int) -> Elastic:
    """Return the first elastic modes of a beam, from an earlier run if possible.

    Each mode is found by itself, so that no bit depends on how many were sought with it.
    """
    key = numbers, kinds
    known = _kept.get(key)
    if known is not None and known.squared.size < modes:
        _kept.pop(key, None)
    kept = _kept.get_or_make(key, lambda: _elastic(numbers, kinds, modes))
    squares, turning = ((first[:modes], second[:modes]) for first, second in kept.carried)
    return Elastic(kept.squared[:modes], WavePair(squares, turning), kept.shares[:, :modes])


def _elastic(numbers: BeamNumbers, kinds: tuple[Held, Held], modes: int) -> Elastic:
    squared, shares = found(numbers, kinds, modes)
    carried = waves(numbers, squared)
    return Elastic(squared, carried, normalised(numbers, carried, shares, FieldOrigin.of(kinds)))
