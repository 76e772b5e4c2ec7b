"""Short names of axis values that are no numbers: methods, and blocks such as laws."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

MAX_LETTERS = 28  # of a line of a name in a figure


def words_of(values: Sequence[Any]) -> tuple[str, ...]:
    """Return a short name for each value; for a block its kind.

    Below it stand the parameters in which equal kinds differ. Values that would have the same name are numbered.
    """
    blocks = [_block(value) for value in values]
    kinds = Counter(str(block.get("kind", "")) for block in blocks if block is not None)
    names = []
    for value, block in zip(values, blocks, strict=True):
        if block is None:
            names.append(_cut(str(value)))
            continue
        kind = str(block.get("kind", "")) or "block"
        alike = [other for other in blocks if other is not None and other.get("kind") == block.get("kind")]
        differing = _differing(alike) if kinds[str(block.get("kind", ""))] > 1 else []
        names.append(
            "\n".join([_cut(kind), *(_cut(f"{key} {_short(block[key])}") for key in differing if key in block)])
        )
    return tuple(_numbered(names))


def _block(value: Any) -> Mapping[str, Any] | None:
    """Return a block from its JSON text; None of any other value."""
    if not isinstance(value, str) or not value.startswith("{"):
        return None
    try:
        block = json.loads(value)
    except ValueError:
        return None
    return block if isinstance(block, dict) else None


def _differing(blocks: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the keys whose values differ between blocks, in the blocks' order."""
    keys = dict.fromkeys(key for block in blocks for key in block)
    return [key for key in keys if len({json.dumps(block.get(key), sort_keys=True) for block in blocks}) > 1]


def _short(value: Any) -> str:
    if isinstance(value, dict):
        return str(value.get("kind", "..."))
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return f"{value:.6g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")
    return str(value)


def _cut(text: str) -> str:
    return text if len(text) <= MAX_LETTERS else f"{text[: MAX_LETTERS - 3]}..."


def _numbered(names: Sequence[str]) -> list[str]:
    counts, seen = Counter(names), Counter[str]()
    found = []
    for name in names:
        seen[name] += 1
        found.append(f"{name} ({seen[name]})" if counts[name] > 1 else name)
    return found
