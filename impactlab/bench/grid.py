"""The grid, a YAML file: families of methods, each with levels from coarse to fine."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from impactlab.casefile import Case
from impactlab.casefile.document import Document, Kind, read_document
from impactlab.casefile.text.words import listed, shown
from impactlab.errors import CaseError, closest
from impactlab.scene.method import Method, laws_of
from impactlab.scene.problem import Scene

BUILT_IN = Path(__file__).with_name("grid.yaml")

EXTENDED = "builtin"  # value of `extends`: the families of the common grid come first
GRID = Kind("a grid has the keys schema_version and families", "Write families: {NAME: {...}}.")
PARTS = ("law", "model", "integrator", "step")  # blocks that a family may give
SCENES = ("any", "without_steps", "with_steps", "beams", "mechanisms")
KEYS = ("for", *PARTS, "events", "settings", "scenes", "sibling_of", "levels")


@dataclass(frozen=True)
class Family:
    """A method with a ladder of settings.

    Its law takes the place of the laws that only stand for hard contact (``law.hard``). A contact whose law is physics,
    a spring in N/m or a Hertzian face, keeps it: errors are measured against the physics of the case as written.
    """

    name: str
    purpose: str
    law: Mapping[str, Any] | None = None
    model: Mapping[str, Any] | None = None
    integrator: Mapping[str, Any] | None = None
    step: Mapping[str, Any] | None = None
    events: str | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)  # dotted path in the case -> value
    scenes: str = "any"  # without_steps: solved from event to event; with_steps: others; beams, mechanisms: with one
    sibling_of: str | None = None  # the family that differs by its special step c dt = h alone
    levels: tuple[Mapping[str, Any], ...] = ({},)  # path -> value each, coarse to fine
    own: bool = False  # a method of the case itself: nothing but its settings

    def serves(self, scene: Scene, method: Method) -> bool:
        """Return whether the family applies to a scene.

        To a mechanism no family applies whose model is not modal: links are described by modes of a mesh alone.
        """
        if any(body.changes for body in scene.bodies.values()):
            modal = self.model is None or self.model.get("kind") == "modal"
            return modal and self.scenes in ("any", "mechanisms")
        if self.scenes == "mechanisms":
            return False
        bent = any(body.bends for body in scene.bodies.values())
        if self.scenes in ("any", "beams"):
            return bent or self.scenes == "any"
        without = not bent and all(law.hard or law.is_spring for law in method.laws.values())
        return without == (self.scenes == "without_steps")

    def values(self, scene: Scene, method: Method, level: Mapping[str, Any]) -> dict[str, Any]:
        """Return the method of a level for a scene, path to value as under ``methods``."""
        if self.own:
            return dict(self.settings)
        blocks = {part: copy.deepcopy(getattr(self, part)) for part in PARTS}
        settings = dict(self.settings)
        for path, value in level.items():
            part, _, rest = path.partition(".")
            if part in PARTS and rest:
                blocks[part] = _put(dict(blocks[part] or {}), rest, value)
            else:
                settings[path] = value
        made: dict[str, Any] = {}
        if blocks["law"] is not None:
            hard = [number for number, law in enumerate(laws_of(scene, method)) if law.hard]
            made |= {f"contacts.{number}.law": blocks["law"] for number in hard}
        if blocks["model"] is not None:
            made |= {"solve.models": {}, "solve.model": blocks["model"], "solve.integrator": None}
        made |= {f"solve.{part}": blocks[part] for part in ("integrator", "step") if blocks[part] is not None}
        if self.events is not None or blocks["model"] is not None:
            made["solve.events"] = self.events or "dated"
        return made | settings


def _put(block: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    key, _, rest = path.partition(".")
    inner = block.get(key)
    return block | {key: _put(dict(inner) if isinstance(inner, dict) else {}, rest, value) if rest else value}


def own_families(case: Case) -> tuple[Family, ...]:
    """Return the methods of a case as families ``own.NAME`` of one level, and ``own.base``."""
    methods = {"base": {}, **case.checked.methods}
    return tuple(Family(f"own.{name}", f"its method {name}", settings=methods[name], own=True) for name in methods)


def of_suite(suite: str) -> Path:
    """Return the grid file of a suite: its own, such as hard.yaml, or the common one."""
    path = BUILT_IN.parent / f"{suite}.yaml"
    return path if suite.isidentifier() and path.is_file() else BUILT_IN


def read_grid(path: Path) -> tuple[Family, ...]:
    """Return the families of a grid file, in its order.

    Raises
    ------
    CaseError
        If the file, a key or a level is wrong; it carries file and line.
    """
    if not path.exists():
        raise CaseError("the grid file does not exist", remedy="Give the path of a grid.", file=str(path))
    document = read_document(path, GRID)
    try:
        return _families(document.data)
    except CaseError as error:
        error.located(str(path), _line(document, error.path))
        raise


def chosen(families: Sequence[Family], methods: Sequence[str] | None) -> tuple[Family, ...]:
    """Return the families of the given names; all by default.

    ``own`` and ``own.NAME`` are left to cases.
    """
    if methods is None:
        return tuple(families)
    known = {family.name: family for family in families}
    for name in methods:
        if name not in known and name.partition(".")[0] != "own":
            names = [*known, "own"]
            raise CaseError(
                f"the grid has no method {shown(name)}.{closest(name, names)}",
                remedy=f"Allowed: {listed(names)}; own.NAME is method NAME of the cases.",
            )
    return tuple(known[name] for name in known if name in methods)


def _line(document: Document, path: str) -> int | None:
    """Return the line of a path, or of the block around it.

    Names of families and keys of levels may hold dots.
    """
    around = {
        ".".join(keys): line for keys, line in document.lines.items() if f"{path}.".startswith(".".join(keys) + ".")
    }
    return around[max(around, key=len)] if around else None


def _need(kept: bool, text: str, remedy: str, path: str) -> None:
    if not kept:
        raise CaseError(text, remedy=remedy, path=path)


def _families(data: Mapping[str, Any]) -> tuple[Family, ...]:
    _check_keys(data, ("schema_version", "extends", "families"), "")
    _need(data.get("schema_version") == 1, "a grid needs schema_version: 1", "Write it at the top.", "schema_version")
    families = data.get("families")
    _need(
        isinstance(families, dict) and bool(families),
        "a grid needs families: {NAME: {...}}",
        "Give at least one family.",
        "families",
    )
    extends = data.get("extends")
    words = f"{shown(extends)} is not a grid that can be extended"
    _need(extends in (None, EXTENDED), words, f"Write extends: {EXTENDED}, or leave it out.", "extends")
    common = {family.name: family for family in (read_grid(BUILT_IN) if extends else ())}
    own = {str(name): _family(str(name), block) for name, block in (families or {}).items()}
    made = tuple((common | own).values())
    names = [family.name for family in made]
    for family in made:
        _need(
            family.sibling_of is None or family.sibling_of in names,
            f"{shown(family.sibling_of)} is not a family of this grid.{closest(str(family.sibling_of), names)}",
            "Name the family that has the special step.",
            f"families.{family.name}.sibling_of",
        )
    return made


def _family(name: str, block: Any) -> Family:
    path = f"families.{name}"
    _need(isinstance(block, dict), f"{shown(block)} is not a block of keys", "Write {key: value, ...}.", path)
    _check_keys(block, KEYS, path)
    reserved = name.partition(".")[0] == "own" or "," in name
    _need(not reserved, f"{shown(name)} is reserved for the methods of cases", "Give the family another name.", path)
    for part in (*PARTS, "settings"):
        value = block.get(part)
        words = f"{shown(value)} is not a block of keys"
        _need(value is None or isinstance(value, dict), words, "Write {...}.", f"{path}.{part}")
    scenes = block.get("scenes", "any")
    words = f"{shown(scenes)} is not a choice of scenes"
    _need(scenes in SCENES, words, f"Allowed: {listed(SCENES)}.", f"{path}.scenes")
    given = {key: block.get(key) for key in (*PARTS, "events", "sibling_of")}
    levels = _levels(block.get("levels") or {}, f"{path}.levels")
    settings = block.get("settings") or {}
    return Family(name, str(block.get("for", "")), **given, settings=settings, scenes=scenes, levels=levels)


def _levels(block: Any, path: str) -> tuple[Mapping[str, Any], ...]:
    """Return the levels of lists of values: all first values, all second ones, and so on."""
    _need(isinstance(block, dict), f"{shown(block)} is not a ladder of levels", "Write {path: [value, value]}.", path)
    for key, values in block.items():
        kept = isinstance(values, list) and bool(values)
        _need(kept, f"{shown(values)} is not a list of values", "Write [a, b].", f"{path}.{key}")
    counts = ", ".join(f"{key} {len(values)}" for key, values in block.items())
    same = len({len(values) for values in block.values()}) <= 1
    _need(same, f"lists of different lengths: {counts}", "Give as many values of each; they go together.", path)
    levels = zip(*block.values(), strict=True)
    return tuple(dict(zip(block, values, strict=True)) for values in levels) if block else ({},)


def _check_keys(block: Mapping[str, Any], allowed: Sequence[str], path: str) -> None:
    for key in block:
        text = f"unknown key {shown(key)}.{closest(str(key), allowed)}"
        _need(key in allowed, text, f"Allowed: {listed(allowed)}.", f"{path}.{key}".strip("."))
