"""The key of a row: a hash of all that its errors need.

That is the scene as it is run, the physics it is measured against, impactlab's sources, the plugins used, and the
numeric environment. Names, titles and comments of the case file are not in it.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from enum import Enum
from typing import Any

import numpy as np

from impactlab import api
from impactlab.casefile import Case
from impactlab.errors import CaseError
from impactlab.jobs.sources import code_hash, numeric_environment, plugin_modules, tree_hash
from impactlab.refine.references import reference_record
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene


def content(value: Any) -> Any:
    """Return a frozen record as plain JSON values.

    Dataclasses have class and fields, numbers are as they are.

    Raises
    ------
    CaseError
        If it holds something whose content is not known, such as a function.
    """
    match value:
        case None | bool() | int() | str():
            return value
        case float() | np.floating():
            return repr(float(value))  # NaN and infinity have no JSON; repr keeps every bit
        case Enum():
            return value.name
        case np.ndarray():
            return [content(item) for item in value.tolist()]
        case np.integer():
            return int(value)
        case Mapping():
            return [[str(key), content(inner)] for key, inner in value.items()]
        case tuple() | list():
            return [content(item) for item in value]
        case frozenset() | set():
            return sorted(json.dumps(content(item)) for item in value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        named = {field.name: content(getattr(value, field.name)) for field in dataclasses.fields(value)}
        return {"class": f"{type(value).__module__}.{type(value).__qualname__}", **named}
    raise CaseError(
        f"a value of type {type(value).__name__!r} cannot be a part of a key",
        remedy="Describe it by a formula or a table, or by a frozen dataclass.",
    )


def digest(value: Any) -> str:
    """Return the sha256 of plain JSON values, in hex."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def row_key(case: Case) -> str:
    """Return the key of the row of a case whose method is in place."""
    plugins_used = {name: tree_hash(name) for name in sorted(plugin_modules(case))}
    facts = {"run": nameless(*case.simulation()), "physics": nameless(*api.physics_of(case)), "plugins": plugins_used}
    return _key(facts)


def refused_key(case: Case, values: Mapping[str, Any]) -> str:
    """Return the key of a row whose method the case refuses before there is a scene."""
    return _key({"refused": nameless(*case.simulation()), "values": content(values)})


def _key(facts: Mapping[str, Any]) -> str:
    return digest({**facts, "code": code_hash(), "environment": numeric_environment()})


def reference_key(scene: Scene, method: Method) -> str:
    """Return the key of the reference of a scene and its laws.

    It is a hash of the content that it depends on.
    """
    return digest(content(reference_record.physics_key(scene, method)))


def nameless(scene: Scene, method: Method) -> Any:
    """Return the content of a scene and its method, without the name of the file."""
    return [content(dataclasses.replace(scene, name="")), content(method)]
