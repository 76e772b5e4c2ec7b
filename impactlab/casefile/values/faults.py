"""Errors of values, also pydantic's as one: place, value given, values allowed, and remedy."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails, PydanticCustomError

from impactlab.casefile.text.words import listed, shown
from impactlab.casefile.values.synonyms import key_of_synonym, renamed
from impactlab.errors import CaseError, ImpactlabError, closest, combined

_BLOCK = "a block of keys"
_NEEDED = {
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": _BLOCK,
    "model_type": _BLOCK,
    "model_attributes_type": _BLOCK,
    "string_type": "a string",
}
OF_CONTACT = ("between", "gap", "overlap", "pieces", "name", "lever_arm", "along")  # keys sought in its law
CHECK_FILE = "`impactlab check FILE` lists all faults; of a case without faults it prints every value in SI."

ONE_VALUE = "Give one value; a sweep runs a case at several: il.sweep, or `impactlab sweep`."
SNAPSHOTS = "Give a list of times, {every: time} or {count: number of parts}."
ENTRIES = {
    "contacts": "Write {between: [left, right]}, or {chain: [bodies]}; in Python il.Contact('left', 'right').",
    "probes": "Write {body: ..., at: ..., quantity: ...}; in Python il.Probe(body, at, quantity).",
}
FACE = "Name a face by its body in `bodies`, such as 'rod.left'; of a mass or a wall the name alone."


def case_error(error: ValidationError, data: Any, prefix: str, allowed: type[BaseModel]) -> ImpactlabError:
    """Return the first fault as an error of the case, which holds the others.

    Parameters
    ----------
    error : pydantic.ValidationError
        The faults.
    data : Any
        The validated block, as plain values.
    prefix : str
        Path of ``data`` in the case.
    allowed : pydantic model
        Its keys may stand in ``data``.
    """
    given = (fault for fault in error.errors(include_url=False) if not _counts_valid_entries(fault))
    faults = sorted(given, key=lambda fault: fault["type"] != "extra_forbidden")
    found = [(fault, _one(fault, data, prefix, allowed)) for fault in faults]
    misspelt = {_suggested(fault, each, prefix) for fault, each in found if fault["type"] == "extra_forbidden"}
    return combined([each for fault, each in found if fault["type"] != "missing" or each.path not in misspelt])


def _counts_valid_entries(fault: ErrorDetails) -> bool:
    """Return whether a list is called too short although it is not: its faulty entries do not count there."""
    return fault["type"] == "too_short" and len(fault["input"]) >= fault["ctx"]["min_length"]


def _suggested(fault: ErrorDetails, error: CaseError, prefix: str) -> str:
    """Return the path that a misspelt key stands for, which is then not missing."""
    key = re.search(r"Did you mean '(\w+)'", error.text)
    return ".".join(filter(None, (prefix, *_yaml_path(fault["loc"])[:-1], key[1]))) if key else ""


def _one(fault: ErrorDetails, data: Any, prefix: str, allowed: type[BaseModel]) -> CaseError:
    keys = _yaml_path(fault["loc"])
    path = ".".join(part for part in (prefix, *keys) if part)
    if fault["type"] == "union_tag_invalid":
        path += ".kind"
    text, remedy = _words(fault, keys, data, allowed, prefix)
    return CaseError(text, remedy=remedy, path=path)


def _words(fault: ErrorDetails, keys: list[str], data: Any, allowed: type[BaseModel], prefix: str) -> tuple[str, str]:
    kind = fault["type"]
    given = shown(fault["input"])
    context = fault.get("ctx", {})
    match kind:
        case "value":
            several = isinstance(fault["input"], (list, tuple)) and "is not allowed here. Allowed: a number" in str(
                context["text"]
            )
            return str(context["text"]), ONE_VALUE if several else CHECK_FILE
        case "extra_forbidden":
            names = _allowed_at(keys[:-1], data, allowed)
            around = _key_around(keys, data, allowed, prefix)
            return unknown_key(keys[-1], names, _blocks_at(keys[:-1], data, allowed), around)
        case "missing":
            return "this key is missing", _what_to_add(keys, data, allowed)
        case "union_tag_not_found":
            kinds = sorted({kind for block in _blocks_at(keys, data, allowed) for kind in _kinds_of(block)})
            others = [name for name in data.get(keys[0], ()) if name != keys[-1]] if len(keys) == 2 else []
            upper = next((key for key in fault["input"] if key.lower() == "kind"), "")
            hint = f" It has {shown(upper)}: write it in small letters." if upper else closest(keys[-1], others)
            return (
                f"{given} has no kind.{hint} Allowed: {listed(kinds)}",
                "Write kind: and one of these.",
            )
        case "union_tag_invalid":
            tag, kinds = context["tag"], context["expected_tags"].replace("'", "").split(", ")
            text = f"{shown(tag)} is not a kind of body.{closest(tag, kinds)} Allowed: {listed(kinds)}"
            return text, "Change the kind."
        case "literal_error":
            return f"{given} is not allowed here. Allowed: {context.get('expected')}", CHECK_FILE
        case "string_pattern_mismatch" if keys[-1:] in (["title"], ["source"]):
            return f"{given} holds characters that are not text", "Remove control characters."
        case "string_pattern_mismatch":
            return (
                f"{given} is not a name. Allowed: letters, digits, _ and -, beginning with a letter, at most 40",
                "Choose another name.",
            )
        case "too_short" | "too_long" if "max_length" in context and context["max_length"] == 2:
            return f"{given}; a contact is between two faces: [left, right]", CHECK_FILE
        case "too_short" | "too_long" | "string_too_long":
            limits = {"min_length": "at least", "max_length": "at most"}
            allowed_length = ", ".join(f"{word} {context[key]}" for key, word in limits.items() if key in context)
            remedy = "Add an entry." if kind == "too_short" else "Make it shorter."
            return f"{given} has the wrong length. Allowed: {allowed_length}", remedy
        case _ if kind in _NEEDED:
            return _of_wrong_type(fault, keys, _allowed_at(keys, data, allowed))
        case _:
            return f"{given}: {fault['msg'][:1].lower()}{fault['msg'][1:]}", CHECK_FILE


def _of_wrong_type(fault: ErrorDetails, keys: list[str], names: Sequence[str]) -> tuple[str, str]:
    """Return text and remedy for a value where a block with keys of some names, a list or a string is needed."""
    given, needed = shown(fault["input"]), _NEEDED[fault["type"]]
    text = f"{given} is given where {needed} is needed"
    if keys in (["bodies"], ["mechanisms"], ["methods"], ["variants"]):
        entry = "{kind: ...}" if keys == ["bodies"] else "{...}"
        return text, f"Write NAME: {entry} for each of them."
    if keys == ["snapshots"]:
        return f"{given} is not allowed here", SNAPSHOTS
    if keys[:1] == ["contacts"] and "between" in keys[2:-1]:
        return f"{given} is given where the name of a face is needed", FACE
    if keys[:-1] == ["contacts"] or keys[:-1] == ["probes"]:
        return text, ENTRIES[keys[0]]
    if isinstance(fault["input"], dict) and needed == "a list":
        return text, "Write it as one entry of a list, with a dash before it, or in Python [...] around it."
    if needed != _BLOCK or not names:
        return text, CHECK_FILE
    out = " Or leave the key out: it has a default." if keys == ["solve", "step"] else ""
    return text, f"Write {{key: value}}; its keys: {listed(sorted(set(names)))}.{out}"


def unknown_key(
    name: str, names: Sequence[str], blocks: Sequence[type[BaseModel]], around: str = ""
) -> tuple[str, str]:
    """Return text and remedy for an unknown key.

    ``names`` are the keys known; ``blocks`` are those in which it was sought. ``around`` is a sentence on its place
    outside of these.
    """
    if (colon := name.partition(":"))[1] and colon[0] in names:
        return (
            f"{shown(name)} has no space after its colon. Did you mean {colon[0]!r}?",
            f"Write {colon[0]}: {colon[2]}.",
        )
    if name == "force" and {"mass", "velocity"} <= set(names):
        return (
            "a force over time acts on an end of a rod, a beam or a shaft, not on a mass",
            "Write a short rod in place of the mass, with ends: {left: {force: ...}}; a constant force is gravity's.",
        )
    comma = " Was it a decimal comma? Write a point, as in 0.3 m." if name[:1].isdigit() else ""
    key = key_of_synonym(name)
    meant = "" if key is None else renamed(name, key, names, _key_inside(key.name, blocks))
    hint = _key_inside(name, blocks) or meant or around or closest(name, names)
    return (
        f"the key {shown(name)} is not known here.{hint}{comma}",
        f"Allowed: {listed(names)}." if names else "This block takes no parameters: remove the key.",
    )


def _yaml_path(loc: Sequence[int | str]) -> list[str]:
    """Return the path of a fault in the file.

    It is without the kind that pydantic names after a body, and its mark of a wrong key.
    """
    kinds = {"bodies": 2, "mechanisms": 2, "snapshots": 1}  # where pydantic names the kind of block that it reads
    keys = [str(step) for number, step in enumerate(loc) if number != kinds.get(str(loc[0]))]
    return [key for key in keys if key != "[key]"]


def _what_to_add(keys: list[str], data: Any, allowed: type[BaseModel]) -> str:
    """Return how a missing key is written, with its unit."""
    if keys == ["schema_version"]:
        return "Add schema_version: 1."
    if keys == ["solve"]:
        return "Add solve: {duration: ..., tolerance: 1e-3}, the length of the run [s] and the relative error allowed."
    found = (block.model_fields.get(keys[-1]) for block in _blocks_at(keys[:-1], data, allowed))
    described = next((field.description for field in found if field is not None and field.description), "")
    return f"Add {keys[-1]}: {described}." if described else "Add it; `impactlab schema` lists every key with its unit."


def _key_around(keys: list[str], data: Any, allowed: type[BaseModel], prefix: str) -> str:
    """Return a sentence on a key that stands beside a block around it, or is the name of a body or a contact."""
    name = keys[-1]
    if prefix.endswith(".law") and name in OF_CONTACT and len(keys) == 1:
        return " It is a key of the contact: write it beside 'law', not inside it."
    for number in reversed(range(len(keys) - 1)):
        if name in _allowed_at(keys[:number], data, allowed):
            return f" It stands beside {keys[number]!r}, not inside it."
    if len(keys) > 1 or not isinstance(data, Mapping):
        return ""
    contacts = data.get("contacts")
    named = [each.get("name") for each in contacts if isinstance(each, Mapping)] if isinstance(contacts, list) else []
    for kind, given in (("bodies", data.get("bodies")), ("contacts", named)):
        if isinstance(given, (Mapping, list)) and name in given:
            return f" It is one of the {kind}: write {kind}.{name}."
    bodies = data.get("bodies")
    blocks = bodies.items() if isinstance(bodies, Mapping) else ()
    owner = next((body for body, block in blocks if isinstance(block, Mapping) and name in block), "")
    return f" It is a key of a body: write bodies.{owner}.{name}." if owner else ""


def _key_inside(name: str, blocks: Sequence[type[BaseModel]]) -> str:
    """Return a sentence on the block inside these that has a key, or nothing."""
    for block in blocks:
        for key, field in block.model_fields.items():
            if not _is_of_many(field.annotation) and any(name in b.model_fields for b in _blocks_in(field.annotation)):
                return f" It stands inside {key!r}: write {key}: {{{name}: ..., ...}}."
    return ""


def _allowed_at(keys: list[str], data: Any, allowed: type[BaseModel]) -> list[str]:
    """Return the keys that may stand in the block at a path.

    Of a block whose kind is not known they are those of all kinds.
    """
    return [name for block in _blocks_at(keys, data, allowed) for name in block.model_fields]


def _blocks_at(keys: list[str], data: Any, allowed: type[BaseModel]) -> list[type[BaseModel]]:
    """Return the blocks that may stand at a path.

    They are those of the given kind where it is known; none if the path is not known.
    """
    blocks, among_many = [allowed], False  # among_many: the next key is the name or the number of one of several
    for key in keys:
        data = data[int(key)] if isinstance(data, (list, tuple)) else data[key]
        if not among_many:
            types = [block.model_fields[key].annotation for block in blocks if key in block.model_fields]
            blocks = [inside for annotation in types for inside in _blocks_in(annotation)]
            among_many = any(_is_of_many(one) for one in types)
        else:
            among_many = False
        kind = data.get("kind") if isinstance(data, dict) else None
        blocks = [block for block in blocks if kind in _kinds_of(block)] or blocks
    return blocks


def _is_of_many(annotation: Any) -> bool:
    """Return whether a type holds several blocks, by name or by number."""
    return any(get_origin(each) in (dict, tuple) for each in (annotation, *get_args(annotation)))


def _blocks_in(annotation: Any) -> list[type[BaseModel]]:
    """Return the blocks that a type names, at any depth."""
    if isinstance(annotation, type) and get_origin(annotation) is None and issubclass(annotation, BaseModel):
        return [annotation]
    return [block for inside in get_args(annotation) for block in _blocks_in(inside)]


def _kinds_of(block: type[BaseModel]) -> tuple[str, ...]:
    field = block.model_fields.get("kind")
    return () if field is None else get_args(field.annotation)


def refuse(text: str) -> PydanticCustomError:
    """Return the error of a value, with a text that is shown as it stands."""
    return PydanticCustomError("value", "{text}", {"text": text})
