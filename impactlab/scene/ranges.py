"""Ranges of the numbers in a case, and of derived values, by unit.

A range is the smallest positive and the largest number.

They are far beyond any experiment, from atoms to planets, and near enough to one that no product of theirs leaves the
range of double precision: with lengths from 1e-15 m on, a stiffness 12 EI/h3 stays below 1e100, its square below 1e200.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from impactlab.errors import CaseError

if TYPE_CHECKING:
    from impactlab.scene.bodies import ElasticBody
    from impactlab.scene.problem import Contact, Scene


class Range(NamedTuple):
    """Allowed sizes of a number: a positive one from ``least`` on, any up to ``most``."""

    least: float
    most: float


RANGES = {
    "m": Range(1e-15, 1e12),
    "m2": Range(1e-30, 1e18),
    "m4": Range(1e-60, 1e24),
    "Pa": Range(1e-9, 1e20),
    "kg/m3": Range(1e-9, 1e20),
    "kg": Range(1e-30, 1e24),
    "s": Range(1e-24, 1e15),
    "1/s": Range(1e-24, 1e24),
    "m/s": Range(1e-12, 1e12),
    "m/s2": Range(1e-24, 1e15),
    "N": Range(1e-24, 1e24),
    "N/m": Range(1e-24, 1e30),
    "N s/m": Range(1e-24, 1e24),
    "N m": Range(1e-24, 1e30),
    "Pa s": Range(1e-24, 1e24),
    "N m s": Range(1e-24, 1e30),
    "kg m2": Range(1e-36, 1e36),
    "N s": Range(1e-24, 1e24),
}
OTHERS = Range(1e-30, 1e60)  # of units with an option in them, as N/m^n
COUNTS = Range(1e-12, 1e12)  # of numbers without a unit
PERIODS_IN_A_STEP = 1e6  # times 1/omega of the highest frequency: its square, 1e12, stands beside 1 in one matrix
WAVE_SPEED = Range(1e-6, 1e12)  # m/s
SOLID = Range(300.0, 20_000.0)  # m/s, wave speeds of lead and of diamond with room on both sides
MAX_SECTION = 20.0  # m2, of a rod or beam: large piles have some 7 m2; a diameter meant in mm has far more
MAX_NAMES = 3  # of bodies in one sentence
MAX_QUAKE = 0.2  # m; quakes at the toe of a pile reach a thirtieth of its diameter, some 0.1 m
MAX_SPECIMEN = 0.5  # m, length of a specimen between bars
YIELD_STRAINS = Range(1e-6, 1.0)  # stress over Young's modulus at which solids yield, from lead to rubber, with room
MAX_STRAIN = 0.5  # full scale, or noise, of a strain gauge; gauges break below 0.2
G = 9.81  # m/s2, of weights that soil bears
MIN_SAMPLES = 20  # of a table of force over time that is checked for a mistake of units
MIN_REACHED = 5  # of these, within the run: of fewer the times are taken for ms
BENDING = Range(1e-40, 1e40)  # N m2
# Ratio of impedances, and of travel times, of two pieces of one body: their waves meet to rounding.
SEGMENTS_APART = 1e12


def range_of(unit: str) -> Range:
    """Return the sizes that a number in a unit may have."""
    return COUNTS if unit == "1" else RANGES.get(unit, OTHERS)


def check_scales(scene: Scene) -> None:
    """Raise `CaseError` where numbers in range combine to one that is not."""
    _within(scene.duration, RANGES["s"], "the run lasts", "s", "solve.duration")
    for name, body in scene.elastic.items():
        path = f"bodies.{name}"
        for number, piece in enumerate(body.segments):
            of_piece = f"{path}.segments.{number}" if len(body.segments) > 1 else path
            _within(piece.wave_speed, WAVE_SPEED, "the wave speed sqrt(E/rho) is", "m/s", f"{of_piece}.material")
            _within(piece.mass, RANGES["kg"], "the mass rho A L is", "kg", of_piece)
            _within(piece.impedance, RANGES["N s/m"], "the impedance rho c A is", "N s/m", of_piece)
            if not math.isnan(piece.bending_stiffness):
                _within(piece.bending_stiffness, BENDING, "the bending stiffness EI is", "N m2", of_piece)
        _apart(body, path)


def is_solid(body: ElasticBody) -> bool:
    """Return whether all wave speeds of a body are those of solids."""
    return all(SOLID.least <= piece.wave_speed <= SOLID.most for piece in body.segments)


def hints_of(scene: Scene, laws: Mapping[str, Any]) -> Iterator[str]:
    """Yield a sentence for each value of a scene or law that looks wrong."""
    for found in (lone_bodies, odd_speeds, wide_sections, odd_loads, odd_probes):
        yield from found(scene)
    yield from odd_laws(scene, laws)
    yield from _weak_soil(scene, laws)


def odd_speeds(scene: Scene) -> Iterator[str]:
    """Yield a sentence for each body with a wave speed that no solid has."""
    for name, body in scene.elastic.items():
        if body.waves_of_solid and not is_solid(body):
            odd = [piece.wave_speed for piece in body.segments if not SOLID.least <= piece.wave_speed <= SOLID.most]
            yield (
                f"bodies.{name}.material: the wave speed is {odd[0]:.4g} m/s, and that of solids lies between "
                f"{SOLID.least:g} and {SOLID.most:g} m/s; is a unit missing, as in '210 GPa' or '7.85 g/cm^3'?"
            )


def wide_sections(scene: Scene) -> Iterator[str]:
    """Yield a sentence for each body whose section is larger than that of any rod."""
    for name, body in scene.elastic.items():
        largest = max((piece.area for piece in body.segments), default=0.0)
        if largest > MAX_SECTION:
            yield (
                f"bodies.{name}: the section is {largest:.4g} m2, rods have less than {MAX_SECTION:g} m2; is a unit "
                "missing, as in diameter: 20 mm?"
            )


def odd_loads(scene: Scene) -> Iterator[str]:
    """Yield a sentence for each long table of an end force hardly used.

    The run reaches only the first of its many samples.
    """
    for name, body in scene.bodies.items():
        for x, load in body.loads:
            if load.lines(scene.duration) is None:  # no table
                continue
            times = load.sampled(scene.duration).times
            reached = int(np.count_nonzero(times <= scene.duration))
            if reached < MIN_REACHED and len(times) >= MIN_SAMPLES:
                yield (
                    f"bodies.{name}.ends: the table of the force at x = {x:g} m has {len(times)} samples up to "
                    f"{times[-1]:.4g} s, and the run of {scene.duration:.4g} s reaches {reached} of them; are its "
                    "times in another unit? Name it in the heading of the column, as in 'time [ms]'"
                )


def lone_bodies(scene: Scene) -> Iterator[str]:
    """Yield a sentence for the bodies of a case of several that no contact names."""
    named = {point.body for point in scene.faces}
    lone = [name for name in scene.bodies if name not in named]
    if lone and len(scene.bodies) > 1:
        more = f" and {len(lone) - MAX_NAMES} more" if len(lone) > MAX_NAMES else ""
        yield (
            f"no contact includes {', '.join(map(repr, lone[:MAX_NAMES]))}{more}, so nothing strikes "
            f"{'it' if len(lone) == 1 else 'them'}; is an entry of contacts missing, as in between: "
            "[hammer, rod.left]?"
        )


def odd_probes(scene: Scene) -> Iterator[str]:
    """Yield a sentence for each strain gauge of too large a range or noise.

    No gauge survives such strains.
    """
    for number, probe in enumerate(scene.probes):
        if probe.quantity != "strain" or probe.instrument is None:
            continue
        for key in ("noise", "range"):
            value = getattr(probe.instrument, key) or 0.0
            if value > MAX_STRAIN:
                yield (
                    f"probes.{number}.{key}: {value:g} m/m is beyond the strains that gauges measure; is it meant in "
                    f"another unit, as '{value:g} um/m'?"
                )


def _odd_specimen(contact: Contact, scene: Scene, law: Any) -> Iterator[str]:
    """Yield a sentence for each size of a specimen that none between two bars has."""
    bars = [piece.area for point in contact.faces for piece in getattr(scene.bodies[point.body], "segments", ())]
    if law.length > MAX_SPECIMEN:
        yield f"{contact.name}: the specimen is {law.length:g} m long; is a unit missing, as in '5 mm'?"
    if bars and law.area > max(bars):
        yield (
            f"{contact.name}: the section of the specimen, {law.area:.4g} m2, is larger than that of its bars, "
            f"{max(bars):.4g} m2; is a unit missing, as in '78.5 mm^2'?"
        )
    strain = law.first_yield / law.young
    if not YIELD_STRAINS.least <= strain <= YIELD_STRAINS.most:
        yield (
            f"{contact.name}: the specimen yields at {law.first_yield:g} Pa, at a strain of {strain:.3g} with Young's "
            f"modulus {law.young:g} Pa; is a unit missing, as in '300 MPa' or '70 GPa'?"
        )


def odd_laws(scene: Scene, laws: Mapping[str, Any]) -> Iterator[str]:
    """Yield a sentence per group of links on values beyond those of soil or specimens."""
    known: set[str] = set()
    for contact in scene.contacts:
        if hasattr(laws[contact.name], "first_yield"):
            yield from _odd_specimen(contact, scene, laws[contact.name])
        quake, named = getattr(laws[contact.name], "quake", 0.0), contact.shared_name
        if quake > MAX_QUAKE and named not in known:
            known.add(named)
            yield (
                f"{named}: the quake is {quake:.4g} m, and those of soils are below {MAX_QUAKE:g} m; is a unit "
                "missing, as in '2.5 mm'?"
            )


def _weak_soil(scene: Scene, laws: Mapping[str, Any]) -> Iterator[str]:
    """Yield a sentence where soil cannot bear the weight of its pile, as where a capacity in kN lacks its unit."""
    soil = [contact for contact in scene.contacts if hasattr(laws[contact.name], "quake")]
    pile = {point.body for contact in soil for point in contact.faces} & set(scene.elastic)
    borne = sum(laws[contact.name].capacity for contact in soil)
    weight = G * sum(scene.elastic[name].mass for name in pile)
    if soil and borne < weight:
        yield (
            f"{soil[0].shared_name}: the soil bears {borne:.4g} N in all, less than the weight {weight:.4g} N of "
            f"{' and '.join(map(repr, sorted(pile)))}; is a unit missing, as in '150 kN'?"
        )


def _within(value: float, allowed: Range, text: str, unit: str, path: str) -> None:
    if not allowed.least <= value <= allowed.most:  # NaN is neither
        raise CaseError(
            f"{text} {value:.6g} {unit}. Allowed: {allowed.least:g} to {allowed.most:g} {unit}",
            remedy="Check the units of the values it follows from.",
            path=path,
        )


def _apart(body: ElasticBody, path: str) -> None:
    """Raise `CaseError` where the pieces of a body differ too much.

    One matrix cannot hold them.
    """
    for text, values in (
        ("masses", [piece.mass for piece in body.segments]),
        ("stiffnesses EA/L", [piece.young * piece.area / piece.length for piece in body.segments]),
        ("stiffnesses EI/L3", [piece.bending_stiffness / piece.length**3 for piece in body.segments]),
    ):
        ratio = 1.0 if math.isnan(values[0]) else max(values) / min(values)
        if not ratio <= SEGMENTS_APART:  # nor is NaN allowed
            raise CaseError(
                f"the {text} of its segments differ by a factor of {ratio:.3g}. Allowed: up to {SEGMENTS_APART:g}",
                remedy="Check the units of its segments.",
                path=f"{path}.segments",
            )
