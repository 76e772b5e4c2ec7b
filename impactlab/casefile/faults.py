"""Turns the faults that pydantic finds into one error of ours: where, what was given, what is allowed, what to do."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from impactlab.casefile.words import closest, listed, shown
from impactlab.errors import CaseError, ImpactlabError, combined

_BLOCK = "a block of keys"
_NEEDED = {
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": _BLOCK,
    "model_type": _BLOCK,
    "model_attributes_type": _BLOCK,
    "string_type": "a text",
}
_REMEDY = "Fix the value; `impactlab schema` lists every key with its unit."


def case_error(
    error: ValidationError, data: Any, prefix: str = "", allowed: Iterable[str] | type[BaseModel] = ()
) -> ImpactlabError:
    """Return the first fault as an error of the case, which holds the others; unknown keys explain missing ones.

    Parameters
    ----------
    error : pydantic.ValidationError
        What pydantic found.
    data : Any
        What was validated, as plain values.
    prefix : str
        Path of ``data`` in the case.
    allowed : names, or a pydantic model
        The keys that may stand in ``data``.
    """
    faults = sorted(error.errors(include_url=False), key=lambda fault: fault["type"] != "extra_forbidden")
    return combined([_one(fault, data, prefix, allowed) for fault in faults])


def _one(fault: ErrorDetails, data: Any, prefix: str, allowed: Iterable[str] | type[BaseModel]) -> CaseError:
    keys = _yaml_path(fault["loc"], data, fault["type"], allowed)
    path = ".".join(part for part in (prefix, *keys) if part)
    if fault["type"] == "union_tag_invalid":
        path += ".kind"
    text, remedy = _words(fault, keys, data, allowed)
    return CaseError(text, remedy=remedy, path=path)


def _words(
    fault: ErrorDetails, keys: list[str], data: Any, allowed: Iterable[str] | type[BaseModel]
) -> tuple[str, str]:
    kind = fault["type"]
    given = shown(fault["input"])
    context = fault.get("ctx", {})
    match kind:
        case "value":
            return str(context["text"]), _REMEDY
        case "extra_forbidden":
            names = _allowed_at(keys[:-1], data, allowed)
            name = keys[-1]
            return (
                f"the key {shown(name)} is not known here.{closest(name, names)}",
                f"Allowed: {listed(names)}." if names else "This block takes no parameters: remove the key.",
            )
        case "missing":
            return "this key is missing", "Add it; `impactlab schema` lists every key with its unit."
        case "union_tag_not_found":
            return f"{given} has no kind. Allowed: {_tags(context)}", "Write kind: and one of these."
        case "union_tag_invalid":
            tag = str(context.get("tag", ""))
            hint = closest(tag, _tags(context).split(", "))
            return f"{shown(tag)} is not a kind of body.{hint} Allowed: {_tags(context)}", "Change the kind."
        case "literal_error":
            return f"{given} is not allowed here. Allowed: {context.get('expected')}", _REMEDY
        case "string_pattern_mismatch" if keys[-1:] in (["title"], ["source"]):
            return f"{given} holds characters that are not text", "Remove control characters."
        case "string_pattern_mismatch":
            return (
                f"{given} is not a name. Allowed: letters, digits, _ and -, beginning with a letter, at most 40",
                "Choose another name.",
            )
        case "too_short" | "too_long" if "max_length" in context and context["max_length"] == 2:
            return f"{given}; a contact is between two faces: [left, right]", _REMEDY
        case "too_short" | "too_long" | "string_too_long":
            limits = {"min_length": "at least", "max_length": "at most"}
            allowed_length = ", ".join(f"{word} {context[key]}" for key, word in limits.items() if key in context)
            return f"{given} has the wrong length. Allowed: {allowed_length}", _REMEDY
        case _ if kind in _NEEDED:
            names = _allowed_at(keys, data, allowed) if _NEEDED[kind] == _BLOCK and allowed else []
            return (
                f"{given} stands where {_NEEDED[kind]} is needed",
                f"Write {{key: value}}; its keys: {listed(sorted(set(names)))}." if names else _REMEDY,
            )
        case _:
            return f"{given}: {fault['msg'][:1].lower()}{fault['msg'][1:]}", _REMEDY


def _tags(context: Any) -> str:
    return listed(str(context.get("expected_tags", "'mass', 'rod', 'wall'")).replace("'", "").split(", "))


def _yaml_path(
    loc: Iterable[int | str], data: Any, kind: str, allowed: Iterable[str] | type[BaseModel] = ()
) -> list[str]:
    """Leave out the tags that pydantic puts into its locations: one for each block that is read by its kind.

    A tag may be the name of a key, too (the mass of a mass): so the types are followed, not the names alone.
    """
    steps = list(loc)
    keys: list[str] = []
    annotation: Any = allowed if isinstance(allowed, type) else None
    for place, step in enumerate(steps):
        last = place == len(steps) - 1
        tagged = _by_kind(annotation)
        if step in tagged:
            annotation = tagged[str(step)]
            continue
        annotation = _inside(annotation, step)
        if _stands_in(step, data):
            data = data[step]
            keys.append(str(step))
        elif last and kind == "missing":
            keys.append(str(step))
    return keys


def _by_kind(annotation: Any) -> dict[str, type[BaseModel]]:
    """Return the blocks that may stand at one place, by their kind; none where the kind does not decide."""
    if typing.get_origin(annotation) is typing.Annotated:
        annotation = typing.get_args(annotation)[0]
    if typing.get_origin(annotation) not in (typing.Union, types.UnionType):
        return {}
    blocks = [(member, _kind_of(member)) for member in typing.get_args(annotation) if _is_block(member)]
    return {kind: block for block, kind in blocks if kind is not None}


def _inside(annotation: Any, step: int | str) -> Any:
    """Return the type of what stands under a key or a number in a value of a type; None where it is not known."""
    annotation = _only(annotation)
    arguments = typing.get_args(annotation)
    if typing.get_origin(annotation) is dict:
        return arguments[1]
    if typing.get_origin(annotation) is tuple:
        return arguments[0]
    if _is_block(annotation):
        field = annotation.model_fields.get(str(step))
        return None if field is None else field.annotation
    return None


def _stands_in(step: int | str, data: Any) -> bool:
    if isinstance(data, (list, tuple)):
        return isinstance(step, int) and step < len(data)
    return isinstance(data, dict) and step in data


def _allowed_at(keys: list[str], data: Any, allowed: Iterable[str] | type[BaseModel]) -> list[str]:
    """Return the keys that may stand in the block at a path; of a block whose kind is not known, those of all kinds."""
    if not isinstance(allowed, type):
        return list(allowed)
    annotation: Any = allowed
    for key in keys:
        step: Any = int(key) if isinstance(data, (list, tuple)) else key
        annotation, data = _inside(_of_kind(annotation, data), step), data[step]
    found = _of_kind(annotation, data)
    blocks = _by_kind(found).values() or [each for each in (_only(found),) if _is_block(each)]
    return [name for block in blocks for name in block.model_fields]


def _of_kind(annotation: Any, data: Any) -> Any:
    """Return the one block that a value of that kind is read by, where the type allows several."""
    kind = data.get("kind") if isinstance(data, dict) else None
    return _by_kind(annotation).get(kind, annotation) if isinstance(kind, str) else annotation


def _only(annotation: Any) -> Any:
    """Return the type that an optional one allows beside nothing; None where there are several."""
    if typing.get_origin(annotation) is typing.Annotated:
        annotation = typing.get_args(annotation)[0]
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        members = [member for member in typing.get_args(annotation) if member is not types.NoneType]
        return members[0] if len(members) == 1 else None
    return annotation


def _is_block(annotation: Any) -> bool:
    return isinstance(annotation, type) and typing.get_origin(annotation) is None and issubclass(annotation, BaseModel)


def _kind_of(model: type[BaseModel]) -> str | None:
    field = model.model_fields.get("kind")
    return str(typing.get_args(field.annotation)[0]) if field else None
