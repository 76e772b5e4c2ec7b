"""Reads the cross sections of beams: area, second moment and shear stiffness from what a case gives."""

from __future__ import annotations

import math
from collections.abc import Iterator

from impactlab.casefile.schema import BeamBlock, BeamMaterial, SectionBlock
from impactlab.casefile.words import listed
from impactlab.errors import CaseError
from impactlab.scene.bodies import BeamSegment

RECTANGLE, CIRCLE = 5.0 / 6.0, 9.0 / 10.0  # shear factors: the energy of the static shear stress (Timoshenko1921)
WAYS = (("width", "height"), ("diameter",), ("area", "inertia"))
ALLOWED = "{width: m, height: m}, {diameter: m}, or {area: m2, inertia: m4}"


def pieces_of(beam: BeamBlock) -> Iterator[tuple[str, SectionBlock, BeamMaterial]]:
    """Give path, section and material of each uniform piece."""
    for number, piece in enumerate(beam.segments or ()):
        yield f"segments.{number}.", piece.section, piece.material
    if beam.segments is None and beam.section is not None and beam.material is not None:
        yield "", beam.section, beam.material


def check_section(section: SectionBlock, path: str) -> None:
    """Raise `CaseError` unless the section is given in one way, and whole."""
    shapes = [key for way in WAYS for key in way if getattr(section, key) is not None]
    if section.height is not None and {"area", "inertia"} <= set(shapes) and section.width is None:
        return  # of any section, for its slenderness alone
    if tuple(shapes) not in WAYS:
        given = f"{listed(shapes)} given" if shapes else "nothing given"
        raise CaseError(
            f"{given}, which does not make a section. Allowed: {ALLOWED}", remedy="Give one of the three.", path=path
        )


def check_shear(section: SectionBlock, material: BeamMaterial, path: str) -> None:
    """Raise `CaseError` unless the shear stiffness of a Timoshenko beam is known."""
    if (material.poisson is None) == (material.shear_modulus is None):
        what = "no shear modulus" if material.poisson is None else "poisson and shear_modulus given together"
        raise CaseError(
            f"{what}, and theory timoshenko needs one",
            remedy="Give either poisson or shear_modulus.",
            path=f"{path}material",
        )
    if section.shear_factor is None and section.area is not None:
        raise CaseError(
            "no shear_factor, and theory timoshenko needs one. It is known of rectangles and circles only",
            remedy="Give shear_factor, the part of the area that carries shear: 5/6 of a rectangle.",
            path=f"{path}section",
        )


def beam_segments(beam: BeamBlock) -> tuple[BeamSegment, ...]:
    """Return the uniform pieces of a checked beam."""
    if beam.segments is not None:
        return tuple(_segment(beam, piece.length, piece.section, piece.material) for piece in beam.segments)
    if beam.length is None or beam.section is None or beam.material is None:
        raise CaseError("a beam without length, section or material")
    return (_segment(beam, beam.length, beam.section, beam.material),)


def _segment(beam: BeamBlock, length: float, section: SectionBlock, material: BeamMaterial) -> BeamSegment:
    height, factor = section.height, section.shear_factor
    if section.width is not None and height is not None:
        area, inertia, known = section.width * height, section.width * height**3 / 12.0, RECTANGLE
    elif section.diameter is not None:
        height = section.diameter
        area, inertia, known = 0.25 * math.pi * height**2, math.pi * height**4 / 64.0, CIRCLE
    else:
        area, inertia, known = section.area or math.nan, section.inertia or math.nan, math.nan
    plain = BeamSegment(
        length, area, material.young, material.density, material.viscosity, inertia=inertia, height=height or math.nan
    )
    if beam.theory == "euler_bernoulli":
        return plain
    shear = material.shear_modulus or material.young / (2.0 * (1.0 + (material.poisson or 0.0)))
    return BeamSegment(
        length,
        area,
        material.young,
        material.density,
        material.viscosity,
        inertia=inertia,
        shear_stiffness=(factor or known) * shear * area,
        rotary_inertia=material.density * inertia,
        height=height or math.nan,
    )
