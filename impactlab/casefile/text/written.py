"""A case as the text of a case file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from impactlab.casefile.text.samples import Samples

MAX_LINE = 110  # characters of a block that stands on one line


def yaml_text(data: Mapping[str, Any]) -> str:
    """Return plain values as YAML: short blocks on one line, texts in quotes."""
    return "\n".join(_lines(data, "", {})) + "\n"


def _lines(block: Mapping[str, Any], pad: str, known: dict[int, str]) -> list[str]:
    """Return the lines of a block; ``known`` are the texts of its lists, which are written at each level above them."""
    lines: list[str] = []
    for key, value in block.items():
        flow = f"{pad}{key}: {_flow(value, known)}"
        if len(flow) <= MAX_LINE or not value or not isinstance(value, (Mapping, list)):
            lines.append(flow)
        elif isinstance(value, Mapping):
            lines += [f"{pad}{key}:", *_lines(value, pad + "  ", known)]
        elif all(isinstance(item, Mapping) and item for item in value):
            lines.append(f"{pad}{key}:")
            for item in value:
                first, *others = _lines(item, pad + "    ", known)
                lines += [f"{pad}  - {first.strip()}", *others]
        else:
            lines.append(flow)
    return lines


def _flow(value: Any, known: dict[int, str]) -> str:
    if isinstance(value, float) and math.isfinite(value):
        return float.__repr__(value)  # as JSON writes it, also a number of numpy
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_flow(inner, known)}" for key, inner in value.items()) + "}"
    if isinstance(value, (list, Samples)):
        if id(value) not in known:
            known[id(value)] = "[" + ", ".join(_flow(inner, known) for inner in value) + "]"
        return known[id(value)]
    return json.dumps(value, ensure_ascii=False)
