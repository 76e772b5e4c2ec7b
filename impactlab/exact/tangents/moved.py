"""A neighbouring exact run to first order: a history moved along its tangents."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from impactlab.exact.results.history import ContinuousHistory
from impactlab.exact.setup.network import Log, NetworkLayout, with_room
from impactlab.exact.tangents.run import Solved
from impactlab.scene.method import Simulation

MAX_NARROWER = 0.02  # of the length of a piece, by which it may change


def kept_pieces(log: Log) -> Iterator[tuple[int, int]]:
    """Yield junction and number of all pieces."""
    for j, count in enumerate(log.junctions["records"].tolist()):
        for k in range(count):
            yield j, k


def largest_step(solved: Solved, parameter: int) -> float:
    """Return the largest change of a parameter for first-order motion.

    There a piece changes its length by the share `MAX_NARROWER`.
    """
    log, tangents = solved.log, solved.tangents
    room, found = log.pieces.shape[1], np.inf
    for j, count in enumerate(log.junctions["records"].tolist()):
        pieces = log.pieces[j, :count]
        moves = tangents.moves[room * j : room * j + count, :, parameter]
        change = np.abs(moves[:, 1] - moves[:, 0])
        with np.errstate(divide="ignore"):
            found = min(found, float(np.min(MAX_NARROWER * (pieces["stop"] - pieces["start"]) / change)))
    return found


def moved(
    solved: Solved, parameter: int, step: float, run: Simulation, layout: NetworkLayout, log: Log
) -> ContinuousHistory:
    """Return the history of a run with a parameter changed, by tangents.

    Its waves and events are moved by a step of the parameter. ``run``, ``layout`` and ``log`` are the scene, its layout
    and network with that step; of the log at t = 0 the numbers are used.
    """
    base, tangents = solved.log, solved.tangents
    room = base.pieces.shape[1]
    rows = base.junctions["rows"].tolist()
    sizes = [rows[j] * int(tangents.size[room * j + k]) for j, k in kept_pieces(base)]
    log = with_room(log, room, sum(sizes), len(base.events))
    at = 0
    for j, k in kept_pieces(base):
        number, piece = room * j + k, base.pieces[j, k]
        size, n = int(tangents.size[number]), int(piece["size"])
        table = np.zeros((rows[j], size))
        table[:, :n] = base.pool[piece["offset"] : piece["offset"] + rows[j] * n].reshape(rows[j], n)
        first = tangents.offset[number] + parameter * table.size
        table += step * tangents.pool[first : first + table.size].reshape(rows[j], size)
        start, stop = np.array([piece["start"], piece["stop"]]) + step * tangents.moves[number, :, parameter]
        log.pieces[j, k] = start, stop, size, at
        log.pool[at : at + table.size] = table.ravel()
        at += table.size
    count = int(base.state["events"])
    log.events[:count] = base.events[:count]
    log.events["time"][:count] += step * tangents.dated[:count, parameter]
    log.junctions["records"], log.junctions["clock"] = base.junctions["records"], base.junctions["clock"]
    for name in ("events", "fastest", "farthest", "tolerance", "intervals"):
        log.state[name] = base.state[name]
    log.state["pool_used"] = at
    return ContinuousHistory(run, layout, log, run.scene.duration)
