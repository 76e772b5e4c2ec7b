"""Bodies, contacts and methods in words, and the main results of a comparison."""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from impactlab.casefile.values.units import with_power
from impactlab.history.base import AbstractHistory
from impactlab.metrics.collisions import agreement_texts
from impactlab.options import Relative
from impactlab.plugins import kind_of
from impactlab.prefixes import scaled
from impactlab.printing import enumerated
from impactlab.report.comparison import cell, in_round_trips, model_words
from impactlab.report.summary import STEPPED, has_numbers
from impactlab.scene.bodies import Beam, Body, End, Mass, Mechanism, PartMechanism, Shaft, Wall, WaveBody
from impactlab.scene.method import Method, laws_of
from impactlab.scene.problem import Contact, Scene

Units = Mapping[str, Any]  # of options by name: a unit, or the units of the options of a record
NO_UNITS: Units = MappingProxyType({})
PREFIXED = re.compile(r"(N|Pa|m|kg)(?![\w^])")  # a unit that takes a prefix: one that begins with m2 does not

MIN_KG = 0.1  # kg, below which a mass is written in g
NUMBERED = re.compile(r"(.*?)_?\d+")  # a name made by `repeat`
MIN_ALIKE = 4  # bodies or contacts in a row with the same words, which are written once


def si(value: float, unit: str) -> str:
    """Return a value with the prefix that makes it short: ``116.4 µs``."""
    if unit == "kg":
        small = 0.0 < abs(value) < MIN_KG
        return f"{1e3 * value:.4g}\N{NO-BREAK SPACE}g" if small else f"{value:.4g}\N{NO-BREAK SPACE}kg"
    shown = scaled(unit.replace(" ", "·"), abs(value))
    return f"{value / shown.size:.4g}\N{NO-BREAK SPACE}{shown.label}"


def si_range(low: float, high: float, unit: str) -> str:
    """Return a range with the prefix of its larger end: ``-966.7 to 499.1 µstrain``."""
    shown = scaled(unit.replace(" ", "·"), max(abs(low), abs(high)))
    return f"{low / shown.size:.4g} to {high / shown.size:.4g}\N{NO-BREAK SPACE}{shown.label}"


def scene_facts(scene: Scene, links: Collection[str] = ()) -> list[tuple[str, str]]:
    """Return bodies, contacts and scales of a scene as (name, words).

    ``links`` are names of contacts or sums.
    """
    facts = list(_once(_bodies(scene)))
    of_contacts: list[tuple[str, str]] = []
    by_name: dict[str, list[Contact]] = {}
    for contact in scene.contacts:
        by_name.setdefault(contact.shared_name, []).append(contact)
    for name, contacts in by_name.items():
        first, last, several = contacts[0], contacts[-1], len(contacts)
        gaps = [si(gap, "m") if gap else "0" for gap in sorted({contact.gap for contact in contacts})]
        words = "joined from the start" if name in links else f"gap {' to '.join(dict.fromkeys((gaps[0], gaps[-1])))}"
        if several > 1:
            words = f"{several} pieces, {first.name.replace('|', ' | ')} to {last.name.replace('|', ' | ')}, {words}"
        elif first.name != name:
            words = f"{first.name.replace('|', ' | ')}, {words}"
        of_contacts.append((name.replace("|", " | "), words))
    facts += _once(of_contacts)
    trips = scene.duration / scene.round_trip
    over = f"{si(scene.duration, 's')}" + (f" = {trips:.4g} T" if math.isfinite(trips) else "")
    facts.append(("duration", over))
    if math.isfinite(scene.round_trip):
        facts.append(("T, round trip of a wave", trip(scene)))
    if scene.gravity:
        facts.append(("gravity", f"{scene.gravity:.4g} m/s²"))
    return facts


def trip(scene: Scene) -> str:
    """Return the time T with its unit, and the rod or beam whose round trip it is where there are several."""
    found = si(scene.round_trip, "s")
    names = [name for name, body in scene.elastic.items() if math.isclose(body.round_trip, scene.round_trip)]
    return f"{found}, in '{names[0]}'" if names and len(scene.elastic) > 1 else found


def joined_in(scene: Scene, method: Method) -> set[str]:
    """Return the names of the contacts that are joined from the start.

    Several contacts of one name have that name.
    """
    laws = zip(scene.contacts, laws_of(scene, method), strict=True)
    return {contact.shared_name for contact, law in laws if law.two_sided}


def _once(facts: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """Yield facts of bodies or contacts, a row of alike ones as ``bead_1 to bead_50``."""
    for words, alike in itertools.groupby(facts, lambda fact: fact[1]):
        names = [name for name, _ in alike]
        if len(names) < MIN_ALIKE:
            yield from ((name, words) for name in names)
        else:
            yield f"{names[0]} to {names[-1]}", f"each {words}"


def _bodies(scene: Scene) -> Iterator[tuple[str, str]]:
    """Yield the facts of each body; of many numbered masses that differ, as in a tapered chain, those of all as one."""
    for _, row in itertools.groupby(scene.bodies.items(), lambda each: _stem(*each)):
        alike = list(row)
        masses = [body for _, body in alike if isinstance(body, Mass)]
        each = [(name, _body(body)) for name, body in alike]
        if len(masses) < max(MIN_ALIKE, len(alike)) or len(list(_once(each))) < MIN_ALIKE:
            yield from each
            continue
        size, speed = (sorted({getattr(mass, key) for mass in masses}) for key in ("mass", "velocity"))
        moving = "at rest" if speed == [0.0] else _span(speed, "m/s")
        words = f"rigid masses, {_span(size, 'kg')}, {moving}{_turning(masses[0])}"
        yield f"{alike[0][0]} to {alike[-1][0]}", words


def _span(values: Sequence[float], unit: str) -> str:
    """Return the ends of sorted values, one where they are the same."""
    return " to ".join(si(each, unit) for each in dict.fromkeys((values[0], values[-1])))


def _stem(name: str, body: Body) -> str:
    """Return what the names of numbered masses have in common, else the name itself."""
    numbered = NUMBERED.fullmatch(name) if isinstance(body, Mass) else None
    return numbered[1] if numbered else name


def _body(body: Body) -> str:
    if isinstance(body, Mass):
        moving = si(body.velocity, "m/s") if body.velocity else "at rest"
        return f"rigid mass, {si(body.mass, 'kg')}, {moving}{_turning(body)}"
    if isinstance(body, Wall):
        return "rigid wall"
    if isinstance(body, Mechanism):
        return _mechanism(body)
    if isinstance(body, PartMechanism):
        return f"mechanism {kind_of(body.part)}: {_with_units(body.part)}"
    if isinstance(body, Beam):
        return _beam(body)
    if not isinstance(body, WaveBody):
        return body.kind
    pieces = "; ".join(
        f"{si(s.length, 'm')} long, Z = {si(s.impedance, 'N s/m')}, c = {s.wave_speed:.4g} m/s" for s in body.segments
    )
    moving = f", {si(body.velocity, 'm/s')}" if body.velocity else ""
    at = f" as the rod at its lever arm of {si(body.lever_arm, 'm')}" if isinstance(body, Shaft) else ""
    ends = f"left {_end(body.left)}, right {_end(body.right)}{_turning(body)}"
    return f"elastic {body.kind}{at}, {pieces}, {si(body.mass, 'kg')}{moving}; {ends}"


def _with_units(part: Any) -> str:
    """Return the numbers of a part with their units."""
    found = []
    for field in dataclasses.fields(part):
        value, unit = getattr(part, field.name), field.metadata.get("unit", "1")
        if isinstance(value, int | float):
            found.append(f"{field.name} {value:.6g}{'' if unit == '1' else f' {unit}'}")
    return ", ".join(found)


def _mechanism(mechanism: Mechanism) -> str:
    links = []
    for link in mechanism.links:
        kind = "rigid" if link.beam is None else "flexible"
        turned = f", driven at {link.drive.rate:.4g} rad/s" if link.drive is not None else ""
        turned += f" within {si(link.drive.within, 's')}" if link.drive is not None and link.drive.within else ""
        turned += f", torque {si(link.torque, 'N m')}" if link.torque else ""
        loaded = f", {si(link.end_mass, 'kg')} at its end" if link.end_mass else ""
        links.append(f"{link.name} ({kind}, {si(link.length, 'm')}, {si(link.total_mass, 'kg')}{turned}{loaded})")
    end = "" if mechanism.slide is None else f"; its end on a slide at y = {si(mechanism.slide, 'm')}"
    return f"mechanism of {', '.join(links)}{end}"


def _beam(beam: Beam) -> str:
    theory = "Timoshenko" if beam.theory == "timoshenko" else "Euler-Bernoulli"
    pieces = "; ".join(
        f"{si(s.length, 'm')} long, EI = {si(s.bending_stiffness, 'N m²')}, {s.density * s.area:.4g} kg/m"
        + (f", kGA = {si(s.shear_stiffness, 'N')}" if math.isfinite(s.shear_stiffness) else "")
        for s in beam.segments
    )
    pulled = f", under {si(beam.tension, 'N')} of tension" if beam.tension else ""
    moving = f", {si(beam.velocity, 'm/s')}" if beam.velocity else ""
    ends = f"left {_end(beam.left)}, right {_end(beam.right)}{_turning(beam)}"
    return f"{theory} beam, {pieces}, {si(beam.mass, 'kg')}{pulled}{moving}; {ends}"


def _turning(body: Body) -> str:
    """Return the rotation of a body in words; nothing at rest."""
    if body.rotation is None:
        return ""
    moves = {"axial": "", "chord": ", moving in the plane of rotation", "flap": ", moving across the plane of rotation"}
    along = body.elastic is None and body.rotation.plane == "axial"
    radius = f", {si(abs(body.rotation.axis_at), 'm')} from the axis" if along else ""
    return f"; turns at {body.rotation.rate:.4g}\N{NO-BREAK SPACE}rad/s{radius}{moves[body.rotation.plane]}"


def _end(end: End) -> str:
    units = {"spring": "N/m", "dashpot": "N·s/m", "mass": "kg"}
    held = f"{end.kind} {si(end.value, units[end.kind])}" if end.kind in units else end.kind
    if end.rotational:
        held += f" and {si(end.rotational, 'N m/rad')}"
    if end.unbounded:
        held = f"infinite ({held})"
    if end.load is not None:
        return f"{held} under a force over time"
    return f"{held} under {si(end.force, 'N')}" if end.force else held


def units_of(history: AbstractHistory) -> list[Units]:
    """Return the units of the laws' options in a run, contact by contact."""
    laws = laws_of(history.scene, history.method if history.choice is None else history.choice.method)
    units = {key: _units(law) for key, law in {id(law): law for law in laws}.items()}  # once: a chain shares its law
    return [units[id(law)] for law in laws]


def _units(part: Any) -> Units:
    """Return the units of a part's options by name.

    Those of a record of options are by its own names.
    """
    found: dict[str, Any] = {}
    for field in dataclasses.fields(part):
        value, unit = getattr(part, field.name), field.metadata.get("unit", "1")
        if isinstance(value, Relative):
            continue
        if dataclasses.is_dataclass(value):
            found[field.name] = _units(value)
        elif unit.endswith("^n") and hasattr(part, "exponent"):
            found[field.name] = with_power(unit, part.exponent)
        elif unit != "1":
            found[field.name] = unit
    return found


def method_facts(
    summary: Mapping[str, Any], units: Sequence[Units] = (), contacts: Sequence[str] = ()
) -> list[tuple[str, str]]:
    """Return how a run was computed as (name, words).

    ``units`` of the options of its laws are those of `units_of`; with the names of its ``contacts`` each of several
    laws is given with the contact that has it.
    """
    used = summary["method"]
    stepped = used.get("stepping", STEPPED) if used["dt"] and not used["integrator"] else ""
    models = {name: ", ".join(filter(None, (model_words(each), stepped))) for name, each in used["models"].items()}
    if len(models) > 1 and len(set(models.values())) == 1:
        models = {"all bodies": next(iter(models.values()))}
    facts = [(f"model of {name}", model) for name, model in models.items()]
    every = list(map(_options, used["laws"], units or itertools.repeat(NO_UNITS)))
    laws, names = Counter(every), dict(zip(every, contacts, strict=False))
    for words, count in laws.items():
        alone = count == 1 and len(laws) > 1 and words in names
        label = f"law of {names[words].replace('|', ' | ')}" if alone else "contact law"
        facts.append((label, words if count == 1 else f"{words}, at {count} contacts"))
    without = f"none: {stepped or 'solved from event to event'}"
    facts.append(("integrator", _options(used["integrator"]) if used["integrator"] else without))
    if used["dt"]:
        share = in_round_trips(used["dt"], summary)
        facts.append(("step", si(used["dt"], "s") + (f" = {cell(share)} T" if share else "")))
    cost = summary["cost"]
    taken = "steps" if used["dt"] or used["integrator"] else "intervals between events"
    facts.append(("cost", f"{cost['steps']} {taken}, {si(cost['solve_s'], 's')} (set-up {si(cost['setup_s'], 's')})"))
    return facts


def _options(part: Mapping[str, Any], units: Units = NO_UNITS) -> str:
    options = [
        f"{name} {_value(value, units.get(name, ''))}"
        for name, value in part.items()
        if name != "kind" and value is not None
    ]
    return f"{part['kind']} ({', '.join(options)})" if options else str(part["kind"])


def _value(value: Any, unit: Any = "") -> str:
    """Return the value of an option in words; ``unit`` is that of the option or its own."""
    if isinstance(value, Mapping):
        inside = unit if isinstance(unit, Mapping) else {}
        if "kind" in value:
            return _options(value, inside)
        return ", ".join(f"{name} {_value(item, inside.get(name, ''))}" for name, item in value.items())
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float) and unit:
        return si(value, unit) if PREFIXED.match(unit) else f"{value:g}\N{NO-BREAK SPACE}{unit.replace('m2', 'm²')}"
    words = f"{value:g}" if isinstance(value, float) else str(value)
    return f"{words}\N{NO-BREAK SPACE}{unit}" if unit else words


def findings(comparison: Mapping[str, Any]) -> list[str]:
    """Return the main results of a comparison in sentences."""
    done = [row for row in comparison["rows"] if has_numbers(row["summary"]["status"])]
    compared = [row for row in done if row["summary"]["errors"]]
    sentences = []
    if compared:
        sentences.append(
            _closest(compared, "mass_displacement", "displacement of the mass")
            or _closest(compared, "face_displacement", "displacement of the face")
        )
        sentences.append(_closest(compared, "impulse", "impulse"))
        sentences += _events(compared)
    gained = [row for row in done if row["summary"]["energy"]["largest_gain"] > 0.01]
    if gained:
        worst = max(gained, key=lambda row: float(row["summary"]["energy"]["largest_gain"]))
        share = 100.0 * worst["summary"]["energy"]["largest_gain"]
        sentences.append(
            f"{_names(gained)} gained more than 1 % of the reference energy, {worst['name']} most ({cell(share)} %)."
        )
    sentences += [f"{text}." for text in agreement_texts(comparison.get("collisions", ()))]
    failed = [row for row in comparison["rows"] if row not in done]
    if failed:
        sentences.append(f"No result: {_names(failed)}; the table gives the reasons.")
    return [sentence for sentence in sentences if sentence]


def _closest(compared: Sequence[Mapping[str, Any]], norm: str, words: str) -> str:
    """Return which stepped method is closest to the reference; exact methods are left out."""
    known = [(row["summary"]["errors"][norm], row["name"]) for row in compared if row["summary"]["method"]["dt"]]
    known = sorted((value, name) for value, name in known if value is not None)
    if len(known) < 2:
        return ""
    (best, name), (worst, last) = known[0], known[-1]
    return (
        f"Of the stepped methods, {name} comes closest in the {words} ({cell(100 * best)} %), "
        f"{last} is furthest off ({cell(100 * worst)} %)."
    )


def _events(compared: Sequence[Mapping[str, Any]]) -> list[str]:
    counted = [row for row in compared if row["summary"]["errors"]["events_missed"] is not None]
    missed = [row for row in counted if row["summary"]["errors"]["events_missed"]]
    extra = [row for row in counted if row["summary"]["errors"]["events_extra"] and row not in missed]
    clean = [row for row in counted if row not in missed and row not in extra]
    sentences = [f"Every touch and opening, and no other, is found by {_names(clean)}."] if clean else []
    if missed:
        sentences.append(f"At least one touch or opening is missed by {_names(missed)}.")
    if extra:
        sentences.append(f"All events, but also some that do not exist, are reported by {_names(extra)}.")
    return sentences


def _names(rows: Sequence[Mapping[str, Any]]) -> str:
    return enumerated([str(row["name"]) for row in rows])


def instant(time: float) -> str:
    """Return an instant [s] in words: ``178.5 µs``."""
    return si(time, "s") if time else "0"


def table_caption(reference: str) -> str:
    """Return the meaning of the columns of the table.

    ``reference`` is exact, converged or empty for none.
    """
    errors = (
        f"Mass, face and impulse are errors against the {reference} solution: relative L2 of the displacements over "
        "the run, and relative of the total impulse; the smallest are marked. "
    )
    rest = (
        "Gain and loss are the largest rise and fall of the energy balance, in % of the reference energy. T is the "
        "round trip of a wave. The time to solve is without set-up."
    )
    return errors + rest if reference else rest
