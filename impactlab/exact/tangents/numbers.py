"""Derivatives of a network's numbers by central differences of eighth order.

The networks beside it are built for them.

The numbers are products, quotients and roots of the parameters, so that differences over one per cent are exact to
1e-13; no formula has to be derived, and every parameter of a case file is supported.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from impactlab.errors import ImpactlabError
from impactlab.exact.setup.network import Log
from impactlab.exact.tangents.arrays import OF_CONTACTS, OF_ENDS, OF_NODES, OF_STATE, Rates
from impactlab.types import Array

WIDTH = 0.01  # of the parameter: between two networks
CENTRAL = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])  # at -4 to 4
FORWARD = np.array([-761 / 280, 8.0, -14.0, 56 / 3, -35 / 2, 56 / 5, -14 / 3, 8 / 7, -1 / 8])  # at 0 to 8


def numbers(log: Log) -> list[Array]:
    """Return all numbers of a network at t = 0, in the order of `Rates`."""
    state = np.array([float(log.state[name]) for name in OF_STATE])
    tables = ((log.nodes, OF_NODES), (log.ends, OF_ENDS), (log.contacts, OF_CONTACTS))
    found = [state, *(np.stack([of[name] for name in names], axis=-1) for of, names in tables)]
    pieces = [row[:count] for row, count in zip(log.pieces, log.junctions["records"].tolist(), strict=True)]
    first = np.concatenate([np.stack([row["start"], row["stop"]], axis=-1) for row in pieces])
    return [*found, first, np.array(log.pool[: int(log.state["pool_used"])])]


def same_layout(one: Log, other: Log) -> bool:
    """Return whether two networks have the same layout, with any numbers.

    Their nodes, ends, contacts and first pieces must agree.
    """
    for table in ("junctions", "nodes", "ends", "contacts"):
        a, b = getattr(one, table), getattr(other, table)
        whole = [name for name in a.dtype.names if a.dtype[name].kind == "i"]
        if len(a) != len(b) or any(np.any(a[name] != b[name]) for name in whole):
            return False
    sizes = [log.pieces["size"][:, : int(log.junctions["records"].max())] for log in (one, other)]
    return sizes[0].shape == sizes[1].shape and bool(np.all(sizes[0] == sizes[1]))


def rates(log: Log, at: Sequence[Callable[[float], Log]], values: Sequence[float], scales: Sequence[float]) -> Rates:
    """Return the derivatives of the numbers of a network by parameters.

    Parameters
    ----------
    log : Log
        The network at t = 0.
    at : sequence of callables
        The network for another value of each parameter; may raise where the value is not allowed.
    values, scales : sequence of float
        Value of each parameter, and the size to which differences are proportional.

    Raises
    ------
    ImpactlabError
        If a network beside it is refused, or has other nodes or pieces.
    """
    base = numbers(log)
    every = [
        _rate(log, base, build, value, WIDTH * scale) for build, value, scale in zip(at, values, scales, strict=True)
    ]
    state, nodes, ends, contacts, first, pool = (np.stack(each) for each in zip(*every, strict=True))
    return Rates(state, nodes, ends, contacts, first, pool, np.abs(np.array(scales, dtype=float)))


def _rate(log: Log, base: list[Array], build: Callable[[float], Log], value: float, width: float) -> list[Array]:
    try:
        return _difference(log, base, build, value, width, CENTRAL, -4)
    except ImpactlabError:
        pass  # beyond a limit of the parameter: one side
    try:
        return _difference(log, base, build, value, width, FORWARD, 0)
    except ImpactlabError:
        return _difference(log, base, build, value, -width, FORWARD, 0)


def _difference(
    log: Log, base: list[Array], build: Callable[[float], Log], value: float, width: float, weights: Array, first: int
) -> list[Array]:
    total = [np.zeros_like(numbers) for numbers in base]
    for place, weight in enumerate(weights.tolist(), start=first):
        if place == 0:
            continue
        made = build(value + place * width)
        if not same_layout(log, made):
            raise ImpactlabError(
                f"at {value + place * width:.6g}, beside the value {value:.6g}, the case has other contacts, supports "
                "or sections, so that there is no derivative",
                remedy="Use differences of runs, or another value.",
            )
        for sum_, found, start in zip(total, numbers(made), base, strict=True):
            # Differences from the base keep the digits of unchanged numbers; masses of walls are infinite.
            change = np.where(np.isfinite(start), found - np.where(np.isfinite(start), start, 0.0), 0.0)
            sum_ += weight / width * change
    return total
