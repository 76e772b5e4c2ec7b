"""The key of a row: a hash of all that its errors depend on, and of nothing else.

That is the scene as it is run, the physics it is measured against, impactlab's sources, the plugins used, and the
numeric environment. Names, titles and comments of the case file are not in it.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import platform
from collections.abc import Iterable, Mapping
from enum import Enum
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import impactlab
from impactlab import api, plugins
from impactlab.casefile import Case
from impactlab.errors import CaseError, PluginError
from impactlab.numerics.addresses import COMPILED
from impactlab.plugins import METRICS
from impactlab.refine import reference_record
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene

# Folders and files of the package without influence on the numbers of a row, and the one file of theirs that has some.
APART = ("report/", "testing/", "bench/report/", "cli/", "cite.py", "citations.bib")
SUMMARY = "report/summary.py"


def content(value: Any) -> Any:
    """Return a frozen record as plain JSON values: dataclasses by class and fields, numbers as they are.

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
    """Return the key of the reference of a scene and its laws: a hash of the content that it depends on."""
    return digest(content(reference_record.physics_key(scene, method)))


def nameless(scene: Scene, method: Method) -> Any:
    """Return the content of a scene and its method, without the name, which is that of the file."""
    return [content(dataclasses.replace(scene, name="")), content(method)]


@cache
def numeric_environment() -> dict[str, str]:
    """Return the facts beside the sources on which errors depend: versions, processor, compiled or not."""
    return {
        "machine": platform.machine(),
        "python": platform.python_version(),
        **{name: version(name) for name in ("numpy", "scipy", "numba", "llvmlite")},
        "compiled": str(COMPILED),
    }


def plugin_modules(case: Case) -> set[str]:
    """Return the top modules of the plugins among the parts and metrics of a case and its physics."""
    parts: list[Any] = []
    for method in (case.simulation().method, api.physics_of(case).method):
        parts += [*method.laws.values(), method.integrator, *method.models.values()]
    parts = [part for part in parts if part is not None]
    parts += [inner for part in parts for inner in plugins.parts_inside(part)]
    modules = {type(part).__module__.partition(".")[0] for part in parts}
    asked = set(case.scene().metrics)
    modules |= {top(each) for each in plugins.registry().entries if each.group == METRICS.name and each.name in asked}
    return modules - {"impactlab", "builtins"}


def top(entry: plugins.Entry) -> str:
    """Return the top module of an entry point."""
    return entry.value.partition(":")[0].strip().partition(".")[0]


@cache
def tree_hash(module: str) -> str:
    """Return the hash of the sources of a top module."""
    try:
        found = __import__(module)
    except Exception as error:
        if module in map(top, plugins.registry().entries):
            return "broken"  # a metric that cannot be imported measures nothing
        raise PluginError(
            f"{module!r} cannot be imported: {error}", remedy="Install the package again, or run without its parts."
        ) from error
    file = Path(str(found.__file__))
    return sources_hash(file.parent.rglob("*.py") if file.name == "__init__.py" else [file], file.parent)


@cache
def code_hash() -> str:
    """Return the hash of those sources of impactlab that the numbers of a row come from."""
    root = Path(impactlab.__file__).parent
    names = ((path, path.relative_to(root).as_posix()) for path in root.rglob("*.py"))
    return sources_hash((path for path, name in names if name == SUMMARY or not name.startswith(APART)), root)


def code_version() -> str:
    """Return impactlab's version and the first letters of the hash of its sources."""
    return f"{version('impactlab')}+{code_hash()[:12]}"


def sources_hash(files: Iterable[Path], root: Path) -> str:
    """Return the hash of files, by path below ``root`` and bytes."""
    found = hashlib.sha256()
    for path in sorted(files):
        found.update(path.relative_to(root).as_posix().encode() + b"\0")
        found.update(hashlib.sha256(path.read_bytes()).digest())
    return found.hexdigest()
