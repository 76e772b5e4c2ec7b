"""Bar elements of any order: Gauss-Lobatto-Legendre nodes, polynomials and element matrices."""

from __future__ import annotations

from functools import cache, lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from impactlab.errors import CaseError
from impactlab.scene.bodies import Segment
from impactlab.types import Array, Ints

MassMatrix = Literal["consistent", "lumped", "redistributed"]


class Reference(NamedTuple):
    """An element from -1 to 1 with EA = rho A = 1, in its ``order + 1`` nodes."""

    nodes: Array  # (order + 1,)
    weights: Array  # (order + 1,) of the quadrature at the nodes, exact up to the degree 2 order - 1
    slopes: Array  # (order + 1, order + 1) derivative at node i of the polynomial of node j
    stiffness: Array  # (order + 1, order + 1), exact
    consistent: Array  # (order + 1, order + 1) mass, exact
    lumped: Array  # (order + 1, order + 1) mass by the quadrature at the nodes: diagonal


@cache
def reference(order: int) -> Reference:
    """Return the element of that order; order 1 is the 2-node bar.

    References
    ----------
    Patera1984 (polynomials through the points of a Gauss-Lobatto rule); KomatitschTromp1999 (in place of Chebyshev's,
    Legendre's points, whose quadrature makes the mass diagonal).
    """
    nodes = _nodes(order)
    last = legendre.Legendre.basis(order)
    values = last(nodes)
    weights = 2.0 / (order * (order + 1) * values**2)
    apart = nodes[:, None] - nodes[None, :] + np.eye(order + 1)
    slopes = values[:, None] / (values[None, :] * apart)
    np.fill_diagonal(slopes, 0.0)
    np.fill_diagonal(slopes, -slopes.sum(axis=1))
    stiffness = slopes.T @ (weights[:, None] * slopes)
    stiffness = 0.5 * (stiffness + stiffness.T)
    np.fill_diagonal(stiffness, 0.0)
    np.fill_diagonal(stiffness, -stiffness.sum(axis=1))  # a rigid motion has no energy, to rounding
    points, shares = legendre.leggauss(order + 1)
    shapes = np.array([polynomials(order, float(point)) for point in points])
    consistent = shapes.T @ (shares[:, None] * shapes)
    return Reference(nodes, weights, slopes, stiffness, consistent, np.diag(weights))


def polynomials(order: int, place: float) -> Array:
    """Return the polynomials of the nodes at a place, shape (order + 1,).

    The place is from -1 to 1; they are exactly 0 or 1 at the nodes.
    """
    nodes = _nodes(order)
    if order == 1 and abs(place) == 1.0:
        return np.array([0.5 * (1.0 - place), 0.5 * (1.0 + place)])
    apart = nodes[:, None] - nodes[None, :]
    np.fill_diagonal(apart, 1.0)
    ratios = (place - nodes[None, :]) / apart
    np.fill_diagonal(ratios, 1.0)
    return np.asarray(ratios.prod(axis=1))


@cache
def _nodes(order: int) -> Array:
    last = legendre.Legendre.basis(order)
    inner = np.sort(last.deriv().roots().real) if order > 1 else np.zeros(0)
    if inner.size:
        inner = inner - last.deriv()(inner) / last.deriv(2)(inner)  # one step of Newton removes the roots' rounding
    return np.concatenate(([-1.0], 0.5 * (inner - inner[::-1]), [1.0]))


def assembled(element: Array, scale: Array | float, count: int) -> Array:
    """Return the banded matrix (order + 1, n_nodes) of a row of elements.

    ``count`` elements share their end nodes. ``element`` (order + 1, order + 1) is symmetric and multiplied by
    ``scale``, (count,) or the same in each.
    """
    order = len(element) - 1
    matrix = np.zeros((order + 1, order * count + 1))
    for i in range(order + 1):
        for j in range(i + 1):
            matrix[i - j, j : j + order * count : order] += element[i, j] * scale
    return matrix


def assembled_diagonal(weights: Array, scale: Array | float, count: int) -> Array:
    """Return the sum (1, n_nodes) of diagonal element matrices, each of the diagonal ``weights`` (order + 1,)."""
    order = weights.size - 1
    matrix = np.zeros((1, order * count + 1))
    for i, weight in enumerate(weights.tolist()):
        matrix[0, i : i + order * (count - 1) + 1 : order] += weight * scale
    return matrix


@lru_cache(maxsize=256)
def elements_per_segment(segments: tuple[Segment, ...], elements: int) -> tuple[int, ...]:
    """Return the number of elements of each segment: shared by travel time, at least one.

    They are ``elements`` in all, unless there are more segments.
    """
    if len(segments) == 1:
        return (max(1, elements),)
    times = np.array([segment.length / segment.wave_speed for segment in segments])
    shares = elements * times / times.sum()
    counts = np.maximum(1, np.floor(shares)).astype(int)
    while counts.sum() < elements:
        counts[np.argmax(shares - counts)] += 1
    while counts.sum() > elements and counts.max() > 1:
        counts[np.argmax(np.where(counts > 1, counts - shares, -np.inf))] -= 1
    return tuple(int(count) for count in counts)


@lru_cache(maxsize=64)
def spread(segments: tuple[Segment, ...], elements: int) -> tuple[Array, Ints]:
    """Return the lengths [m] and segment numbers of elements in a row, (n_elements,) both."""
    counts = elements_per_segment(segments, elements)
    each = np.array([segment.length / count for segment, count in zip(segments, counts, strict=True)])
    found = each.repeat(counts), np.arange(len(counts)).repeat(counts)
    for array in found:
        array.flags.writeable = False  # every caller gets the same arrays
    return found


class Elements(NamedTuple):
    """A row of elements from end to end."""

    lengths: Array  # (n_elements,) m
    segment: Ints  # (n_elements,) number of the segment of each
    borders: Array  # (n_elements + 1,) m
    shortest: float  # m


@lru_cache(maxsize=64)
def laid_out(segments: tuple[Segment, ...], elements: int) -> Elements:
    """Return a row of elements, shared among segments as by `spread`."""
    lengths, number = spread(segments, elements)
    borders = np.zeros(lengths.size + 1)
    np.cumsum(lengths, out=borders[1:])
    borders[-1] = sum(segment.length for segment in segments)
    borders.flags.writeable = False  # every caller gets the same arrays
    return Elements(lengths, number, borders, float(lengths.min()))


def shortest_transit(segments: tuple[Segment, ...], elements: int, order: int) -> float:
    """Return the shortest time of a wave from a node to the next [s].

    Each element has its own wave speed.
    """
    counts = elements_per_segment(segments, elements)
    return min(
        segment.length / count * node_distance(order) / segment.wave_speed
        for segment, count in zip(segments, counts, strict=True)
    )


def node_distance(order: int) -> float:
    """Return the smallest distance between two nodes over the length of their element."""
    nodes = reference(order).nodes
    return 0.5 * float(nodes[1] - nodes[0])


def check_order(order: int, mass: str) -> None:
    """Raise `CaseError` where a mass matrix does not exist for that order."""
    if mass == "redistributed" and order > 1:
        raise CaseError(
            f"mass 'redistributed' applies only to 2-node bars, but order {order} is given. Allowed: order 1",
            remedy="Give order: 1, or mass: lumped.",
            path="mass",
        )
