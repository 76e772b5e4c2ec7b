"""The unit of a path of a case."""

from __future__ import annotations

import dataclasses
import re
from typing import Any, cast

from pydantic import BaseModel

from impactlab.casefile.parts import record_of, records_of
from impactlab.casefile.schema import CaseBlock
from impactlab.casefile.values.units import with_power
from impactlab.contact.spheres import Spheres
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
        else:
            place = entry(place, step)
    if isinstance(place, BaseModel) and key in type(place).model_fields:
        found = re.search(r"\[([^\]]+)\]", type(place).model_fields[key].description or "")
        return found[1] if found else ""
    if isinstance(place, End):
        return _unit_of_end(holder, field_name, key)
    return _unit_in_part(case, path, registry)


def _unit_in_part(case: CaseBlock, path: str, registry: Registry) -> str:
    """Return the unit of an option of a part.

    It may be in a record that an option holds, as the flow stress of a specimen.
    """
    keys = path.split(".")
    for size in range(len(keys) - 1, 0, -1):
        group = next((group for pattern, group in PARTS if pattern.fullmatch(".".join(keys[:size]))), None)
        if group is None:
            continue
        block: Any = case
        for key in keys[:size]:
            block = getattr(block, key, None) if isinstance(block, BaseModel) else entry(block, key)
        if not isinstance(block, dict) or "kind" not in block:
            return ""
        try:
            part = registry.load(group, block["kind"])
        except PluginError:
            return ""
        fields = dataclasses.fields(part)
        for key in keys[size:-1]:
            field, block = next((each for each in fields if each.name == key), None), block.get(key)
            record = record_of(block, records_of(field)) if field is not None and isinstance(block, dict) else None
            if isinstance(block, dict) and field is not None and field.metadata["unit"].endswith("^n"):
                record = Spheres
            if record is None:
                return ""
            fields = dataclasses.fields(record)
        unit = next((field.metadata["unit"] for field in fields if field.name == keys[-1]), "")
        n = block.get("exponent", getattr(part, "exponent", None))
        return with_power(unit, n) if unit.endswith("^n") and isinstance(n, (int, float)) else unit
    return ""


def entry(block: Any, key: str) -> Any:
    """Return an entry of a list or a mapping; None where there is none."""
    if isinstance(block, (list, tuple)):
        return block[int(key)] if key.isdecimal() and int(key) < len(block) else None
    return block.get(key) if isinstance(block, dict) else None


def _unit_of_end(ends: BaseModel, side: str, key: str) -> str:
    """Return the unit of a number of an end's support, from the schema of that end."""
    for annotation in type(ends).model_fields[side].metadata:
        for choice in annotation.schema["anyOf"]:
            if unit := choice.get("properties", {}).get(key, {}).get("unit"):
                return str(unit)
    return ""
