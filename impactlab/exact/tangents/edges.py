"""Distance of a parameter to a change of the contact sequence.

It follows from the tangents of one run.

A contact that nearly opens or closes has a least force or gap f > 0, which reaches zero after a change -f/(df/dp). One
that closes at the rate g' < 0 with g'' > 0 would have had the least gap -g'^2/(2 g''), whose derivative is
-(g'/g'') dg'/dp, with the rate at the event: it stays open from the change -g'/(2 dg'/dp) on. A parameter that only
delays the event leaves its rate, and no edge comes. Faces that touch without a force are at an edge of each parameter
that moves them against each other: a change to one side presses them together, one to the other side parts them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from impactlab.exact.arrays import CLOSE
from impactlab.exact.tangents.arrays import BY_FRONT, CROSSED, DURATION, GAP, TRANSIT
from impactlab.exact.tangents.run import Solved
from impactlab.types import Array

SAME_RATE = 1.0e-9  # of g'' dt/dp: a smaller derivative of the rate is rounding
MAX_EDGE_DISTANCE = 1.0e8  # of the size of a parameter: an edge beyond is one of rounding
ZERO_TOL = 1.0e-11  # of the largest force or gap: smaller values are rounding, or those of an event
NO_GAP = 1.0e-12  # of the way at the largest velocity: faces with a smaller gap touch
NO_MOTION = 1.0e-10  # the same, of a change of the gap over that of the parameter: a smaller one is rounding
INSIDE = 0.999  # of a piece: a minimum at zero nearer to its end may belong to an event there
MIN_HEIGHT = 1.0e-3  # of the largest force or gap, of a piece with such a minimum: less are faces that rest
SAME_VALUE = 1.0e-12  # of the largest force or gap of a piece: a minimum less deep, beside its end, is rounding
END_SLACK = 4.0  # merge tolerances between the end of a run and a front that counts as at the end
SAME_MOTION = 1.0e-9  # of the duration: a smaller distance of front and end for a change of the size of a parameter


class Edge(NamedTuple):
    """A change of the sequence of contacts."""

    distance: float  # change of the parameter at which it comes
    contact: int  # of the network
    time: float  # s
    what: str


class Piece(NamedTuple):
    """Force of a closed contact, or gap of an open one, over a piece."""

    start: float
    stop: float
    closed: bool
    f: Array
    tangent: Array


def edges(solved: Solved, parameter: int) -> list[Edge]:
    """Return the contact sequence changes that the run shows, the nearest first."""
    found = [*_events(solved, parameter)]
    for contact in range(len(solved.log.contacts)):
        found += [*_misses(solved, parameter, contact), *_rests(solved, parameter, contact)]
    reach = MAX_EDGE_DISTANCE * float(solved.tangents.scale[parameter])
    return sorted((edge for edge in found if abs(edge.distance) < reach), key=lambda edge: abs(edge.distance))


def passes_end(solved: Solved, parameter: int) -> bool:
    """Return whether a changed parameter moves a front past the run's end.

    The front arrives at the end of the run. Quantities at the end then have another derivative on either side.
    """
    log, tangents = solved.log, solved.tangents
    duration, later = float(log.state["duration"]), float(tangents.of_state[parameter, DURATION])
    slack, room = END_SLACK * float(log.state["tolerance"]), log.pieces.shape[1]
    least = SAME_MOTION * duration / float(tangents.scale[parameter])
    for end, source in enumerate(log.ends["source"].tolist()):
        stops = log.pieces["stop"][source, : int(log.junctions["records"][source])] + log.ends["transit"][end]
        at_end = room * source + np.flatnonzero(np.abs(stops - duration) <= slack)
        arrives = tangents.moves[at_end, 1, parameter] + tangents.of_ends[parameter, end, TRANSIT]
        if np.any(np.abs(arrives - later) > least):
            return True
    return False


def _change(f: float, tangent: float) -> float:
    """Return the change of a parameter at which f is zero; infinite if f hardly changes."""
    return -f / tangent if tangent != 0.0 else np.inf


def _events(solved: Solved, parameter: int) -> Iterator[Edge]:
    log, tangents = solved.log, solved.tangents
    duration, longer = float(log.state["duration"]), float(tangents.of_state[parameter, DURATION])
    for number in range(int(log.state["events"])):
        event, (rate, bend, how) = log.events[number], tangents.bend[number].tolist()
        time, contact, later = float(event["time"]), int(event["contact"]), float(tangents.dated[number, parameter])
        kind = "closing" if event["kind"] == CLOSE else "opening"
        if how == CROSSED and bend > 0.0:
            steeper = float(tangents.steeper[number, parameter])
            if abs(steeper) > SAME_RATE * abs(bend * later):
                yield Edge(_change(0.5 * rate, steeper), contact, time, f"{kind} vanishes")
        if how == BY_FRONT:
            yield Edge(_change(rate, float(tangents.pull[number, parameter])), contact, time, f"{kind} vanishes")
        if time > 0.0:
            yield Edge(_change(duration - time, longer - later), contact, time, f"{kind} passes the end of the run")


def _pieces(solved: Solved, parameter: int, contact: int) -> list[Piece]:
    """Return force or gap of a contact, piece by piece from t = 0 on."""
    log, tangents = solved.log, solved.tangents
    record = log.contacts[contact]
    j = int(log.nodes["junction"][record["left"]])
    junction, room = log.junctions[j], log.pieces.shape[1]
    nodes, ends, rows = int(junction["nodes"]), int(junction["ends"]), int(junction["rows"])
    a, b = int(record["left"] - junction["first_node"]), int(record["right"] - junction["first_node"])
    force = 2 * (nodes + ends) + contact - int(junction["first_contact"])
    events = log.events[: int(log.state["events"])]
    events = events[events["contact"] == contact]
    found = []
    for k in range(int(junction["records"])):
        start, stop, n, at = log.pieces[j, k].tolist()
        if stop <= 0.0:
            continue
        size, first = int(tangents.size[room * j + k]), int(tangents.offset[room * j + k])
        base = log.pool[at : at + rows * n].reshape(rows, n)
        first += parameter * rows * size
        moved = tangents.pool[first : first + rows * size].reshape(rows, size)
        before = events["kind"][events["time"] <= 0.5 * (start + stop)]
        closed = bool(len(before)) and int(before[-1]) == CLOSE
        f = np.array(base[force] if closed else base[nodes + b] - base[nodes + a])
        tangent = np.array(moved[force] if closed else moved[nodes + b] - moved[nodes + a])
        if not closed:
            f[0] += float(record["gap"])
            tangent[0] += tangents.of_contacts[parameter, contact, GAP]
        found.append(Piece(start, stop, closed, f, tangent))
    return found


def _rests(solved: Solved, parameter: int, contact: int) -> Iterator[Edge]:
    state, tangents = solved.log.state, solved.tangents
    way, scale = float(state["fastest"] * state["duration"]), float(tangents.scale[parameter])
    for piece in _pieces(solved, parameter, contact):
        if piece.closed or np.sum(np.abs(piece.f)) > NO_GAP * way:
            continue
        moved = piece.tangent.copy()
        moved[0] -= tangents.of_contacts[parameter, contact, GAP]  # a gap that is opened alone has one side
        if np.sum(np.abs(moved)) * scale > NO_MOTION * way:
            yield Edge(0.0, contact, piece.start, "faces that touch are pressed or part")
            return


def _at_joint(before: Piece, piece: Piece, floor: float) -> tuple[float, float]:
    """Return the least force or gap at a joint, and its tangent.

    Two pieces join there; both are zero where it is not least there. A front may make it jump at the joint; values up
    to ``floor`` count as zero.
    """
    old, new = float(chebyshev.chebval(1.0, before.f)), float(chebyshev.chebval(-1.0, piece.f))
    falls = float(chebyshev.chebval(1.0, chebyshev.chebder(before.f))) < 0.0
    rises = float(chebyshev.chebval(-1.0, _slope(piece.f))) > 0.0
    if not (min(old, new) > -floor and max(old, new) > floor):
        return 0.0, 0.0
    if (new < old - floor or falls) and rises and new <= old + floor:
        return new, float(chebyshev.chebval(-1.0, piece.tangent))
    if new > old + floor and falls:
        return old, float(chebyshev.chebval(1.0, before.tangent))
    return 0.0, 0.0


def _slope(f: Array) -> Array:
    """Return the derivative of a series, as a series."""
    return np.asarray(chebyshev.chebder(f) if len(f) > 1 else np.zeros(1), dtype=float)


def _misses(solved: Solved, parameter: int, contact: int) -> Iterator[Edge]:
    pieces = _pieces(solved, parameter, contact)
    events, scale = solved.log.events[: int(solved.log.state["events"])], float(solved.tangents.scale[parameter])
    times = events["time"][events["contact"] == contact]
    largest = {
        closed: max((float(np.max(np.abs(p.f))) for p in pieces if p.closed == closed), default=0.0)
        for closed in (True, False)
    }
    before: Piece | None = None
    for piece in pieces:
        floor, what = ZERO_TOL * largest[piece.closed], "a further opening" if piece.closed else "a further closing"
        is_high = float(np.max(np.abs(piece.f))) > MIN_HEIGHT * largest[piece.closed]
        for y in _minima(piece.f):
            value, tangent = (float(chebyshev.chebval(y, of)) for of in (piece.f, piece.tangent))
            time = piece.start + 0.5 * (y + 1.0) * (piece.stop - piece.start)
            if value > floor:
                yield Edge(_change(value, tangent), contact, time, what)
            elif is_high and abs(y) < INSIDE and abs(tangent) * scale > floor:
                yield Edge(0.0, contact, time, what)  # it just reaches zero: the value of the parameter is the edge
        if before is not None and before.closed == piece.closed and not np.any(times == piece.start):
            least, tangent = _at_joint(before, piece, floor)
            if least > floor:
                yield Edge(_change(least, tangent), contact, piece.start, what)
            elif abs(tangent) * scale > floor:  # a front takes all of it: the value of the parameter is the edge
                yield Edge(0.0, contact, piece.start, what)
        before = piece


def _minima(f: Array) -> list[float]:
    """Return the places in (-1, 1) of the local minima of a series."""
    if len(f) < 3:
        return []
    slope = _slope(f)
    grid = np.cos(np.pi * np.arange(4 * len(f), -1, -1) / (4 * len(f)))
    values, bend = chebyshev.chebval(grid, f), chebyshev.chebder(slope)
    inner = np.flatnonzero((values[1:-1] <= values[:-2]) & (values[1:-1] < values[2:])) + 1
    beside = []  # an end of the piece, within the cell of which the series falls and rises again
    if values[0] <= values[1] and chebyshev.chebval(-1.0, slope) < 0.0:
        beside.append(0)
    if values[-1] <= values[-2] and chebyshev.chebval(1.0, slope) > 0.0:
        beside.append(len(grid) - 1)
    found = []
    for i in [*inner.tolist(), *beside]:
        y, low, high = float(grid[i]), float(grid[max(0, i - 1)]), float(grid[min(i + 1, len(grid) - 1)])
        for _ in range(6):
            curved = float(chebyshev.chebval(y, bend))
            if curved <= 0.0:
                break
            y = min(max(y - float(chebyshev.chebval(y, slope)) / curved, low), high)
        if i not in beside or values[i] - chebyshev.chebval(y, f) > SAME_VALUE * np.max(np.abs(values)):
            found.append(y)
    return found
