"""Blocks made from one, gathered into one block again.

It holds their number, and every value that differs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from impactlab.casefile.blocks.origins import Origin, Origins


def gathered_again(resolved: Mapping[str, Any], written: Mapping[str, Any], origins: Origins) -> dict[str, Any]:
    """Return a resolved case with repeated blocks gathered; the scene is the same.

    Values that differ stand as ``{each: [...]}``; faces and bodies as the case names them.
    """
    gathered = dict(resolved)
    gathered["bodies"] = _bodies(resolved["bodies"], origins.bodies)
    for key in ("contacts", "probes"):
        if key in origins.lists:
            gathered[key] = _blocks(resolved[key], written[key], origins.lists[key])
    return gathered


def _bodies(bodies: Mapping[str, Any], origins: Mapping[str, Origin]) -> dict[str, Any]:
    made: dict[str, list[Any]] = {}
    for name, block in bodies.items():
        origin = origins.get(name)
        made.setdefault(name if origin is None else origin.block.partition(".")[2], []).append(block)
    counts = {origin.block.partition(".")[2]: origin.count for origin in origins.values()}
    return {
        name: {**_one(blocks), "repeat": counts[name]} if name in counts else blocks[0] for name, blocks in made.items()
    }


def _blocks(blocks: Sequence[Any], written: Sequence[Mapping[str, Any]], origins: Sequence[Origin | None]) -> list[Any]:
    made: dict[str, list[Any]] = {}
    for block, origin in zip(blocks, origins, strict=True):
        if origin is not None:
            made.setdefault(origin.block, []).append(block)
    found = []
    for (_, each), given in zip(made.items(), written, strict=True):
        named = {key: given[key] for key in ("chain", "between", "body", "name") if key in given}
        if "chain" in given:
            found.append({**named, **{key: value for key, value in _one(each).items() if key != "between"}, **named})
        elif "repeat" in given:
            found.append({**_one(each), **named, "repeat": len(each)})
        else:
            found.append(each[0])
    return found


def _one(blocks: Sequence[Any]) -> Any:
    """Return the one value of several, a block, or ``{each: [...]}``.

    Blocks with the same keys make a block.
    """
    first = blocks[0]
    if all(block == first for block in blocks):
        return first
    if isinstance(first, dict) and all(isinstance(block, dict) and block.keys() == first.keys() for block in blocks):
        return {key: _one([block[key] for block in blocks]) for key in first}
    return {"each": list(blocks)}
