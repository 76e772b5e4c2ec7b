"""Directions of the unknowns that signals determine, by singular values.

Products of unknowns may be determined where these are not.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import orth

from impactlab.printing import enumerated
from impactlab.types import Array

MAX_DEVIATION = 3.0  # of a logarithm: beyond it the signals do not determine a direction
MIN_SINGULAR = 5.0e-5  # of the largest singular value: derivatives by differences are no better
MIN_EFFECT = 1.0e-4  # of the spread, by a change of a logarithm by 1: an unknown with less has no effect
MIN_COLUMN = 1.0e-7  # of the longest column of derivatives: a shorter one is rounding of runs over a step of 1e-6
NO_EFFECT = 1.0e-30  # singular value of a direction without an effect, in place of 0
MAX_LOGARITHM = 700.0  # of a float
MIN_PART = 0.02  # of a unit direction: parameters with less do not take part in it
MAX_POWERS = ((8, 2), (11, 1))  # parameters, and the largest power that is tried for so many


class Identifiability(NamedTuple):
    """Covariance of the unknowns, along the directions that signals determine and the others."""

    covariance: Array  # (n, n), along all directions
    known: Array  # (n, n), along the directions that are determined
    unseen: Array  # (k, n): orthonormal directions of the logarithms that are not determined
    is_free: NDArray[np.bool_]  # (n,): whether an unknown takes part in one
    weights: Array  # (n,): change of a logarithm over that of the unknown; 0 of those that are left out


class Product(NamedTuple):
    """A product of powers of parameters that the signals determine."""

    text: str  # "mass velocity", "length^2 density/young"
    powers: dict[str, int]  # by path
    value: float  # SI
    lower: float  # ends of its 95 % interval
    upper: float


def seen(jacobian: Array, spread: float, weights: Array) -> Identifiability:
    """Return which directions of the unknowns signals determine.

    Parameters
    ----------
    jacobian : array
        Derivatives of the residuals, (m, n).
    spread : float
        Standard deviation of the residuals.
    weights : array
        Change of the logarithm of each number over that of its unknown, (n,); 0 of offsets and shifts, for which no
        warning is given.
    """
    norms = lengths(jacobian)
    _, sizes, ways = np.linalg.svd(jacobian / norms, full_matrices=False)
    directions = ways / norms
    deviations = spread / sizes.clip(NO_EFFECT)
    own = directions * weights
    is_weak = (sizes < MIN_SINGULAR * sizes[0]) & (np.linalg.norm(ways * (weights > 0.0), axis=1) > MIN_PART)
    is_unseen = (deviations * np.linalg.norm(own, axis=1) > MAX_DEVIATION) | is_weak
    unseen = own[is_unseen]
    if len(unseen):
        unseen = orth((unseen / np.linalg.norm(unseen, axis=1)[:, None]).T).T
    is_free = np.linalg.norm(unseen, axis=0) > MIN_PART
    parts = [(directions[rows].T * deviations[rows] ** 2) @ directions[rows] for rows in (slice(None), ~is_unseen)]
    return Identifiability(parts[0], parts[1], unseen, is_free, weights)


def with_effects(jacobian: Array, spread: float) -> Array:
    """Return derivatives (m, n) with zeros for an unknown that has no effect beyond rounding.

    Rounding has the direction of any other column by chance, and would make that unknown seem undetermined.
    """
    found = np.linalg.norm(jacobian, axis=0)
    return np.where(found > max(MIN_EFFECT * spread, MIN_COLUMN * float(found.max(initial=0.0))), jacobian, 0.0)


def lengths(jacobian: Array) -> Array:
    """Return the lengths of the columns of derivatives, (n,).

    The length is 1 of an unknown without an effect, whose column is 0.
    """
    found = np.linalg.norm(jacobian, axis=0)
    return np.where(found > 0.0, found, 1.0)


def short_names(paths: Sequence[str]) -> list[str]:
    """Return as many last words of dotted paths as distinguish them.

    Of ``gain of CHANNEL`` it is the first word.
    """
    ends = [_ends(path) for path in paths]
    return [next((end for end in own if sum(end in other for other in ends) == 1), own[-1]) for own in ends]


def _ends(path: str) -> list[str]:
    """Return the names that a path may go by, the shortest first."""
    name, of, channel = path.partition(" of ")
    if of:
        number = channel[channel.rfind(" (") :] if channel.endswith(")") else ""
        return [name, name + number, path]
    words = path.split(".")
    return [".".join(words[-count:]) for count in range(1, len(words) + 1)]


def powers(unseen: Array) -> NDArray[np.int64]:
    """Return the simplest products of whole powers that do not change along directions, (products, parameters).

    Parameters
    ----------
    unseen : array
        Orthonormal directions of the logarithms, (k, p).

    Returns
    -------
    array
        Up to p - k independent rows of powers; fewer where there are no such simple ones.
    """
    count = unseen.shape[1]
    largest = next((power for limit, power in MAX_POWERS if count <= limit), 0)
    every = np.array(list(itertools.product(range(-largest, largest + 1), repeat=count)))
    length = np.linalg.norm(every, axis=1)
    still = np.linalg.norm(every @ unseen.T, axis=1) < MIN_PART * length
    tried = every[still & (length > 0.0)]
    tried = tried[(tried > 0).sum(axis=1) >= (tried < 0).sum(axis=1)]
    order = np.lexsort([*(-tried.T[::-1]), (tried < 0).sum(axis=1), np.abs(tried).sum(axis=1)])
    found: list[NDArray[np.int64]] = []
    for row in tried[order]:
        if np.linalg.matrix_rank(np.array([*found, row])) > len(found):
            found.append(row)
        if len(found) == count - len(unseen):
            break
    return np.array(found, dtype=np.int64).reshape(-1, count)


def named(row: Sequence[int], names: Sequence[str]) -> str:
    """Return a product in words, such as ``length^2 density/young``."""
    above, below = (
        [name + (f"^{sign * power}" if sign * power > 1 else "") for name, power in zip(names, row, strict=True)
         if sign * power > 0]
        for sign in (1, -1)
    )  # fmt: skip
    under = f"({' '.join(below)})" if len(below) > 1 else "".join(below)
    return " ".join(above or ["1"]) + (f"/{under}" if under else "")


def products(found: Identifiability, paths: Sequence[str], values: Sequence[float], reach: float) -> list[Product]:
    """Return the products of positive numbers that signals determine.

    They do not determine each of these numbers.

    Parameters
    ----------
    paths, values : sequence
        Those of all unknowns, n; values in SI.
    reach : float
        Half an interval over the standard deviation.
    """
    places = np.flatnonzero(found.is_free)
    names = short_names(paths)
    made = []
    for row in powers(found.unseen[:, places]):
        whole = np.zeros(len(paths))
        whole[places] = row * found.weights[places]
        middle = math.fsum(
            power * math.log(values[place]) for place, power in zip(places.tolist(), row.tolist(), strict=True)
        )
        half = reach * math.sqrt(float(whole @ found.known @ whole))
        text = named(row.tolist(), [names[place] for place in places])
        by_path = {paths[place]: power for place, power in zip(places.tolist(), row.tolist(), strict=True) if power}
        made.append(Product(text, by_path, *map(exponential, (middle, middle - half, middle + half))))
    return made


def exponential(x: float) -> float:
    """Return exp(x), inf beyond any float, as at the end of a hardly known number's interval."""
    return math.exp(x) if x < MAX_LOGARITHM else math.inf


def undetermined(found: Identifiability, paths: Sequence[str], made: Sequence[Product]) -> list[str]:
    """Return the parameters that signals do not determine, in words; empty where they determine all."""
    if not len(found.unseen):
        return []
    names = short_names(paths)
    free = [name for name, is_free in zip(names, found.is_free, strict=True) if is_free]
    infinite = "their intervals are infinite" if len(free) > 1 else "its interval is infinite"
    lines = [f"not determined by the signals: {enumerated(free)}; {infinite}"]
    if made:
        lines[0] += f". Only {enumerated([each.text for each in made])} {'are' if len(made) > 1 else 'is'} determined"
    elif len(found.unseen) == 1:
        way = found.unseen[0] / found.unseen[0][int(np.argmax(np.abs(found.unseen[0])))]
        among = zip(names, way.tolist(), strict=True)
        parts = [f"{name}^{power:.2g}" for name, power in among if abs(power) > MIN_PART]
        if len(parts) > 1:
            lines[0] += f". They can change together, as {' '.join(parts)}, without a change of the signals"
    return lines
