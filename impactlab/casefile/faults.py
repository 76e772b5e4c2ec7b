"""Turns what pydantic found into one error of ours: where, what was given, what is allowed, what to do."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from impactlab.casefile.words import closest, listed, shown
from impactlab.errors import CaseError

_BLOCK = "a block of keys"
_NEEDED = {
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": _BLOCK,
    "model_type": _BLOCK,
    "model_attributes_type": _BLOCK,
    "string_type": "a text",
}
_REMEDY = "Mend the value; `impactlab schema` lists every key with its unit."


def case_error(
    error: ValidationError, data: Any, prefix: str = "", allowed: Iterable[str] | type[BaseModel] = ()
) -> CaseError:
    """Return the first fault as an error of the case; unknown keys come first, for they explain missing ones.

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
    fault = faults[0]
    keys = _yaml_path(fault["loc"], data, fault["type"])
    if fault["type"] == "union_tag_invalid":
        keys.append("kind")
    path = ".".join(part for part in (prefix, *keys) if part)
    text, remedy = _words(fault, keys, data, allowed)
    more = len(faults) - 1
    if more:
        remedy += f" ({more} more fault{'s' if more > 1 else ''} after this one.)"
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


def _yaml_path(loc: Iterable[int | str], data: Any, kind: str) -> list[str]:
    """Leave out the tags that pydantic puts into its locations."""
    steps = list(loc)
    keys: list[str] = []
    for place, step in enumerate(steps):
        last = place == len(steps) - 1
        if _stands_in(step, data):
            data = data[step]
            keys.append(str(step))
        elif last and kind == "missing":
            keys.append(str(step))
    return keys


def _stands_in(step: int | str, data: Any) -> bool:
    if isinstance(data, (list, tuple)):
        return isinstance(step, int) and step < len(data)
    return isinstance(data, dict) and step in data


def _allowed_at(keys: list[str], data: Any, allowed: Iterable[str] | type[BaseModel]) -> list[str]:
    if not isinstance(allowed, type):
        return list(allowed)
    models: list[type[BaseModel]] = [allowed]
    for key in keys:
        fields = [model.model_fields[key].annotation for model in _of_kind(models, data) if key in model.model_fields]
        if fields:
            models = [model for field in fields for model in _models_in(field)]
        data = data[int(key)] if isinstance(data, (list, tuple)) else data[key]
    return [name for model in _of_kind(models, data) for name in model.model_fields]


def _of_kind(models: list[type[BaseModel]], data: Any) -> list[type[BaseModel]]:
    """Return those models that a block of that kind is read by."""
    kind = data.get("kind") if isinstance(data, dict) else None
    return [model for model in models if _kind_of(model) in (None, kind)] or models


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return [annotation] if issubclass(annotation, BaseModel) else []
    return [model for inner in typing.get_args(annotation) for model in _models_in(inner)]


def _kind_of(model: type[BaseModel]) -> str | None:
    field = model.model_fields.get("kind")
    return str(typing.get_args(field.annotation)[0]) if field else None
