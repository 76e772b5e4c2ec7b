"""The unit of a path of a case."""

from __future__ import annotations

import dataclasses
import re
from typing import Any, cast

from pydantic import BaseModel

from impactlab.casefile.schema import CaseBlock
from impactlab.errors import PluginError
from impactlab.plugins import INTEGRATORS, LAWS, MECHANISMS, MODELS, Registry
from impactlab.scene.bodies import End

PARTS = (
    (re.compile(r"contacts\.\d+\.law"), LAWS),
    (re.compile(r"solve\.model|solve\.models\.[^.]+"), MODELS),
    (re.compile(r"solve\.integrator"), INTEGRATORS),
    (re.compile(r"mechanisms\.[^.]+"), MECHANISMS),
)
"""Paths of blocks that describe a part."""


def unit_of(case: CaseBlock, path: str, registry: Registry) -> str:
    """Return the SI unit at a dotted path: ``1`` of a number, empty without one."""
    block, _, key = path.rpartition(".")
    place: Any = case
    holder, field_name = cast(BaseModel, case), ""  # of the last block that pydantic checks
    for step in block.split(".") if block else ():
        if isinstance(place, BaseModel):
            holder, field_name = place, step
            place = getattr(place, step, None)
        elif isinstance(place, (list, tuple)):
            place = place[int(step)] if step.isdecimal() and int(step) < len(place) else None
        else:
            place = place.get(step) if isinstance(place, dict) else None
    if isinstance(place, BaseModel) and key in type(place).model_fields:
        found = re.search(r"\[([^\]]+)\]", type(place).model_fields[key].description or "")
        return found[1] if found else ""
    if isinstance(place, End):
        return _unit_of_end(holder, field_name, key)
    group = next((group for pattern, group in PARTS if pattern.fullmatch(block)), None)
    if group is None or not isinstance(place, dict):
        return ""
    try:
        fields = dataclasses.fields(registry.load(group, place["kind"]))
    except PluginError:
        return ""
    return next((field.metadata["unit"] for field in fields if field.name == key), "")


def _unit_of_end(ends: BaseModel, side: str, key: str) -> str:
    """Return the unit of a number of the support of an end, from the schema of that end."""
    for annotation in type(ends).model_fields[side].metadata:
        for choice in annotation.schema["anyOf"]:
            if unit := choice.get("properties", {}).get(key, {}).get("unit"):
                return str(unit)
    return ""
