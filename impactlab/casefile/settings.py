"""A case file with values given by ``--set``, put in place before it is checked."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from impactlab.casefile.case import Case, case_of
from impactlab.casefile.document import Document, read_document
from impactlab.casefile.edit import in_order, is_named, with_named, with_set
from impactlab.casefile.places import placed
from impactlab.errors import ImpactlabError
from impactlab.scene.method import Method
from impactlab.startup.wall_time import spent_on

Setting = tuple[str, Any]
OPTION = "--set"  # that gives the values, for messages


def load_with_settings(
    file: Path, settings: Sequence[Setting], *, variant: str = "base", method: str = "base"
) -> tuple[Case, Any]:
    """Return the case in a file with settings, and its earlier tolerance.

    Its variant and method are chosen; the tolerance is that before the settings.

    Parameters
    ----------
    file : Path
        The case file.
    settings : sequence of (path, value)
        Dotted paths and their values, in any order. Those of a method or variant are set before it is chosen.
    variant, method : str
        Names of a variant and a method of the case; ``base`` is the case as written.

    Raises
    ------
    CaseError, PairingError, PluginError
        As `load_case`; not for values of the file that a setting replaces.
    """
    name, path = file.stem, str(file)
    with spent_on("reading"):
        document = read_document(file)
    of_named = [each for each in settings if is_named(each[0])]
    settings = [each for each in settings if each not in of_named]
    document = with_set(document, in_order(of_named, document.data), OPTION, path)
    named = {"variants": variant, "methods": method}
    for block, chosen in named.items():
        held = document.data.get(block, {})
        blocks = isinstance(held, Mapping) and all(isinstance(values, Mapping) for values in held.values())
        if chosen != "base" and not blocks:
            case_of(name, path, document)  # raises: the names of a faulty block cannot be known
    scene = _named(path, document, "variants", variant)
    solved = _named(path, scene, "methods", method)
    case = case_of(
        name,
        path,
        with_set(solved, in_order(settings, solved.data), OPTION, path),
        method=method,
        variant=variant,
        written=None if method == "base" else _written(name, path, scene, settings),
    )
    solve = solved.data.get("solve")
    return case, solve.get("tolerance") if isinstance(solve, dict) else None


def _named(path: str, document: Document, block: str, name: str) -> Document:
    if name == "base":
        return document
    try:
        return with_named(document, block, name, document.data.get(block, {}))
    except ImpactlabError as error:
        placed(error, path, document)
        raise


def _written(name: str, path: str, scene: Document, settings: Sequence[Setting]) -> Method | None:
    """Return the method of the case as written.

    It has the settings where they replace a fault of it; None if neither is valid.
    """
    for change in ((), settings):
        with contextlib.suppress(ImpactlabError):
            return case_of(name, path, with_set(scene, in_order(change, scene.data), OPTION, path)).built.method
    return None
