"""The warnings ``large_strain`` and ``large_bending``: a rod or beam leaves linear theory."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from typing import NamedTuple

import numpy as np

from impactlab.history.base import AbstractHistory, Warned
from impactlab.metrics.static_shapes import Bow, bow, sides_of, stretch
from impactlab.scene.bodies import Beam, ElasticBody, End, SampledLoad, WaveBody
from impactlab.scene.bodies.pieces import Segment
from impactlab.scene.facts import beams_of
from impactlab.scene.problem import Contact, Scene
from impactlab.scene.ranges import is_solid

LINEAR_STRAIN = 0.01  # strain up to which linear theory holds; metals yield at 0.1 to 1 %
MAX_STRAIN = 2.0 * LINEAR_STRAIN  # of an estimate within a factor of two: strains above it give a warning
BENT_WARN = 0.01  # of a beam's length, by which bending shortens it: a deflection of 6 % between ends, 13 % of a tip
SHORTEST_WAVE = 1e-3  # of a rod: no shorter piece of it holds the whole energy of a run
INSTANTS = 2000  # of a run, and of each of its strongest contacts, between which speeds of a place are means
PLACES = 200  # along a body, at which its displacement at t = 0 is read
STRONGEST = 4  # contacts of a place that are read so closely
HALVINGS = 24  # of the longest time over which a force on an end is summed
STEP_LOAD_CLAMPED = 2.4  # moment by a force from t = 0 on at the tip of a clamped beam, over F L
STEP_LOAD = 0.4  # the same of another beam
PULSE = 1.2  # moment by a short force of impulse J, over J sqrt(c r/t) after a time t


def overstrained(history: AbstractHistory, false_peaks: Collection[str] = ()) -> Iterator[Warned]:
    """Yield a warning for each rod or beam strained, or beam bent, beyond linear theory.

    Of the contacts with ``false_peaks``, which a mesh exaggerates, the mean force of the longest period counts instead.

    The limit is a strain of about a hundredth. The strain is estimated, within a factor of about two, without reading
    fields: of a rod from the contact forces over E A, of a beam from the speed and displacement of its struck places.
    Bodies whose wave speed is that of no solid, as those of unit constants, have no such limit (`is_solid`).
    """
    scene = history.scene
    limits = _limits(scene)
    peaks = [(math.inf if span.peak_force is None else span.peak_force, span.contact) for span in history.contacts]
    if limits is not None and not history.links and all(peak <= limits[contact] for peak, contact in peaks):
        return  # so it is of most runs
    rods = [body for body in scene.wave_bodies if "strain" in body.quantities and is_solid(body)]  # no shafts
    beams = [beam for beam in beams_of(scene) if is_solid(beam)]
    if not rods and not beams:
        return
    met: dict[str, list[tuple[Contact, float]]] = {body.name: [] for body in (*rods, *beams)}
    for contact in scene.contacts:
        for point in contact.faces:
            if point.body in met:
                met[point.body].append((contact, point.x))
    links = {link.name: max(abs(link.largest), abs(link.smallest)) for link in history.links}
    for rod in rods:
        yield from _warned(rod.name, strain_of_rod(history, rod, met[rod.name], links, false_peaks))
    for beam in beams:
        moves = moves_of_beam(history, beam, met[beam.name])
        yield from _warned(beam.name, strain_of_beam(history, beam, met[beam.name], moves, links))
        shortening = max((each.way**2 * each.bow.shortening for each in moves), default=0.0)
        yield from _bent(beam.name, shortening / beam.length)


def _limits(scene: Scene) -> dict[str, float] | None:
    """Return the forces of contacts [N] that strain no rod beyond linear theory.

    It is None where forces do not determine the strain.
    """
    if "limits" not in scene.derived:
        scene.derived["limits"] = _found_limits(scene)
    found: dict[str, float] | None = scene.derived["limits"]
    return found


def _found_limits(scene: Scene) -> dict[str, float] | None:
    limits = dict.fromkeys((contact.name for contact in scene.contacts), math.inf)
    if beams_of(scene):
        return None
    for rod in scene.wave_bodies:
        if _of_rotation(rod) > MAX_STRAIN:
            return None
        loaded = any(end.is_loaded for _, end in rod.ends)
        if (
            loaded
            or rod.displacement is not None
            or abs(rod.velocity) > MAX_STRAIN * min(segment.wave_speed for segment in rod.segments)
        ):
            return None
        for _, contact in scene.met_by(rod.name):
            for x in contact.places_on(rod.name):
                limit = MAX_STRAIN / _strain_at(rod, x, scene.duration)
                limits[contact.name] = min(limits[contact.name], limit)
    return limits


def _warned(name: str, strain: float) -> Iterator[Warned]:
    if strain > MAX_STRAIN:
        yield Warned(
            "large_strain",
            f"the strain of '{name}' reaches about {100.0 * strain:.2g} % (an estimate within a "
            f"factor of two). Linear theory is valid up to about {100.0 * LINEAR_STRAIN:g} %, and few "
            "materials withstand more without yielding. Check speeds, masses and sizes with their "
            "units; otherwise the result is that of a linear material that does not yield",
        )


def _bent(name: str, shortening: float) -> Iterator[Warned]:
    if shortening > BENT_WARN:
        yield Warned(
            "large_bending",
            f"'{name}' bends so far that the distance between its ends changes by about "
            f"{100.0 * shortening:.2g} %. The linear theory of beams is valid up to about "
            f"{100.0 * BENT_WARN:g} %. Check speeds, masses and sizes with their units, or give a "
            "stiffer or shorter beam",
        )


def strain_of_rod(
    history: AbstractHistory,
    rod: WaveBody,
    met: list[tuple[Contact, float]],
    links: dict[str, float],
    false_peaks: Collection[str] = (),
) -> float:
    """Return an estimate of the largest strain of a rod.

    ``met`` are its contacts with their places x [m], ``links`` the forces of links [N]. A contact force strains the
    sections beside it. Into further segments its wave goes with the share that their impedances transmit. A place that
    is moved by u strains a held rod by that of statics. Fronts that add up at a far end, by two at most, are left out,
    and so are peaks of single elements whose energy would be more than that of the run.
    """
    strains = [_at_start(rod)]
    if rod.is_held:
        strains.append(abs(rod.velocity) / min(segment.wave_speed for segment in rod.segments))
    channels = frozenset(history.channels()) if rod.is_held and history.duration > rod.round_trip else ()
    for contact, x in met:
        force = _force_of(history, contact, links)
        if force is None:  # of an impulse law: that of the speed at which the faces meet at first
            strains.append(_speed(history, contact) * rod.impedance_at(x) * _strain_at(rod, x, 0.0))
        elif contact.name in links:
            strains.append(force * _strain_at(rod, x, history.duration))
        else:
            pulses = _pulses(history, contact.name, contact.name in false_peaks)
            strains += [size * _strain_at(rod, x, lasting) for size, lasting in pulses]
        if (name := rod.face_channel(x)) in channels:
            strains.append(_way(history, name) * stretch(rod, x))
    for x, end in rod.ends:
        if end.is_loaded:
            strains.append(end.largest_force(history.duration) * _strain_at(rod, x, history.duration))
    strain = max(strains)
    if strain > MAX_STRAIN:  # only here, as the energies of an exact run are computed on first use
        energy = max(history.energy.at_stake, float(np.max(history.energy.total - history.energy.total[0])))
        softest = min(segment.young * segment.area for segment in rod.segments)
        strain = min(strain, math.sqrt(2.0 * energy / (softest * SHORTEST_WAVE * rod.length)))
    return max(strain, _of_rotation(rod))


def _pulses(history: AbstractHistory, contact: str, is_false: bool) -> list[tuple[float, float]]:
    """Return forces [N] of a contact with the times [s] that they last: of its largest peak and its longest period.

    Where its peaks are false it is the mean force of the longest period.
    """
    periods = [(span.peak_force or 0.0, span.until(history.duration) - span.start) for span in history.spans(contact)]
    if not periods:
        return []
    longest = max(range(len(periods)), key=lambda number: periods[number][1])
    if is_false:
        lasting = periods[longest][1]
        return [(history.spans(contact)[longest].impulse / lasting, lasting)]
    return [max(periods), periods[longest]]


def _strain_at(rod: WaveBody, x: float, lasting: float) -> float:
    """Return the largest strain per force [1/N] at x [m] that lasts a time [s]."""
    left, right = sides_of(rod, x)
    impedances = [pieces[0].impedance if pieces else 0.0 for pieces in (left, right)]
    held = [end.kind in ("clamped", "spring") for end in (rod.left, rod.right)]
    return max(
        _strain_along(pieces, own / sum(impedances), lasting, is_held)
        for pieces, own, is_held in zip((left, right), impedances, held, strict=True)
    )


def _strain_along(pieces: list[Segment], share: float, lasting: float, is_held: bool) -> float:
    """Return the largest strain in pieces per force [1/N].

    The first piece has ``share`` of the force. A wave goes on into a piece of less impedance with the share 1 - r, r =
    (Z1 - Z2)/(Z1 + Z2), and with 1 - r^m after m passes through the piece before: its reflections add up to the whole
    force, until the end of a piece that is not held is felt.
    """
    found, beyond = 0.0, sum(2.0 * piece.length / piece.wave_speed for piece in pieces)
    for before, piece in zip([None, *pieces], pieces, strict=False):
        if before is not None:
            trip = 2.0 * before.length / before.wave_speed
            beyond -= trip
            r = (before.impedance - piece.impedance) / (before.impedance + piece.impedance)
            passes = 1.0 + math.floor((lasting if is_held else min(lasting, beyond)) / trip)
            share *= 1.0 - r**passes if r > 0.0 else 1.0 - r
        found = max(found, share / (piece.young * piece.area))
    return found


class Move(NamedTuple):
    """How a place of a beam moves in a run."""

    speed: float  # m/s, largest change of its velocity, at most twice the speed of the bodies that meet
    way: float  # m, largest change of its displacement
    bow: Bow  # of the beam by a force there


def moves_of_beam(history: AbstractHistory, beam: Beam, met: list[tuple[Contact, float]]) -> list[Move]:
    """Return how the places of a beam's contacts move; those without a record are omitted."""
    if not met:
        return []
    channels = frozenset(history.channels())
    short = 4.0 * _fibre_of(beam) ** 2 / _spread(beam)
    found = []
    for contact, x in met:
        if (name := beam.face_channel(x)) in channels:
            speed, way = _motion(history, name, beam.velocity, contact, short)
            found.append(Move(min(speed, 2.0 * _speed(history, contact) or speed), way, bow(beam, x)))
    return found


def strain_of_beam(
    history: AbstractHistory,
    beam: Beam,
    met: list[tuple[Contact, float]],
    moves: list[Move],
    links: dict[str, float],
) -> float:
    """Return an estimate of the largest strain of a beam.

    ``met`` are its contacts with their places x [m], ``moves`` how these move, ``links`` the forces of links [N]. A
    place that moves at v across the beam strains waves and modes of any length by v e/(c r), with the outer fibre e and
    the radius of gyration r; a place that is moved by w strains a held beam by that of its static bow. Of a beam that
    is not held, which may move as a whole, the strain is at most that of the forces in a lever of its length.
    """
    fibre, slowest = _fibre_of(beam), _spread(beam)
    softest = min(segment.bending_stiffness for segment in beam.segments)
    fastest = max((each.speed for each in moves), default=0.0)
    forces = [_force_of(history, contact, links) for contact, _ in met]
    bent = max((each.way * each.bow.curvature for each in moves), default=0.0)
    waves = max(fastest, abs(beam.velocity) if beam.is_held else 0.0) / slowest
    if not beam.is_held and all(force is not None for force in forces) and not any(e.is_loaded for _, e in beam.ends):
        waves = min(waves, sum(force or 0.0 for force in forces) * beam.length / softest)
    step_load = STEP_LOAD_CLAMPED if any(end.kind == "clamped" for _, end in beam.ends) else STEP_LOAD
    longest = (step_load / PULSE * beam.length) ** 2 / slowest
    loads = sum(_moment_by(end, history.duration, slowest, longest) for _, end in beam.ends if end.is_loaded)
    return max(fibre * max(waves, bent, loads / softest, _at_start(beam)), _of_rotation(beam))


def _at_start(body: ElasticBody) -> float:
    """Return a rod's largest strain, or a beam's curvature [1/m], at t = 0."""
    if body.displacement is None:
        return 0.0
    x = np.linspace(0.0, body.length, PLACES + 1)
    order = 2 if body.bends else 1
    return float(np.abs(np.diff(body.displacement(x), order)).max()) / float(x[1]) ** order


def _moment_by(end: End, duration: float, spread: float, longest: float) -> float:
    """Return about the largest moment by the force on an end [N m].

    Its waves spread by c r [m2/s]. It is that of the largest impulse over any time, up to the
    ``longest`` [s] that the beam follows as a whole.
    """
    load = SampledLoad((0.0,), (end.force,)) if end.load is None else end.load.sampled(duration)
    inside, found = load.times[(load.times > 0.0) & (load.times < duration)], 0.0
    knots = np.concatenate(([0.0], inside, [duration]))
    for window in min(longest, duration) * 0.5 ** np.arange(HALVINGS):
        until = np.minimum(np.concatenate((knots, knots + window)), duration)
        impulse = np.abs(load.impulse(until) - load.impulse(np.maximum(until - window, 0.0))).max()
        found = max(found, PULSE * float(impulse) * math.sqrt(spread / window))
    return found


def _of_rotation(body: ElasticBody) -> float:
    """Return the strain at the root of a body that turns, in its steady state."""
    if body.steady is None:
        return 0.0
    ends = (body.left, body.segments[0]), (body.right, body.segments[-1])
    held = [piece.young for end, piece in ends if end.kind not in ("free", "mass")]
    return abs(body.steady.root_stress) / min(held, default=math.inf)


def _fibre_of(beam: Beam) -> float:
    """Return the largest distance of an outer fibre from the neutral axis [m].

    It is that of a rectangle where no height is known.
    """
    return max(0.5 * each.height if each.height > 0.0 else math.sqrt(3.0) * each.gyration for each in beam.segments)


def _spread(beam: Beam) -> float:
    """Return the least c r of a beam [m2/s], by which its waves spread."""
    return min(segment.wave_speed * segment.gyration for segment in beam.segments)


def _motion(
    history: AbstractHistory, channel: str, at_start: float, contact: Contact, short: float
) -> tuple[float, float]:
    """Return the largest change of a place's velocity [m/s] and its displacement [m].

    Velocities are means over ``short`` [s], or half the time between two records, in the strongest contacts; over more
    in the rest of a long run.
    """
    end, rate = history.duration, history.record_rate
    apart = max(short, 0.5 / rate)
    grids = [np.linspace(0.0, end, math.ceil(min(INSTANTS, max(1.0, end / apart))) + 1)]
    for span in sorted(history.spans(contact.name), key=lambda span: -abs(span.impulse))[:STRONGEST]:
        count = min(INSTANTS, (span.until(end) - span.start) / apart + 2.0)
        grids.append(np.minimum(span.start + apart * np.arange(count), end))
    times = np.concatenate(grids)
    moved, steps = history.evaluate(times, channel), np.diff(times)
    steps[np.cumsum([grid.size for grid in grids[:-1]], dtype=int) - 1] = 0.0  # from one grid to the next
    whole = steps > 0.5 * apart
    speed = float(np.abs(np.diff(moved)[whole] / steps[whole] - at_start).max(initial=0.0))
    if rate * short < 1.0:  # records are too far apart for means
        moving = history.evaluate(grids[0], channel.replace("displacement", "velocity", 1))
        speed = max(speed, float(np.abs(moving - at_start).max()))
    return speed, float(np.abs(moved - moved[0]).max())


def _way(history: AbstractHistory, channel: str) -> float:
    """Return the largest displacement of a place in a run [m]."""
    moved = history.evaluate(np.linspace(0.0, history.duration, INSTANTS + 1), channel)
    return float(np.abs(moved - moved[0]).max())


def _force_of(history: AbstractHistory, contact: Contact, links: dict[str, float]) -> float | None:
    """Return the largest force of a contact [N]; None where its law gives impulses alone."""
    if contact.name in links:
        return links[contact.name]
    spans = history.spans(contact.name)
    known = [span.peak_force for span in spans if span.peak_force is not None]
    return None if spans and not known else max(known, default=0.0)


def _speed(history: AbstractHistory, contact: Contact) -> float:
    """Return the relative speed of two bodies at t = 0 [m/s]."""
    bodies = history.scene.bodies
    return abs(bodies[contact.left.body].velocity - bodies[contact.right.body].velocity)
