"""The warnings ``large_strain`` and ``large_bending``: a rod or beam leaves linear theory."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from impactlab.history.base import AbstractHistory, ContactSpan, Warned
from impactlab.metrics.static_shapes import bow, sides_of, stretch
from impactlab.scene.bodies import Beam, WaveBody
from impactlab.scene.bodies.pieces import Segment
from impactlab.scene.facts import beams_of
from impactlab.scene.problem import Contact, Scene
from impactlab.scene.ranges import is_solid

LINEAR = 0.01  # strain up to which linear theory holds; metals yield at 0.1 to 1 %
MAX_STRAIN = 2.0 * LINEAR  # of an estimate within a factor of two: strains above it give a warning
BENT_WARN = (
    0.01  # of the length of a beam, by which bending shortens it: a deflection of 6 % between ends, 13 % of a tip
)
SHORTEST_WAVE = 1e-3  # of a rod: no shorter piece of it holds the whole energy of a run


def overstrained(history: AbstractHistory) -> Iterator[Warned]:
    """Yield a warning for each rod or beam strained, or beam bent, beyond linear theory.

    The limit is a strain of about a hundredth. The strain is estimated, within a factor of about two, without reading
    fields: of a rod from the contact forces over E A, of a beam from the speed and displacement of its struck places.
    Bodies whose wave speed is that of no solid, as those of unit constants, have no such limit (`is_solid`).
    """
    scene = history.scene
    limits = _limits(scene)
    if limits is not None and not history.links and all(_is_small(span, limits) for span in history.contacts):
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
        yield from _warned(rod.name, strain_of_rod(history, rod, met[rod.name], links))
    for beam in beams:
        yield from _warned(beam.name, strain_of_beam(history, beam, met[beam.name], links))
        yield from _bent(beam.name, shortening_of_beam(history, beam, met[beam.name]))


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
        loaded = any(end.is_loaded for _, end in rod.ends)
        if loaded or abs(rod.velocity) > MAX_STRAIN * min(segment.wave_speed for segment in rod.segments):
            return None
        for _, contact in scene.met_by(rod.name):
            for x in contact.places_on(rod.name):
                limit = MAX_STRAIN / _strain_at(rod, x, scene.duration)
                limits[contact.name] = min(limits[contact.name], limit)
    return limits


def _is_small(span: ContactSpan, limits: dict[str, float]) -> bool:
    return span.peak_force is not None and span.peak_force <= limits[span.contact]


def _warned(name: str, strain: float) -> Iterator[Warned]:
    if strain > MAX_STRAIN:
        yield Warned(
            "large_strain",
            f"'{name}' is strained by about {100.0 * strain:.2g} % (an estimate within a factor of two): linear theory "
            f"holds up to about {100.0 * LINEAR:g} %, and few materials bear more without yielding; check speeds, "
            "masses and sizes with their units, and read the result as that of a linear material without a limit",
        )


def _bent(name: str, shortening: float) -> Iterator[Warned]:
    if shortening > BENT_WARN:
        yield Warned(
            "large_bending",
            f"'{name}' bends so far that its length between its ends changes by about {100.0 * shortening:.2g} %: the "
            f"linear theory of beams holds up to about {100.0 * BENT_WARN:g} %; check speeds, masses and sizes with "
            "their units, or give a stiffer or shorter beam",
        )


def strain_of_rod(
    history: AbstractHistory, rod: WaveBody, met: list[tuple[Contact, float]], links: dict[str, float]
) -> float:
    """Return an estimate of the largest strain of a rod.

    ``met`` are its contacts with their places x [m], ``links`` the forces of links [N]. A contact force strains the
    sections beside it. Into further segments its wave goes with the share that their impedances transmit. A place that
    is moved by u strains a held rod by that of statics. Fronts that add up at a far end, by two at most, are left out,
    and so are peaks of single elements whose energy would be more than that of the run.
    """
    strains = [0.0]
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
            lasting = [
                (span.peak_force or 0.0, span.until(history.duration) - span.start)
                for span in history.spans(contact.name)
            ]
            two = (max(lasting, default=(0.0, 0.0)), max(lasting, key=lambda each: each[1], default=(0.0, 0.0)))
            strains += [peak * _strain_at(rod, x, time) for peak, time in two]
        if (name := rod.face_channel(x)) in channels:
            strains.append(_motion(history, name, 0.0)[1] * stretch(rod, x))
    for x, end in rod.ends:
        if end.is_loaded:
            strains.append(end.largest_force(history.duration) * _strain_at(rod, x, history.duration))
    strain = max(strains)
    if strain > MAX_STRAIN:  # only here, as the energies of an exact run are computed on first use
        energy = max(history.energy.at_stake, float(np.max(history.energy.total - history.energy.total[0])))
        softest = min(segment.young * segment.area for segment in rod.segments)
        strain = min(strain, math.sqrt(2.0 * energy / (softest * SHORTEST_WAVE * rod.length)))
    return strain


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


def strain_of_beam(
    history: AbstractHistory, beam: Beam, met: list[tuple[Contact, float]], links: dict[str, float]
) -> float:
    """Return an estimate of the largest strain of a beam.

    ``met`` are its contacts with their places x [m], ``links`` the forces of links [N]. A place that moves at v across
    the beam strains waves and modes of any length by v e/(c r), with the outer fibre e and the radius of gyration r; a
    place that is moved by w strains a held beam by that of its static bow. Of a beam that is not held, which may move
    as a whole, the strain is at most that of the forces in a lever of its length.
    """
    fibre = max(_fibre(segment.gyration, segment.height) for segment in beam.segments)
    slowest = min(segment.wave_speed * segment.gyration for segment in beam.segments)
    softest = min(segment.bending_stiffness for segment in beam.segments)
    fastest = abs(beam.velocity) if beam.is_held else 0.0
    channels = frozenset(history.channels()) if met else ()
    bent, forces = 0.0, [_force_of(history, contact, links) for contact, _ in met]
    for contact, x in met:
        name = beam.face_channel(x)
        if name not in channels:
            continue
        speed, way = _motion(history, name, beam.velocity)
        fastest = max(fastest, min(speed, 2.0 * _speed(history, contact) or speed))
        bent = max(bent, way * bow(beam, x).curvature)
    waves = fastest / slowest
    if not beam.is_held and all(force is not None for force in forces) and not any(e.is_loaded for _, e in beam.ends):
        waves = min(waves, sum(force or 0.0 for force in forces) * beam.length / softest)
    loads = sum(end.largest_force(history.duration) for _, end in beam.ends if end.is_loaded)
    return fibre * max(waves, bent, loads * beam.length / softest if beam.is_held else 0.0)


def _fibre(gyration: float, height: float) -> float:
    """Return the distance of the outer fibre from the neutral axis [m].

    It is that of a rectangle where no height is known.
    """
    return 0.5 * height if height > 0.0 else math.sqrt(3.0) * gyration


def _motion(history: AbstractHistory, channel: str, at_start: float) -> tuple[float, float]:
    """Return the change of a place's velocity [m/s] and its displacement [m].

    Both are the largest in the run.
    """
    times = np.linspace(0.0, history.duration, 2001)
    moved = history.evaluate(times, channel)
    speeds = np.diff(moved) / np.diff(times)
    return float(np.abs(speeds - at_start).max()), float(np.abs(moved - moved[0]).max())


def shortening_of_beam(history: AbstractHistory, beam: Beam, met: list[tuple[Contact, float]]) -> float:
    """Return an estimate of the relative shortening of a held beam by bending.

    It is the largest in the run. It is that of the static bow by the displacement of each place of a contact: half the
    integral of the slope squared.
    """
    channels = frozenset(history.channels()) if met else ()
    ways = {x: _motion(history, beam.face_channel(x), 0.0)[1] for _, x in met if beam.face_channel(x) in channels}
    return max((way**2 * bow(beam, x).shortening / beam.length for x, way in ways.items()), default=0.0)


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
