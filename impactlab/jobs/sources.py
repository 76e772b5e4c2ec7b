"""Hashes of the code, of impactlab and plugins, and of the environment that numbers of a run depend on."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import impactlab
from impactlab import api, plugins
from impactlab.casefile import Case
from impactlab.errors import PluginError
from impactlab.numerics.addresses import COMPILED
from impactlab.plugins import METRICS

# Folders and files of the package without influence on the numbers of a row, and the one file of theirs that has some.
APART = ("report/", "testing/", "bench/report/", "cli/", "cite.py", "citations.bib")
SUMMARY = "report/summary.py"


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
    """Return the top modules of the plugins that a case uses.

    They are those of parts and metrics of the case and of its physics.
    """
    parts: list[Any] = []
    for method in (case.simulation().method, api.physics_of(case).method):
        parts += [*method.laws.values(), method.integrator, *method.models.values()]
    parts = [part for part in parts if part is not None]
    parts += [inner for part in parts for inner in plugins.parts_inside(part)]
    modules = {type(part).__module__.partition(".")[0] for part in parts}
    metrics = set(case.scene().metrics)
    modules |= {top(each) for each in plugins.registry().entries if each.group == METRICS.name and each.name in metrics}
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
    """Return the hash of the sources of impactlab that determine a row's numbers."""
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
