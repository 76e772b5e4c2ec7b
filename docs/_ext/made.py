"""Texts of pages that are made from the code: the keys of case files, registered parts, commands, refusals.

A line ``<!-- made: case format -->`` of a page stands for the first, ``<!-- made: parts of contact_laws -->`` for parts
of one group, ``<!-- made: commands -->`` for the help of each command, ``<!-- made: refusals -->`` for the last. A note
above it, for readers of the repository, is left out.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import command_help
import refusals
from sphinx.application import Sphinx

from impactlab.casefile.jsonschema import case_schema
from impactlab.casefile.listing import listing
from impactlab.plugins import registry

BODIES = ("RodBlock", "BeamBlock", "ShaftBlock", "MassBlock", "WallBlock")
Schema = Mapping[str, Any]
LIMITS = {"exclusiveMinimum": "> {:g}", "minimum": "≥ {:g}", "exclusiveMaximum": "< {:g}", "maximum": "≤ {:g}"}
MADE = re.compile(r"^(This (?:table|list) is filled in [^\n]*\n\n)?<!-- made: (?P<what>[^>]+?) -->$", re.MULTILINE)


def title(block: str) -> str:
    """Return the heading of a block from the name of its class: ``BeamEndsBlock`` is "Beam ends"."""
    return re.sub(r"(?<!^)(?=[A-Z])", " ", block.removesuffix("Block")).capitalize()


def allowed(field: Schema) -> str:
    """Return the values that a field allows, in Markdown."""
    if "$ref" in field:
        block = field["$ref"].rpartition("/")[2]
        return f"[{title(block)}](#{title(block).lower().replace(' ', '-')})"
    if "enum" in field:
        return ", ".join(f"`{value}`" for value in field["enum"])
    if "const" in field:
        return f"`{field['const']}`"
    choices = field.get("anyOf") or field.get("oneOf")
    if choices:
        if all("properties" in each and "kind" in each["properties"] for each in choices if "enum" not in each):
            return "a part, see below"
        texts = dict.fromkeys(allowed(each) for each in choices if each.get("type") != "null" and not is_unit(each))
        return " or ".join(text for text in texts if text)
    kind = field.get("type")
    if kind in ("number", "integer"):
        limits = ", ".join(text.format(field[key]) for key, text in LIMITS.items() if key in field)
        return f"{'whole number' if kind == 'integer' else 'number'}{f' {limits}' if limits else ''}"
    if kind == "array":
        inside = [*field.get("prefixItems", ()), *([field["items"]] if isinstance(field.get("items"), dict) else ())]
        return f"list of {' or '.join(dict.fromkeys(map(allowed, inside)))}" if inside else "list"
    if kind == "object":
        keys = [f"{key}: …" for key in field.get("properties", {})]
        return f"`{{{', '.join(keys)}}}`" if keys else "blocks by name"
    return (
        {"string": "string", "boolean": "`true`, `false`"}.get(kind, "")
        if isinstance(kind, str)
        else "number or string"
    )


def is_unit(field: Schema) -> bool:
    """Return whether a choice is the text of a number with a unit, which every quantity allows."""
    return field.get("type") == "string" and str(field.get("description", "")).startswith("number and unit")


def default(key: str, block: Schema) -> str:
    """Return the default of a field, in Markdown."""
    if key in block.get("required", ()):
        return "**needed**"
    value = block["properties"][key].get("default")
    if value is None:
        return ""
    if isinstance(value, dict) and "kind" not in value and value != {"relative": value.get("relative")}:
        return ""  # of a block: the defaults of its own keys
    text = {True: "true", False: "false"}.get(value) if isinstance(value, bool) else None
    if isinstance(value, dict):
        text = "{" + ", ".join(f"{name}: {each}" for name, each in value.items()) + "}"
    elif isinstance(value, list):
        text = "[" + ", ".join(map(str, value)) + "]"
    return f"`{text if text is not None else value}`" if value != "" else ""


def rows(block: Schema) -> Iterator[str]:
    """Give a table of the keys of a block, in Markdown."""
    fields = {key: field for key, field in block.get("properties", {}).items() if key != "kind"}
    if not fields:
        return
    yield from ("", "| key | allowed | default | meaning |", "|---|---|---|---|")
    for key, field in fields.items():
        meaning = str(field.get("description", "")).replace("|", "\\|")
        yield f"| `{key}` | {allowed(field)} | {default(key, block)} | {meaning} |"


def case_format() -> str:
    """Return the reference of case files: a section for each block."""
    schema = case_schema(registry().only("impactlab"))
    blocks = schema["$defs"]
    lines = ["## The case", *rows(schema)]
    order = [*BODIES, "ContactBlock", "SolveBlock"]
    for name in [*order, *(each for each in blocks if each not in order)]:
        lines += ["", f"## {title(name)}", "", str(blocks[name].get("description", "")), *rows(blocks[name])]
    return "\n".join(lines)


def options(group: str) -> dict[str, Schema]:
    """Return the schemas of the parts of a group by name."""
    schema = case_schema(registry().only("impactlab"))
    blocks = schema["$defs"]
    solve = blocks["SolveBlock"]["properties"]
    modal = next(each for each in solve["model"]["oneOf"] if each["properties"]["kind"]["const"] == "modal")
    places = {
        "contact_laws": blocks["ContactBlock"]["properties"]["law"]["oneOf"],
        "models": solve["model"]["oneOf"],
        "integrators": solve["integrator"]["oneOf"],
        "bases": modal["properties"]["basis"]["oneOf"],
    }
    return {each["properties"]["kind"]["const"]: each for each in places[group] if "properties" in each}


def parts(group: str) -> str:
    """Return a section for each part of a group: what it is, its options, its sources."""
    lines: list[str] = []
    schemas = options(group)
    for part in listing(registry().only("impactlab")):
        if part.group.removeprefix("impactlab.") != group:
            continue
        lines += ["", f"### `{part.name}`", "", part.description, *rows(schemas[part.name])]
        if part.citations:
            lines += ["", f"Sources: {{cite:t}}`{','.join(part.citations)}`."]
    return "\n".join(lines)


def read(_app: Sphinx, _name: str, source: list[str]) -> None:
    """Replace the lines of a page that stand for a text."""

    def text(found: re.Match[str]) -> str:
        what = found["what"]
        if what in ("refusals", "commands"):
            return refusals.page() if what == "refusals" else command_help.page()
        return case_format() if what == "case format" else parts(what.removeprefix("parts of "))

    source[0] = MADE.sub(text, source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("source-read", read)
    return {"parallel_read_safe": True}
