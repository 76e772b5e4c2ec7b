"""Formulas of x, t or i, evaluated without running code.

They give a quantity along a rod, over time or over an index. The formula is parsed, every node is compared with a short
list of allowed ones, and the tree is walked with numpy.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from impactlab.casefile.text.words import listed, shown
from impactlab.types import Array

MAX_LENGTH = 400  # characters
MAX_NODES = 150
MAX_DEPTH = 20
MAX_EXPONENT = 20.0

_FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    "abs": np.abs,
    "cos": np.cos,
    "exp": np.exp,
    "sin": np.sin,
    "sqrt": np.sqrt,
}
_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
    ast.Mod: np.mod,  # of an index alone
}
_NAMES = {("x", "L", "pi"): "x, L (the length), pi", ("t", "pi"): "t, pi", ("i", "n", "pi"): "i (1, 2, ... n), n, pi"}
OF_PLACE, OF_TIME, OF_INDEX = _NAMES


@dataclass(frozen=True)
class Formula:
    """A formula of x over a body of the given length [m].

    Called with x, shape (n,), it returns the same shape.
    """

    text: str
    length: float

    def __post_init__(self) -> None:
        parse(self.text)

    def __call__(self, x: Array) -> Array:
        places = np.asarray(x, dtype=float)
        names = {"x": places, "L": self.length, "pi": math.pi}
        return _values(parse(self.text), names, places.shape)


@dataclass(frozen=True)
class TimeFormula:
    """A formula of the time t [s], vectorized over t.

    Called with t, shape (n,), it returns the same shape.
    """

    text: str

    def __post_init__(self) -> None:
        parse(self.text, OF_TIME)

    def __call__(self, t: Array) -> Array:
        times = np.asarray(t, dtype=float)
        return _values(parse(self.text, OF_TIME), {"t": times, "pi": math.pi}, times.shape)


@dataclass(frozen=True)
class IndexFormula:
    """A formula of the index i of n blocks made from one.

    Called with n, it returns the values at i = 1 ... n, (n,).
    """

    text: str

    def __post_init__(self) -> None:
        parse(self.text, OF_INDEX)

    def __call__(self, count: int) -> Array:
        index = np.arange(1.0, count + 1.0)
        return _values(parse(self.text, OF_INDEX), {"i": index, "n": float(count), "pi": math.pi}, index.shape)


@lru_cache(maxsize=64)
def parse(text: str, names: tuple[str, ...] = OF_PLACE) -> ast.expr:
    """Return the checked tree of a formula of these names.

    Raises
    ------
    ValueError
        If the text holds anything that is not allowed; the message names it.
    """
    if len(text) > MAX_LENGTH:
        raise ValueError(f"the formula has {len(text)} characters; at most {MAX_LENGTH} are allowed")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ValueError(f"{shown(text)} is not a formula; {_allowed(names)}") from error
    nodes = sum(1 for _ in ast.walk(tree))
    if nodes > MAX_NODES:
        raise ValueError(f"the formula has {nodes} parts; at most {MAX_NODES} are allowed")
    _check(tree, 1, names)
    return tree


def _allowed(names: tuple[str, ...]) -> str:
    operators = "+ - * / ** %" if names == OF_INDEX else "+ - * / **"
    return f"allowed: numbers, {_NAMES[names]}, {operators}, and abs(), cos(), exp(), sin(), sqrt()"


def _check(node: ast.expr, depth: int, names: tuple[str, ...]) -> None:
    if depth > MAX_DEPTH:
        raise ValueError(f"the formula is nested deeper than {MAX_DEPTH} levels")
    if isinstance(node, ast.Constant):
        _check_number(node, names)
    elif isinstance(node, ast.Name):
        if node.id not in names:
            raise ValueError(f"the formula names {shown(node.id)}; {_allowed(names)}")
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.UAdd, ast.USub)):
        _check(node.operand, depth + 1, names)
    elif isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS and _has_operator(node.op, names):
        _check(node.left, depth + 1, names)
        _check(node.right, depth + 1, names)
        # An index is a number once it is known, and a tapered chain is a power of it.
        if isinstance(node.op, ast.Pow) and names != OF_INDEX:
            _check_exponent(node.right)
    elif isinstance(node, ast.Call):
        if not isinstance(node.func, ast.Name) or node.func.id not in _FUNCTIONS:
            called = shown(ast.unparse(node.func))
            raise ValueError(f"the formula calls {called}; functions allowed: {listed(_FUNCTIONS)}")
        if len(node.args) != 1 or node.keywords:
            raise ValueError(f"{node.func.id}() in a formula takes one value")
        _check(node.args[0], depth + 1, names)
    else:
        power = " (write a power as **)" if isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitXor) else ""
        raise ValueError(f"the formula holds {shown(ast.unparse(node))}{power}; {_allowed(names)}")


def _has_operator(operator: ast.operator, names: tuple[str, ...]) -> bool:
    return names == OF_INDEX or not isinstance(operator, ast.Mod)


def _check_number(node: ast.Constant, names: tuple[str, ...]) -> None:
    value = node.value
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"the formula holds {shown(value)}; {_allowed(names)}")
    try:
        finite = math.isfinite(float(value))
    except OverflowError:
        finite = False
    if not finite:
        raise ValueError(f"the formula holds {shown(value)}, which is not a finite number")


def _check_exponent(node: ast.expr) -> None:
    inner = node.operand if isinstance(node, ast.UnaryOp) else node
    if not isinstance(inner, ast.Constant):
        raise ValueError(f"the exponent {shown(ast.unparse(node))} is not a number; exponents are plain numbers")
    if abs(float(inner.value)) > MAX_EXPONENT:  # type: ignore[arg-type]
        raise ValueError(f"the exponent {shown(inner.value)} is too large; at most {MAX_EXPONENT:g} is allowed")


def _values(tree: ast.expr, names: dict[str, Any], shape: tuple[int, ...]) -> Array:
    """Return the values of a formula; a number alone is spread over the shape."""
    with np.errstate(all="ignore"):
        values = _evaluate(tree, names)
    return np.broadcast_to(np.asarray(values, dtype=float), shape).copy()


def _evaluate(node: ast.expr, names: dict[str, Any]) -> Any:
    match node:
        case ast.Constant():
            return float(node.value)  # type: ignore[arg-type]
        case ast.Name():
            return names[node.id]
        case ast.UnaryOp():
            value = _evaluate(node.operand, names)
            return -value if isinstance(node.op, ast.USub) else value
        case ast.BinOp():
            return _OPERATORS[type(node.op)](_evaluate(node.left, names), _evaluate(node.right, names))
        case ast.Call(func=ast.Name(id=name)):
            return _FUNCTIONS[name](_evaluate(node.args[0], names))
    raise ValueError("unreachable: the tree was checked")
