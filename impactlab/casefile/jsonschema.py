"""The JSON schema of case files, with the fields of the parts that are installed."""

from __future__ import annotations

import dataclasses
from typing import Any

from impactlab.casefile.parts import SPHERE_MATERIALS, group_of, part_model
from impactlab.casefile.schema import CaseBlock
from impactlab.casefile.values.materials import MATERIALS
from impactlab.contact.spheres import Spheres
from impactlab.errors import PluginError
from impactlab.plugins import INTEGRATORS, LAWS, MECHANISMS, MODELS, Group, Registry, describe, kind_of


def case_schema(registry: Registry) -> dict[str, Any]:
    """Return the JSON schema of the case format, without broken parts."""
    schema = CaseBlock.model_json_schema()
    blocks = schema["$defs"]
    solve = blocks["SolveBlock"]["properties"]
    _put(blocks["ContactBlock"]["properties"], "law", LAWS, registry)
    contact = blocks["ContactBlock"]
    contact["required"].remove("between")
    contact["oneOf"] = [{"required": ["between"]}, {"required": ["chain"]}]
    _put_parts(schema["properties"]["mechanisms"], registry)
    _put(solve, "model", MODELS, registry)
    _put(solve, "integrator", INTEGRATORS, registry)
    described = solve["models"].get("description", "")
    solve["models"] = {"type": "object", "additionalProperties": _choices(MODELS, registry), "description": described}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "impactlab case, format 1"}


def _put(properties: dict[str, Any], key: str, group: Group, registry: Registry) -> None:
    old = properties[key]
    kept = {name: old[name] for name in ("description", "default") if name in old}
    properties[key] = {**_choices(group, registry), **kept}


def _put_parts(mechanisms: dict[str, Any], registry: Registry) -> None:
    """Describe mechanisms: chains of links, and the parts that are installed."""
    chain = {"$ref": "#/$defs/MechanismBlock"}
    mechanisms["additionalProperties"] = {"anyOf": [chain, *_choices(MECHANISMS, registry)["oneOf"]]}


def _put_inside(properties: dict[str, Any], part: type[Any], registry: Registry) -> None:
    """Describe the fields of a part that hold parts: a name, or a block."""
    for field in dataclasses.fields(part):
        group = group_of(field) if field.init else None
        if group is not None:
            described = properties[field.name]["description"]
            choices = [{"enum": list(registry.names(group))}, *_choices(group, registry)["oneOf"]]
            properties[field.name] = {"oneOf": choices, "description": described}
            if field.default not in (None, dataclasses.MISSING):
                properties[field.name]["default"] = {"kind": kind_of(field.default)}


def _put_spheres(properties: dict[str, Any], part: type[Any]) -> None:
    """Describe the block of spheres that a stiffness of a power law may be."""
    for field in dataclasses.fields(part):
        if field.init and field.metadata["unit"].endswith("^n"):
            described = properties[field.name].pop("description")
            sizes = part_model(Spheres).model_json_schema()["properties"]
            names = {key: {"enum": list(MATERIALS)} for key in SPHERE_MATERIALS}
            block = {"type": "object", "properties": sizes | names, "additionalProperties": False}
            block["required"] = ["radius"]
            properties[field.name] = {"anyOf": [properties[field.name], block], "description": described}


def _choices(group: Group, registry: Registry) -> dict[str, Any]:
    choices = []
    for name in registry.names(group):
        try:
            part = registry.load(group, name)
            fields = part_model(part).model_json_schema()
            _put_inside(fields["properties"], part, registry)
            _put_spheres(fields["properties"], part)
        except PluginError:
            continue
        choices.append(
            {
                "type": "object",
                "description": describe(part),
                "properties": {"kind": {"const": name}, **fields.get("properties", {})},
                "required": ["kind", *fields.get("required", [])],
                "additionalProperties": False,
            }
        )
    return {"oneOf": choices}
