"""Bodies, sizes and the check of a description that all suites share."""

from __future__ import annotations

import dataclasses
from typing import Any

from impactlab import plugins
from impactlab.casefile.values.units import is_si
from impactlab.cite import OWN, entries_for
from impactlab.models.base import Face
from impactlab.scene.bodies import BeamSegment, Segment

PIECE = Segment(length=0.3, area=9e-4, young=2.1e11, density=7900.0)
SHEAR = PIECE.young / 2.6 * PIECE.area * 5.0 / 6.0  # N, of a rectangle, Poisson's ratio 0.3
BAR = BeamSegment(0.3, 9e-4, 2.1e11, 7900.0, inertia=6.75e-8, shear_stiffness=SHEAR, rotary_inertia=7900.0 * 6.75e-8)
SOFT_BAR = BeamSegment(0.2, 6e-4, 7e10, 2700.0, inertia=3e-8, shear_stiffness=0.2 * SHEAR, rotary_inertia=2700.0 * 3e-8)
STRUCK = (Face(0.0, 0, PIECE.mass),)  # by a mass, at the left end
PORTS = 200  # random ones of each test


def at_most(value: float, limit: float, text: str) -> None:
    """Check that a number, named by ``text`` with its unit, is at most its limit."""
    assert value <= limit, f"{text} is {value:.4g}, and may be at most {limit:.4g}"


def has_description(part: Any) -> None:
    """Check that the docstring of a class or a function begins with a short line."""
    assert plugins.describe(part), f"{part.__name__} has no docstring"
    at_most(len(plugins.describe(part)), 199, "the number of characters in the first line of its docstring")


def described(part: object) -> None:
    """Check the description, sources and options of a part."""
    kind = type(part)
    has_description(kind)
    given = getattr(kind, "citations", ())
    assert not isinstance(given, str), f"citations is a text, and must be a tuple: citations = ({given!r},)"
    citations = plugins.citations_of(kind)
    assert citations, f'{kind.__name__} cites no source; an unpublished part of your own says citations = ("own",)'
    assert all(isinstance(key, str) and key for key in citations), f"citations must be keys, not {citations!r}"
    unknown = [key for key in citations if not key.startswith("@") and key not in (OWN, *entries_for(kind))]
    assert not unknown, f"no entry in citations.bib for {', '.join(unknown)}"
    assert dataclasses.is_dataclass(part), f"{kind.__name__} is no dataclass"
    for field in dataclasses.fields(part):
        if field.init:
            assert field.metadata.get("description"), f"option '{field.name}' has no description"
            unit = field.metadata["unit"]
            assert is_si(unit), f"option '{field.name}' is in {unit!r}, and must be in a known SI unit without prefix"
