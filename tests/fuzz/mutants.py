"""Mutants of the case files: each a case with a few keys or values changed, made from a seed and a number alone.

Keys are deleted, renamed and doubled, values retyped, scaled and taken to extremes, containers swapped, and parts of
other cases put in. A mutant is a text (JSON, or the YAML of a case with characters changed), plain data, or settings as
``--set`` takes them: the three ways by which a case comes in.
"""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from tests.support import CASES

NUMBERS: tuple[Any, ...] = (
    *(0, -1, 1, 2, 3, 0.5, -0.5, 0.1, 0.0, -0.0, 1e-12, 1e12, 1e-6, 1e6, -1e6),
    *(1e300, -1e300, 1e-300, 5e-324, 1.7e308, 1e154, 1e-154, 1e30, 1e-30, 1e100, 1e-100, 1e16, 1e-16),
    *(float("nan"), float("inf"), float("-inf")),
    *(10**6, 10**7, 10**9, 10**18, 2**31, 2**63, 10**400, -(10**30), 100, 1000, 2000, 10_000, 100_000, 500_000),
)
TEXTS: tuple[Any, ...] = (
    *("", " ", "x", "1", "1e300", "nan", "inf", "-inf", "1 m", "1 kg", "1 s", "1 us", "210 GPa", "1e300 m", "1e-300 s"),
    *("30 cm", "1,5 m", "1 furlong", "m", "1 m m m", "9**9**9", "1 GPa^9", "5 degC", "1 µm", "1 N/m", "1 kg/m^3"),
    *("x", "1e-5*x", "1e300*x", "1/x", "sqrt(x-L)", "exp(x*1e9)", "1e-5*cos(pi*x/L)", "x**20", "__import__('os')"),
    *("x" * 500, "(" * 60 + "x" + ")" * 60, "1e-6*x*(L-x)", "\ud800", "a\udfffb", "\x00", "\x1b[2J", "\n", "\u202e"),
    *("free", "clamped", "pinned", "infinite", "left", "hammer", "rod.left", "rod.right", "rod.at(0.1)"),
    *("rod.at(1e300)", "rod.at(nan)", "wall", "mass", "spring", "dated", "located", "allowed", "null", "true"),
    *("é", "日本", "a" * 130),
)
KINDS = (
    *("rod", "beam", "mass", "wall", "finite_element", "modal", "continuous", "newmark", "central_difference"),
    *("exact_modal", "bathe", "midpoint", "moreau_jean", "hht_alpha", "generalised_alpha", "adaptive", "theta"),
    *("nonsmooth_generalised_alpha", "contact_stabilised_newmark", "penalty", "hertz", "hunt_crossley", "nitsche"),
    *("addition_deletion", "augmented_lagrangian", "energy_conserving", "impulse_momentum", "khulief_shabana"),
    *("velocity_complementarity", "wave_identification", "wave_initialised", "paoli_schatzman", "modal_messengers"),
    *("impedance_residual", "dispersive_identification", "craig_bampton", "ritz", "macneal", "eigenvectors"),
    *("striker_attached", "lankarani_nikravesh", "substructured"),
)
BLOCKS: tuple[Any, ...] = (
    *([], {}, [[]], [None], {"kind": None}, {"kind": "rod"}, {"relative": 1.0}, {"relative": 1e300}),
    *({"round_trips": 1}, {"round_trips": 1e300}, {"round_trips": 1e-300}),
    *({"spring": 1e9}, {"spring": 1e300}, {"dashpot": 1e-300}),
    *({"mass": 1e-300}, {"mass": 1e300, "force": 1e300}, {"force": 1.0}, {"dt": 1e-300}, {"dt": 5e-324}),
    *({"courant": 1e-300}, {"courant": 1e300}, {"points_per_period": 1e300}, {"points_per_period": 1e-300}),
    *({"x": [0, 1], "u": [0, 1e300]}, {"x": [0.0, 0.3], "u": [0.0, 1e-5]}, {"spring": 1.0, "rotational": 1e300}),
)
EXTRA: dict[str, tuple[Any, ...]] = {
    "solve": ("tolerance", "records", "events", "step", "model", "integrator", "round_trips_of"),
    "rod": ("ends", "damping", "displacement", "velocity", "segments"),
    "beam": ("ends", "damping", "displacement", "tension", "theory"),
    "modal": ("elements", "modes", "mass", "basis", "order"),
    "finite_element": ("elements", "mass", "order"),
    "material": ("viscosity",),
    "top": ("gravity", "snapshots", "probes"),
}

Path_ = tuple[Any, ...]


class Mutant(NamedTuple):
    """A case as it comes in."""

    name: str  # of the case that it was made from
    way: str  # data, json, yaml or set
    given: Any  # plain data, a text, or a list of texts PATH=VALUE for the case as it is


@cache
def files() -> tuple[Path, ...]:
    """Return the case files that mutants are made from."""
    return (*sorted(CASES.glob("*.yaml")), *sorted(CASES.glob("hard/*.yaml")))


@cache
def originals() -> dict[str, Any]:
    """Return the plain data of every case, by name."""
    from impactlab.casefile.document import read_document

    return {file.stem: read_document(file).data for file in files()}


@cache
def grafts() -> dict[str, list[Any]]:
    """Return everything that stands under a key in any case, by key; what methods put in place under its last key."""
    found: dict[str, list[Any]] = {}
    for data in originals().values():
        for path, value in nodes(data):
            key = str(path[-1]).rpartition(".")[2] if path else "top"
            found.setdefault(key, []).append(value)
    return found


def nodes(data: Any, path: Path_ = ()) -> Iterator[tuple[Path_, Any]]:
    """Give every node of plain data with its path, the top first."""
    yield path, data
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield from nodes(value, (*path, key))


def mutant(seed: int, number: int) -> Mutant:
    """Return mutant ``number`` of a seed."""
    chance = random.Random(f"{seed}/{number}")
    name = chance.choice(sorted(originals()))
    kind = chance.random()
    if kind < 0.04:
        text = next(file for file in files() if file.stem == name).read_text(encoding="utf-8")
        return Mutant(name, "yaml", _scratched(text, chance))
    if kind < 0.16:
        return Mutant(name, "set", [_setting(originals()[name], chance) for _ in range(chance.choice((1, 1, 2, 3)))])
    data = copy.deepcopy(originals()[name])
    if len(data.get("methods") or {}) > 3 and chance.random() < 0.8:  # the scene itself, more often
        data["methods"] = dict(chance.sample(sorted(data["methods"].items(), key=str), 3))
    if kind > 0.6:
        data = _of_another_scale(data, chance)
    else:
        for _ in range(chance.choice((1, 1, 1, 2, 2, 3, 5))):
            data = _changed(data, chance)
    if kind < 0.28:
        return Mutant(name, "json", _doubled(_as_json(data), chance))
    return Mutant(name, "data", data)


def _as_json(data: Any) -> str:
    try:
        return json.dumps(data)
    except (TypeError, ValueError):
        return json.dumps(data, default=str, skipkeys=True)


def _doubled(text: str, chance: random.Random) -> str:
    """Return a JSON text in which, sometimes, a key stands twice or a piece is missing."""
    draw = chance.random()
    if draw < 0.2:
        place = text.find('"', chance.randrange(len(text)))
        return text[:place] + '"solve": 1, ' + text[place:]
    if draw < 0.3:
        return text[: chance.randrange(len(text))]
    return text


def _scratched(text: str, chance: random.Random) -> str:
    """Return a text with a few characters changed, and sometimes a line twice."""
    for _ in range(chance.choice((1, 2, 5))):
        place = chance.randrange(len(text))
        new = chance.choice(("", " ", "\n", ":", "{", "]", "- ", "&a ", "*a", "!x ", "\t", "\x00", "e", "9", "'", "#"))
        text = text[:place] + new + text[place + chance.choice((0, 1, 1, 3)) :]
    if chance.random() < 0.3:
        lines = text.splitlines(keepends=True)
        lines.insert(chance.randrange(len(lines)), chance.choice(lines))
        text = "".join(lines)
    return text


def _setting(data: Any, chance: random.Random) -> str:
    """Return a setting PATH=VALUE, its path of the case (a key of it misspelt, sometimes), its value anything."""
    paths = [path for path, _ in nodes(data) if path and path[0] not in ("methods", "variants")]
    path = list(chance.choice(paths))
    draw = chance.random()
    if draw < 0.2:
        path[-1] = _misspelt(str(path[-1]), chance)
    elif draw < 0.3:
        path.append(chance.choice(("kind", "dt", "x", "0", "mass", "spring")))
    value = _value_for(str(path[-1]), None, chance)
    text = value if isinstance(value, str) else _as_json(value)
    return ".".join(str(key) for key in path) + "=" + text


def _misspelt(key: str, chance: random.Random) -> str:
    if not key:
        return "x"
    place = chance.randrange(len(key))
    shorter = key[:place] + key[place + 1 :] or "x"
    return chance.choice((shorter, key + "s", key.upper(), key[::-1], chance.choice(KINDS), "\ud800", "\x07"))


def _changed(data: Any, chance: random.Random) -> Any:
    """Return the data with one thing changed, in place where it can be."""
    found = [path for path, _ in nodes(data) if path]
    if not found:
        return chance.choice(BLOCKS)
    path = chance.choice(found)
    if chance.random() < 0.5:  # rather the scene and its solution than lists of methods
        scene = [each for each in found if each[0] in ("bodies", "contacts", "solve")]
        path = chance.choice(scene or found)
    holder = data
    for key in path[:-1]:
        holder = holder[key]
    last, value = path[-1], holder[path[-1]]
    draw = chance.random()
    if draw < 0.08:
        del holder[last]
    elif draw < 0.14 and isinstance(holder, dict):
        holder[_misspelt(str(last), chance)] = holder.pop(last)
    elif draw < 0.2 and isinstance(holder, list):
        holder.insert(chance.randrange(len(holder) + 1), copy.deepcopy(value))
        if chance.random() < 0.1:
            holder.extend(copy.deepcopy(value) for _ in range(chance.choice((50, 1200))))
    elif draw < 0.3 and isinstance(holder, dict):
        kind = holder.get("kind") if isinstance(holder.get("kind"), str) else str(path[-2]) if len(path) > 1 else "top"
        extra = EXTRA.get(str(kind), ("mass", "x", "kind", "law", "gap", "overlap"))
        key = chance.choice(extra)
        holder[key] = _value_for(key, holder.get(key), chance)
    elif draw < 0.36 and isinstance(value, (dict, list)):
        holder[last] = list(value.items()) if isinstance(value, dict) else dict(enumerate(value))
        holder[last] = json.loads(_as_json(holder[last]))
    elif draw < 0.42:
        other = chance.choice(found)
        holder[last] = copy.deepcopy(_at(data, other))
    else:
        holder[last] = _value_for(str(last), value, chance)
    return data


def _of_another_scale(data: Any, chance: random.Random) -> Any:
    """Return the data with some of its numbers scaled and other methods put in: still a case by its form."""
    if chance.random() < 0.6:
        solve = data["solve"]
        for key in chance.sample(("model", "integrator", "step", "duration", "events"), chance.choice((1, 2, 3))):
            pool = [each for each in grafts().get(key, []) if isinstance(each, (dict, str))]
            if pool:
                solve[key] = copy.deepcopy(chance.choice(pool))
        if chance.random() < 0.1:
            data["solve"] = {"duration": solve.get("duration"), "tolerance": chance.choice((1e-2, 1e-4, 1e-8, 0.5))}
        for contact in data.get("contacts") or []:
            if chance.random() < 0.4:
                contact["law"] = copy.deepcopy(chance.choice([law for law in grafts()["law"] if isinstance(law, dict)]))
    found = [
        (path, value)
        for path, value in nodes({key: data[key] for key in ("bodies", "contacts", "solve", "gravity") if key in data})
        if isinstance(value, (int, float)) and not isinstance(value, bool)
    ]
    for path, value in chance.sample(found, min(len(found), chance.choice((0, 1, 1, 2, 3, 6)))):
        holder = _at(data, path[:-1])
        wide = chance.choice((0.5, 2.0, 4.0, 6.0, 9.0, 15.0, 25.0, 300.0))
        try:
            number = value * 10.0 ** chance.uniform(-wide, wide)
        except OverflowError:
            number = 1e300
        holder[path[-1]] = max(1, int(min(number, 1e18))) if isinstance(value, int) and value > 1 else number
    return data


def _at(data: Any, path: Path_) -> Any:
    for key in path:
        data = data[key]
    return data


def _value_for(key: str, value: Any, chance: random.Random) -> Any:
    """Return something to stand under a key: a number scaled, an extreme, a text, a block, or a graft."""
    draw = chance.random()
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if number and draw < 0.25:
        return value * 10.0 ** chance.uniform(-14, 14) * chance.choice((1, 1, 1, -1))
    if number and draw < 0.4:
        try:
            return value * 10.0 ** chance.uniform(-320, 308)
        except OverflowError:
            return 10**300
    if draw < 0.6:
        pool = grafts().get(key) or grafts()[chance.choice(sorted(grafts()))]
        return copy.deepcopy(chance.choice(pool))
    if draw < 0.78 or (number and draw < 0.85):
        return chance.choice(NUMBERS)
    if draw < 0.88:
        return chance.choice(TEXTS)
    if draw < 0.93:
        return chance.choice(KINDS)
    return copy.deepcopy(chance.choice((*BLOCKS, None, True, False)))
