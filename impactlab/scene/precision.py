"""Limits of double precision: errors for singular matrices, overflow and lost digits."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextvars import ContextVar
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np

from impactlab.errors import CaseError
from impactlab.types import Array

if TYPE_CHECKING:
    from impactlab.scene.bodies import Body, ElasticBody

# Ratio of two quantities of one kind in one matrix; a factorisation loses as many digits of its sixteen.
MAX_RATIO = 1e12
MAX_DOT = 5000  # numbers whose squares are summed by BLAS: of more it would wait for other threads
NOTED_DECADES = 6.0  # decades from which on a ratio is named as the likely cause
LOST = ("infs or NaNs", "Maximum allowed size", "not positive definite", "illegal value", "did not converge")

LOST_DIGITS = (
    "Give a smaller step, or bring masses, stiffnesses and times nearer to one another: "
    "their ratios leave no significant digits. If they are ordinary, a part breaks its "
    "contract; `impactlab plugins --check NAME` examines a part."
)


_quiet: ContextVar[bool] = ContextVar("quiet", default=False)  # whether numpy is silent on overflow anyway


class quietly:  # noqa: N801 - used as `with quietly()`
    """Silence overflow warnings of numpy inside, once for every `in_precision` there."""

    __slots__ = ("state", "token")

    def __enter__(self) -> None:
        self.token, self.state = _quiet.set(True), np.errstate(all="ignore")
        self.state.__enter__()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.state.__exit__(kind, error, trace)
        _quiet.reset(self.token)


class in_precision:  # noqa: N801 - used as `with in_precision(...)`
    """Turn overflow, divisions by zero and singular matrices inside into a `CaseError`.

    ``what`` is computed there, as in: ``the modes of 'rod'``; of a body the furthest of its ratios is named.
    """

    __slots__ = ("body", "path", "quiet", "what")  # a run of 10000 bodies enters 50000 of these

    def __init__(self, what: str, path: str, body: Body | None = None) -> None:
        self.what, self.path, self.body = what, path, body
        self.quiet: np.errstate | None = None

    def __enter__(self) -> None:
        if not _quiet.get():
            self.quiet = np.errstate(all="ignore")
            self.quiet.__enter__()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.quiet is not None:
            self.quiet.__exit__(kind, error, trace)
        if not isinstance(error, (ArithmeticError, MemoryError, ValueError)):  # LinAlgError is a ValueError
            return
        ours = isinstance(error, ArithmeticError | MemoryError | np.linalg.LinAlgError)
        if ours or any(text in str(error) for text in LOST):
            raise beyond(self.what, self.path, self.body) from error


def check_finite(what: str, path: str, body: Body | None, *arrays: Array) -> None:
    """Raise `CaseError` unless all numbers of some arrays are finite."""
    if not all(map(all_finite, arrays)):
        raise beyond(what, path, body)


def all_finite(array: Array) -> bool:
    """Return whether all numbers of an array are finite."""
    flat = array.ravel()
    # A sum takes a third of the time; one that overflows decides nothing.
    total = flat.dot(flat) if flat.size <= MAX_DOT else np.add.reduce(flat)
    return math.isfinite(total) or bool(np.all(np.isfinite(flat)))


def beyond(what: str, path: str, body: Body | None = None) -> CaseError:
    """Return the error of numbers that cannot be computed with."""
    text = f"{what} cannot be computed in double precision"
    remedy = "Bring the sizes of masses, stiffnesses, dampings and times nearer to one another; check their units."
    if body is not None and body.elastic is not None:
        words, ratio, place = max(ratios(body.elastic), key=lambda each: abs(_decades(each[1])))
        if abs(_decades(ratio)) > NOTED_DECADES:
            text += f"; furthest from the body's own is {words}: {ratio:.3g} times. Allowed: about "
            text, path = text + f"{1.0 / MAX_RATIO:g} to {MAX_RATIO:g}", place
    return CaseError(text, remedy=remedy, path=path)


def ratios(body: ElasticBody) -> Iterator[tuple[str, float, str]]:
    """Yield ratios of loads and losses of a body to its own sizes, with paths."""
    path, piece = f"bodies.{body.name}", body.segments[0]
    whole, trip = body.length, body.round_trip
    for text, ratio, key in body.own_ratios():
        yield text, ratio, f"{path}.{key}"
    own = {"mass": body.mass, "spring": body.stiffness, "dashpot": piece.impedance}
    for side in ("left", "right"):
        end = getattr(body, side)
        if end.kind in own and end.value > 0.0:
            yield f"the {end.kind} at the {side} end", end.value / own[end.kind], f"{path}.ends.{side}"
    yield "the damping by mass over a round trip", body.damping.mass * trip, f"{path}.damping.mass"
    yield "the damping by stiffness over a round trip", body.damping.stiffness / trip, f"{path}.damping.stiffness"
    for number, each in enumerate(body.segments):
        place = f"{path}.segments.{number}" if len(body.segments) > 1 else path
        yield (
            "the viscosity over E and a round trip",
            each.viscosity / each.young / trip,
            f"{place}.material.viscosity",
        )
        yield "the length of a segment", each.length / whole, f"{place}.length"
        yield "the impedance of a segment", each.impedance / piece.impedance, place


def _decades(ratio: float) -> float:
    return math.log10(ratio) if 0.0 < ratio < math.inf else 0.0 if ratio == 0.0 else 400.0
