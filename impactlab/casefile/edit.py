"""Changes of case values by dotted path, for ``--set``, ``with_``, ``methods`` and ``variants``."""

from __future__ import annotations

import contextlib
import copy
import numbers
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from impactlab.casefile.blocks.repeat import block_of, count_of
from impactlab.casefile.build import DEFAULT_INTEGRATOR
from impactlab.casefile.document import Document, parse_value
from impactlab.casefile.keys_in_python import BodyKeys
from impactlab.casefile.schema import CHOSEN, SolveBlock
from impactlab.casefile.text.limits import MAX_DEPTH, MAX_KEY, Keys, check_texts
from impactlab.casefile.text.samples import Samples
from impactlab.casefile.text.words import listed, shown
from impactlab.casefile.values.materials import MATERIALS
from impactlab.errors import CaseError, ImpactlabError, closest

NAMED = ("methods", "variants")  # blocks of values by path
PARTS = {"respond": "law", "build": "model", "step": "integrator"}  # what a part can do, and the word for it
LISTS = ("contacts", "probes")  # whose entries have numbers


def edited(
    document: Document, path: str, value: Any, *, replace: bool, origin: Keys | None = None, by: str = "with_()"
) -> Document:
    """Return the document with one value changed.

    Blocks are merged, unless ``replace`` is set, their kind changes, they are whole ones such as `Rod` and `Contact`,
    or they hold one of several alternatives (the step, the duration, an end, the force on it); then the new block is
    taken alone.

    Parameters
    ----------
    document : Document
        The case as it is; not changed.
    path : str
        Dotted path, e.g. ``contacts.0.law.stiffness``.
    value : plain value
        The new value.
    replace : bool
        Whether a block replaces the old block instead of merging with it.
    origin : tuple of str, optional
        Where in the file the value stands; without it, it comes from outside and has no line.
    by : str
        The option or function that gives a value from outside, for messages.
    """
    keys = inside = tuple(numbered(document.data, path).split("."))
    if is_named(path) and len(keys) > 2:  # a value there has one key, which is a path itself
        inside = keys[2:]
        keys = (*keys[:2], ".".join(inside))
    if not all(inside) or len(keys) > MAX_DEPTH or len(path) > MAX_KEY or not path.isprintable():
        raise CaseError(f"{shown(path)} is not a path", remedy="Write keys with dots between, as in solve.step.dt.")
    replace = replace or isinstance(value, BodyKeys)
    value = plain(value, path)
    check_texts(value, keys)
    _refuse_one_of_many(document.data, keys, path)
    data, lines = dict(document.data), dict(document.lines)
    holder = _holder(data, keys, path)
    last = _key_in(holder, keys[-1], path)
    block: Any = holder.get(last) if isinstance(holder, dict) else holder[last]
    other_kind = isinstance(holder, dict) and keys[-1] == "kind" and block != value
    if other_kind or (isinstance(holder, dict) and keys[:-1] == ("solve", "step")):
        holder.clear()
    holder[last] = {**block, **value} if _merges(block, value, inside) and not replace else value
    _move_lines(lines, keys, origin)
    void = _replaced(keys, value)
    if void and isinstance(data.get("solve"), dict):
        data["solve"] = {key: block for key, block in data["solve"].items() if key not in void}
    given = {known: name for known, name in document.given.items() if known[: len(keys)] != keys}
    return Document(data, lines, given if origin is not None else {**given, keys: by})


def is_named(path: str) -> bool:
    """Return whether a path leads to the methods or the variants of a case."""
    return path.partition(".")[0] in NAMED


def numbered(data: Mapping[str, Any], path: str) -> str:
    """Return a path with a contact's number in place of its name.

    It is ``contacts.0.gap`` for ``contacts.cushion.gap``.

    Raises
    ------
    CaseError
        If several contacts have the name.
    """
    if not isinstance(path, str):
        raise CaseError(f"{shown(path)} is no path of a case", remedy="Give a text, such as 'bodies.hammer.mass'.")
    first, _, rest = path.partition(".")
    name, dot, inside = rest.partition(".")
    contacts = data.get(first) if first == "contacts" else None
    if not isinstance(contacts, list):
        return path
    if name.isdecimal():
        return f"{first}.{int(name)}{dot}{inside}" if len(name) < 6 else path
    found = [number for number, block in enumerate(contacts) if isinstance(block, dict) and block.get("name") == name]
    if len(found) > 1:
        places = ", ".join(f"contacts.{number}" for number in found)
        raise CaseError(
            f"{shown(name)} is the name of {len(found)} contacts", remedy=f"Name one of {places}.", path=path
        )
    return f"{first}.{found[0]}{dot}{inside}" if found else path


def _replaced(keys: Keys, value: Any) -> set[str]:
    """Return the keys of ``solve`` that a value replaces, as tolerance and description do each other."""
    if keys[0] != "solve":
        return set()
    given = {keys[1]: value} if len(keys) > 1 else value if isinstance(value, dict) else {}
    if given.get("tolerance") is not None:
        return set(CHOSEN) - set(given)
    return {"tolerance", "tolerance_on"} if set(given) & set(CHOSEN) else set()


def replaces_tolerance(path: str, value: Any) -> bool:
    """Return whether a setting takes the place of a tolerance: model, integrator, step ..."""
    return "tolerance" in _replaced(tuple(path.split(".")), value)


def plain(value: Any, path: str = "") -> Any:
    """Return a value given in Python as the plain value a file would hold."""
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, numbers.Integral):
        return int(value)
    if isinstance(value, numbers.Real):
        return float(value)
    if isinstance(value, Mapping):
        return {str(key): plain(inner, f"{path}.{key}" if path else str(key)) for key, inner in value.items()}
    if isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "iuf":
        return Samples(value.tolist())
    if isinstance(value, Samples):
        return value
    if isinstance(value, (list, tuple)):
        return [plain(inner, f"{path}.{number}") for number, inner in enumerate(value)]
    words = (word for has, word in PARTS.items() if hasattr(value, "citations") and hasattr(value, has))
    if part := next(words, ""):
        name = getattr(value, "__name__", type(value).__name__)
        raise CaseError(
            f"the {part} {name} is given as an object. Allowed in a case: its block, {{kind: NAME, ...}}",
            remedy=f"Write another {part} in the case, and run il.run(case.simulation().but({part}={name}(...))); "
            "or register its name by an entry point (docs/how-to-write-a-plugin.md).",
            path=path,
        )
    raise CaseError(
        f"a value of type {type(value).__name__!r}. Allowed: numbers, strings, true, false, lists and mappings of "
        "these",
        remedy="Write a formula as text, such as '1e5*sin(2*pi*t/1e-3)' of a force over time."
        if callable(value) and not isinstance(value, type)
        else "Give a value that a case file could hold.",
        path=path,
    )


def _refuse_one_of_many(data: Mapping[str, Any], keys: Keys, path: str) -> None:
    """Raise `CaseError` for the path of one of many made bodies.

    A body that a block makes has no path of its own.
    """
    bodies = data.get("bodies")
    if keys[0] != "bodies" or len(keys) < 3 or not isinstance(bodies, dict):
        return
    block, inside = bodies.get(keys[1]), keys[2:]
    if isinstance(block, dict):
        if "repeat" not in block or not keys[2].isdecimal():
            return
        found, inside = (keys[1], count_of(block["repeat"], f"bodies.{keys[1]}.repeat")), keys[3:]
    elif (made := block_of(bodies, keys[1])) is not None:
        found = made
    else:
        return
    name, count = found
    key = ".".join(inside) or "KEY"
    raise CaseError(
        f"the {count} bodies made from the block bodies.{name} have no paths of their own",
        remedy=f"Give the {count} values: bodies.{name}.{key}={{each: [...]}}, or a formula of their number i.",
        path=path,
    )


def refuse_unknown_body(data: Mapping[str, Any], path: str) -> None:
    """Raise `CaseError` where a path leads to an unknown body."""
    keys, bodies = path.split("."), data.get("bodies")
    if keys[0] != "bodies" or len(keys) < 3 or not isinstance(bodies, dict) or keys[1] in bodies:
        return
    if block_of(bodies, keys[1]) is None:
        names = [str(name) for name in bodies]
        text = f"the case has no body {shown(keys[1])}.{closest(keys[1], names)}"
        raise CaseError(text, remedy=f"Bodies of this case: {listed(names)}.", path=path)


def _holder(data: Any, keys: Keys, path: str) -> Any:
    """Return the block that holds the last key, copied with those above it."""
    holder = data
    for place, key in enumerate(keys[:-1]):
        found = _key_in(holder, key, path)
        if isinstance(holder, dict) and not isinstance(holder.get(found), (dict, list)):
            if place == 0 and key in LISTS:
                raise CaseError(
                    f"the case has no {key}", remedy=f"Add an entry of {key}, or remove this value.", path=path
                )
            holder[found] = _default_block(keys[: place + 1], holder) or _constants(data, keys, holder.get(found))
        elif isinstance(holder[found], (dict, list)):
            holder[found] = copy.copy(holder[found])
        holder = holder[found]
    return holder


def _key_in(holder: Any, key: str, path: str) -> Any:
    if isinstance(holder, dict):
        return key
    if isinstance(holder, list):
        if key.isdecimal() and len(key) < 6 and int(key) < len(holder):
            return int(key)
        allowed = f"Allowed: 0 to {len(holder) - 1}" if holder else "Allowed: none, the list is empty"
        allowed = "Allowed: 0, the only one" if len(holder) == 1 else allowed
        names = [str(each["name"]) for each in holder if isinstance(each, dict) and each.get("name")]
        allowed += f", or a name: {listed(names)}" if names else ""
        text = f"{shown(key)} is not an entry of this list.{closest(key, names)} {allowed}"
        many = any(isinstance(each, dict) and ("repeat" in each or "chain" in each) for each in holder)
        one = " One that makes many is one entry: give KEY={each: [...]} in it, or a formula of their number i."
        raise CaseError(text, remedy=f"Entries are counted from 0.{one if many else ''}", path=path)
    raise CaseError(f"{shown(key)} cannot be set inside {shown(holder)}", remedy="Check the path.", path=path)


def _default_block(keys: Keys, holder: dict[str, Any]) -> dict[str, Any]:
    """Return the block of a part that the case leaves out or only names.

    One field of it can then be set alone.
    """
    if "kind" in holder and keys[0] == "solve" and isinstance(holder.get(keys[-1]), str):
        return {"kind": holder[keys[-1]]}
    if keys == ("solve", "model"):
        return dict(SolveBlock.model_fields["model"].default)
    if keys == ("solve", "integrator"):
        return dict(DEFAULT_INTEGRATOR)
    return {}


def _constants(data: Mapping[str, Any], keys: Keys, name: Any) -> dict[str, Any]:
    """Return the constants of a named material of which one is set, else nothing."""
    if "material" not in keys or name not in MATERIALS:
        return {}
    bodies = data.get("bodies")
    body = bodies.get(keys[1]) if isinstance(bodies, dict) and keys[0] == "bodies" else None
    kind, of, density = body.get("kind") if isinstance(body, dict) else "", MATERIALS[name], MATERIALS[name].density
    if keys[-1] == "shear_modulus":  # in place of Poisson's ratio, and of a shaft in place of both
        return {"density": density} if kind == "shaft" else {"young": of.young, "density": density}
    poisson = {"poisson": of.poisson} if kind in ("beam", "shaft") else {}
    return {"young": of.young, "density": density, **poisson}


def _merges(block: Any, value: Any, keys: Keys) -> bool:
    if not isinstance(block, dict) or not isinstance(value, dict):
        return False
    if keys in (("solve", "step"), ("solve", "duration")) or "ends" in (keys[-2:-1] + keys[-3:-2]):
        return False
    return "kind" not in value or value["kind"] == block.get("kind")


def _move_lines(lines: dict[Keys, int | None], keys: Keys, origin: Keys | None) -> None:
    for known in [known for known in lines if known[: len(keys)] == keys]:
        del lines[known]
    lines[keys] = None if origin is None else lines.get(origin)
    if origin is not None:
        for known in [known for known in lines if known[: len(origin)] == origin]:
            lines[keys + known[len(origin) :]] = lines[known]


def check_name(kind: str, name: str, known: Iterable[str], file: str = "") -> None:
    """Raise `CaseError` unless a method or variant (``kind``) has the name, or it is ``base``."""
    names = list(dict.fromkeys(("base", *known)))
    if name not in names:
        raise CaseError(
            f"the case has no {kind} {shown(name)}.{closest(str(name), names)}",
            remedy=f"{kind.capitalize()}s of this case: {', '.join(names)}.",
            file=file,
        )


def with_named(document: Document, block: str, name: str, known: Mapping[str, Mapping[str, Any]]) -> Document:
    """Return the document with one of its ``methods`` or ``variants`` applied.

    Raises
    ------
    CaseError
        If the case has none of that name, or it changes a key that it may not.
    """
    check_name(block[:-1], name, known)
    return with_values(document, block, name, known[name])


def with_values(document: Document, block: str, name: str, values: Mapping[str, Any]) -> Document:
    """Return the document with values applied as by a method or variant."""
    for path, value in values.items():
        if is_named(path) or path.partition(".")[0] == "schema_version":
            raise CaseError(f"a {block[:-1]} cannot change {shown(path)}", remedy="Remove it.", path=f"{block}.{name}")
        document = edited(document, path, value, replace=True, origin=(block, name, path))
    return document


def with_set(document: Document, settings: Iterable[tuple[str, Any]], by: str, file: str) -> Document:
    """Return the document with values set from outside, in order.

    ``by`` is the option or function that gave them. A value inside a body that is neither there nor made is refused.
    """
    settings = [*settings]
    made = {path.removesuffix(".kind") for path, _ in settings if isinstance(path, str)}
    for path, value in settings:
        try:
            if isinstance(path, str) and ".".join(path.split(".")[:2]) not in made:
                refuse_unknown_body(document.data, path)
            document = edited(document, path, value, replace=False, by=by)
        except ImpactlabError as error:
            error.given_by = by
            error.located(file, None)
            raise
    return document


def in_order(settings: Iterable[tuple[str, Any]], data: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Return the settings of a command in an order that keeps each.

    A setting is (path, value). None may make another void. A kind comes before its neighbours, and a block before its
    values: each of them may replace the whole block. Others keep their order. ``data`` is the case, for the names of
    contacts.
    """
    ordered: list[tuple[Keys, tuple[str, Any]]] = []
    for path, value in settings:
        with contextlib.suppress(CaseError):  # a name of several contacts is refused where its value is set
            path = numbered(data, path)
        keys = tuple(path.split("."))
        block = keys[:-1] if keys[-1] == "kind" else keys
        inside = (
            place
            for place, (other, _) in enumerate(ordered)
            if len(other) > len(block) and other[: len(block)] == block and other != keys
        )
        ordered.insert(next(inside, len(ordered)), (keys, (path, value)))
    return [setting for _, setting in ordered]


def read_setting(text: str, file: str = "") -> tuple[str, Any]:
    """Return path and value of a setting ``PATH=VALUE``.

    The value is YAML; the case is that in a file.
    """
    path, equals, value = text.partition("=")
    if not equals or not path.strip() or not path.isprintable():
        raise CaseError(f"--set {shown(text)} is not PATH=VALUE", remedy="Write it as --set solve.step.dt=1e-7.")
    try:
        return path.strip(), parse_value(value.strip())
    except CaseError as error:
        error.path, error.line, error.given_by = path.strip(), None, "--set"
        error.located(file, None)
        if value.strip().startswith("{") and "}" in value and "not YAML" in error.text:
            error.remedy = f"Quote a formula in braces: --set '{path.strip()}=\"{{1e-6*i}} m\"'."
        raise
