"""Expansion of repeated blocks: ``repeat`` and ``chain``, with formulas of an index.

Bodies, contacts and probes are made from them. The blocks are written out before they are checked, so that the rules of
a case do not depend on them. Errors are led back to the block as it stands in the file
(`impactlab.casefile.blocks.origins`).
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from impactlab.casefile.blocks.origins import Origin, Origins
from impactlab.casefile.text.samples import Samples
from impactlab.casefile.text.words import shown
from impactlab.casefile.values.formula import IndexFormula
from impactlab.errors import WHOLE, CaseError

MAX_REPEAT = 100_000  # bodies, contacts or probes of a case
MAX_GENERATED = 2_000_000  # values written out: some 100 bytes each
INDEX = "i from 1 to n"
_TEXTS = frozenset({"kind", "name", "body", "between", "chain", "quantity", "material"})  # keys that hold no formula
_NAMES = frozenset({"name", "body", "between", "chain"})  # of these, keys that hold names of bodies and contacts
_OF_INDEX = re.compile(r"(?<![A-Za-z0-9_.])[in](?![A-Za-z0-9_])")
_BRACES = re.compile(r"\{([^{}]*)\}")


class Varying(list[Any]):
    """The values of one key in the n blocks, i = 1 ... n."""


class Expanded(NamedTuple):
    """A case with every block written out, and where each came from."""

    data: dict[str, Any]
    origins: Origins


def expand(data: dict[str, Any]) -> Expanded:
    """Return a case with its repeated blocks and chains written out.

    It is the same case where it has none.

    Parameters
    ----------
    data : dict
        The case as plain values; not changed. Blocks written out share the values that do not vary.

    Raises
    ------
    CaseError
        If a count is not whole or above its limit, a formula is wrong, two bodies get one name, or the values written
        out are too many; before any of them is.
    """
    bodies, lists = data.get("bodies"), {key: data.get(key) for key in ("contacts", "probes")}
    many = [block for block in (bodies.values() if isinstance(bodies, dict) else ()) if _is_many(block)]
    many += [block for each in lists.values() if isinstance(each, list) for block in each if _is_many(block)]
    if not many:
        return Expanded(data, Origins())
    made, origins, names = dict(data), Origins(), dict[str, list[str]]()
    if isinstance(bodies, dict):
        made["bodies"], origins.bodies, names = _bodies(bodies)
    for key, blocks in lists.items():
        if isinstance(blocks, list):
            made[key], origins.lists[key] = _blocks(key, blocks, names, made.get("bodies"))
    return Expanded(made, origins)


def _is_many(block: Any) -> bool:
    return isinstance(block, dict) and ("repeat" in block or "chain" in block)


def count_of(value: Any, path: str) -> int:
    """Return a count of blocks.

    Raises `CaseError` where it is not whole, or beyond its limits.
    """
    whole = isinstance(value, (int, float)) and not isinstance(value, bool) and value == value // 1
    if not whole or not 1 <= value <= MAX_REPEAT:
        fault = "is out of range" if whole else "is not a whole number"
        raise CaseError(
            f"{shown(value)} {fault}. Allowed: a whole number from 1 to {MAX_REPEAT}",
            remedy="Give the number of blocks to make from this one.",
            path=path,
            needs=WHOLE,
        )
    return int(value)


def _names_made(name: str, count: int) -> list[str]:
    """Return the names of the bodies made from a block.

    They are NAME_1 ... of NAME, or those of its formula in braces.
    """
    text = name if "{" in name else f"{name}_{{i}}"
    return [str(each) for each in _many(_texts(text, count, f"bodies.{name}", in_name=True), count)]


def block_of(bodies: Mapping[str, Any], name: str) -> tuple[str, int] | None:
    """Return the repeated block that makes a body, and its count, or None."""
    for block, value in bodies.items():
        if isinstance(value, dict) and "repeat" in value:
            count = count_of(value["repeat"], f"bodies.{block}.repeat")
            if name in _names_made(block, count):
                return block, count
    return None


def _bodies(bodies: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Origin], dict[str, list[str]]]:
    """Return all bodies, origins of those made, and names by block."""
    counts = {name: count_of(block["repeat"], f"bodies.{name}.repeat") for name, block in bodies.items()
              if isinstance(block, dict) and "repeat" in block}  # fmt: skip
    _check_total("bodies", len(bodies) - len(counts) + sum(counts.values()))
    _check_values(sum(count * _size(bodies[name]) for name, count in counts.items()), "bodies")
    found: dict[str, Any] = {}
    origins: dict[str, Origin] = {}
    names: dict[str, list[str]] = {}
    for name, block in bodies.items():
        path = f"bodies.{name}"
        if name not in counts:
            made, blocks = [name], [block]
        else:
            count = counts[name]
            made = _names_made(name, count)
            blocks = _copies({key: value for key, value in block.items() if key != "repeat"}, count, path)
            names[name] = made
        for index, (each, inside) in enumerate(zip(made, blocks, strict=True), 1):
            if each in found or (each in bodies and each != name):
                first = origins[each].block if each in origins else f"bodies.{each}"
                other = "another one" if first == path else first
                raise CaseError(
                    f"this block makes a body {shown(each)} at i = {index}, and {other} has the same name",
                    remedy="Give the block another name: NAME, which makes NAME_1, NAME_2, ..., or NAME{i}.",
                    path=path,
                )
            found[each] = inside
            if name in counts:
                origins[each] = Origin(path, index, counts[name])
    return found, origins, names


def _blocks(
    key: str, blocks: list[Any], names: Mapping[str, list[str]], bodies: Any
) -> tuple[list[Any], list[Origin | None]]:
    """Return all blocks of a list, and the origin of each."""
    plans: list[tuple[int, _Row | None]] = []
    for number, block in enumerate(blocks):
        path = f"{key}.{number}"
        if isinstance(block, dict) and "chain" in block and key == "contacts":
            chained = _row(block, path, names, bodies)
            plans.append((len(chained.pairs), chained))
        elif isinstance(block, dict) and "repeat" in block:
            plans.append((count_of(block["repeat"], f"{path}.repeat"), None))
        else:
            plans.append((0, None))
    _check_total(key, sum(max(count, 1) for count, _ in plans))
    _check_values(sum(count * _size(block) for (count, _), block in zip(plans, blocks, strict=True)), key)
    found: list[Any] = []
    origins: list[Origin | None] = []
    for number, ((count, row), block) in enumerate(zip(plans, blocks, strict=True)):
        path = f"{key}.{number}"
        if not count:
            found.append(block)
            origins.append(Origin(path, 0, 0))
            continue
        template = {name: value for name, value in block.items() if name not in ("repeat", "chain")}
        copies = _copies(template, count, path)
        if row is not None:
            copies = [{"between": pair, **each} for pair, each in zip(row.pairs, copies, strict=True)]
        found += copies
        items: Iterable[tuple[int, ...]] = [()] * count if row is None else itertools.pairwise(row.items)
        origins += [Origin(path, index, count, each) for index, each in enumerate(items, 1)]
    return found, origins


class _Row(NamedTuple):
    """The bodies of a chain from left to right."""

    pairs: list[list[str]]  # neighbours
    items: list[int]  # of each body, the number of the item of ``chain`` that gives it


def _row(block: dict[str, Any], path: str, names: Mapping[str, list[str]], bodies: Any) -> _Row:
    """Return the bodies of a chain.

    A rod meets its neighbours by its left and its right end.
    """
    for key in ("between", "repeat"):
        if key in block:
            raise CaseError(
                f"given together with chain, which gives {'the pairs' if key == 'between' else 'their number'}",
                remedy=f"Keep one of chain and {key}.",
                path=f"{path}.{key}",
            )
    chain = block["chain"]
    if not isinstance(chain, list) or not all(isinstance(name, str) for name in chain):
        wrong = next((name for name in chain if not isinstance(name, str)), None) if isinstance(chain, list) else chain
        raise CaseError(
            f"{shown(wrong)} is not {'the name of a body' if isinstance(chain, list) else 'a list'}. "
            "Allowed: a list of bodies from left to right",
            remedy="Write chain: [striker, bead, wall]; the name of a repeated block stands for all its bodies.",
            path=f"{path}.chain",
        )
    row = [name for item in chain for name in names.get(item, [item])]
    if len(row) < 2:
        raise CaseError(
            f"a chain of {len(row)} {'body' if len(row) == 1 else 'bodies'} has no contact. Allowed: 2 or more",
            remedy="Name its bodies from left to right.",
            path=f"{path}.chain",
        )
    blocks = bodies.items() if isinstance(bodies, dict) else ()
    rods = {name for name, body in blocks if isinstance(body, dict) and body.get("kind") == "rod"}
    pairs = [
        [f"{one}.right" if one in rods else one, f"{other}.left" if other in rods else other]
        for one, other in itertools.pairwise(row)
    ]
    return _Row(pairs, [number for number, item in enumerate(chain) for _ in names.get(item, [item])])


def _check_total(key: str, count: int) -> None:
    if count > MAX_REPEAT:
        raise CaseError(
            f"{count} {key} in all. Allowed: up to {MAX_REPEAT}",
            remedy=f"Give fewer {key}: a smaller repeat, or fewer blocks.",
            path=key,
        )


def _check_values(count: int, key: str) -> None:
    if count > MAX_GENERATED:
        raise CaseError(
            f"{count} values in all once every block is written out. Allowed: up to {MAX_GENERATED}",
            remedy="Give a smaller number, or shorter blocks.",
            path=key,
        )


def _size(value: Any) -> int:
    """Return the number of values in a block."""
    if isinstance(value, dict):
        return 1 + (1 if set(value) == {"each"} else sum(_size(inside) for inside in value.values()))
    return 1 + sum(_size(inside) for inside in value) if isinstance(value, list) else 1


def _copies(block: dict[str, Any], count: int, path: str) -> list[Any]:
    """Return the n blocks made from one."""
    return _many(_filled(block, "", count, path), count)


def _many(value: Any, count: int) -> list[Any]:
    return list(value) if isinstance(value, Varying) else [value] * count


def _filled(value: Any, key: str, count: int, path: str) -> Any:
    """Return a value as it is, or as `Varying` where it depends on the index."""
    if isinstance(value, str):
        return _texts(value, count, path, in_name=key in _NAMES) if "{" in value else _numbers(value, key, count, path)
    if isinstance(value, dict):
        if set(value) == {"each"}:
            return _each(value["each"], count, path)
        inside = {name: _filled(each, name, count, f"{path}.{name}") for name, each in value.items()}
        if not any(isinstance(each, Varying) for each in inside.values()):
            return value
        columns = [_many(each, count) for each in inside.values()]
        return Varying(dict(zip(inside, row, strict=True)) for row in zip(*columns, strict=True))
    if type(value) is list:
        items = [_filled(each, key, count, f"{path}.{number}") for number, each in enumerate(value)]
        if not any(isinstance(each, Varying) for each in items):
            return value
        return Varying(list(row) for row in zip(*(_many(each, count) for each in items), strict=True))
    return value


def _each(values: Any, count: int, path: str) -> Any:
    if not isinstance(values, (list, Samples)) or len(values) != count:
        raise CaseError(
            f"{shown(values)} is given for {count} blocks. Allowed: {{each: [...]}} with one value for each",
            remedy=f"Give {count} values.",
            path=f"{path}.each",
        )
    return Varying(values)


def _numbers(text: str, key: str, count: int, path: str) -> Any:
    """Return the values of a formula of the index, in SI.

    A text without i and n is returned as it is.
    """
    if key in _TEXTS or not _OF_INDEX.search(text):
        return text
    return Varying(_evaluated(text, count, path).tolist())


def _texts(text: str, count: int, path: str, in_name: bool = False) -> Any:
    """Return a text with formulas in braces replaced by their values.

    A value inside a name must be whole.
    """
    pieces: list[Any] = []
    end = 0
    for found in _BRACES.finditer(text):
        values = _evaluated(found[1], count, path)
        if in_name and "(" not in text[: found.start()]:  # not the place of rod.at(x)
            _check_whole(values, found[1], path)
        pieces += [[text[end : found.start()]] * count, map(_digits, values.tolist())]
        end = found.end()
    pieces.append([text[end:]] * count)
    return Varying(map("".join, zip(*pieces, strict=True))) if len(pieces) > 1 else text


def _check_whole(values: Any, formula: str, path: str) -> None:
    """Raise `CaseError` where a number in a name is not whole: a point would end the name."""
    if (broken := np.flatnonzero(values != np.floor(values))).size:
        raise CaseError(
            f"{shown(formula)} gives {values[broken[0]]:.6g} at i = {broken[0] + 1}. Allowed in a name: whole numbers",
            remedy=f"Write a formula with whole values, {INDEX}.",
            path=path,
        )


def _digits(value: float) -> str:
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)


def _evaluated(text: str, count: int, path: str) -> Any:
    try:
        values = IndexFormula(text)(count)
    except ValueError as error:
        raise CaseError(str(error), remedy=f"Write a formula of the index, {INDEX}.", path=path) from error
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        raise CaseError(
            f"{shown(text)} is not a finite number at i = {wrong[0] + 1}",
            remedy="Fix the formula (a division by zero, the root of a negative number, a power too large).",
            path=path,
        )
    return values
