"""Reader of parts by their own fields: the second pass.

Parts of a case are model, law, integrator and basis. A part is a frozen dataclass; `impactlab.types.option` gave each
field its unit, limits and description. From these a pydantic model is made, so that a plugin writes no schema.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Annotated, Any, Literal, Union

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model
from pydantic_core import PydanticCustomError

from impactlab.casefile.text.words import listed, shown
from impactlab.casefile.values.faults import CHECK_FILE, case_error, refuse
from impactlab.casefile.values.fields import Allowed, Reader
from impactlab.casefile.values.materials import MATERIALS
from impactlab.casefile.values.units import to_si, with_power
from impactlab.contact.spheres import EXPONENT, Spheres
from impactlab.errors import CaseError, PluginError, closest
from impactlab.plugins import GROUPS, Group, Registry, fault_of, kind_of
from impactlab.types import Relative

SPHERE_MATERIALS = {"material": ("young", "poisson"), "other_material": ("other_young", "other_poisson")}
"""Names of materials of spheres, with the options that each stands for."""
SPHERE_KEYS = {*SPHERE_MATERIALS, *(field.name for field in dataclasses.fields(Spheres))}


def read_part(block: dict[str, Any], path: str, group: Group, registry: Registry) -> Any:
    """Return the part that a block ``{kind: name, ...}`` describes.

    Raises
    ------
    PluginError
        If no part has this name, or it is broken.
    CaseError
        If a parameter is unknown, missing or out of range; the path names it.
    """
    try:
        part = registry.load(group, block["kind"])
        model = part_model(part)
    except PluginError as error:
        error.path = f"{path}.kind"
        raise
    given = {key: value for key, value in block.items() if key != "kind"}
    for field in dataclasses.fields(part):
        group_inside, inside = group_of(field), given.get(field.name)
        if group_inside is not None and inside is not None:
            given[field.name] = _read_inside(inside, f"{path}.{field.name}", group_inside, registry)
        if records_of(field) and inside is not None:
            given[field.name] = _read_record(inside, f"{path}.{field.name}", records_of(field))
        if _has_power(field):
            _refuse_spheres_outside(given, field.name, model, path)
        if isinstance(inside, dict) and not SPHERE_KEYS.isdisjoint(inside) and _has_power(field):
            given[field.name] = _of_spheres(inside, f"{path}.{field.name}", exponent_of(part, given))
        if isinstance(inside, str) and _has_power(field):
            given[field.name] = _with_exponent(inside, f"{path}.{field.name}", field.metadata["unit"], part, given)
    try:
        return _made(part, model, given, path)
    except ValueError as error:
        raise CaseError(
            f"{shown(block['kind'])} refuses these values: {str(error)[:200]}",
            remedy="`impactlab plugins` describes the part, and `impactlab schema` lists its options.",
            path=path,
        ) from error


def _made(part: type[Any], model: type[BaseModel], given: Mapping[str, Any], path: str) -> Any:
    """Return the part or the record of given values, checked by its model."""
    try:
        checked = model.model_validate(given)
    except ValidationError as error:
        raise case_error(error, given, path, model) from error
    try:
        return part(**{name: getattr(checked, name) for name in model.model_fields})
    except CaseError as error:
        error.path = f"{path}.{error.path}" if error.path else path
        raise


def _has_power(field: dataclasses.Field[Any]) -> bool:
    """Return whether the unit of a field has the power of the option ``exponent``."""
    return str(field.metadata.get("unit", "")).endswith("^n")


def exponent_of(part: Any, given: Mapping[str, Any]) -> Any:
    """Return the power in the unit of a part's stiffness, as a block gives it."""
    return given.get("exponent", getattr(part, "exponent", None))


def _refuse_spheres_outside(given: Mapping[str, Any], stiffness: str, model: type[BaseModel], path: str) -> None:
    """Raise `CaseError` for a key of spheres that stands beside the stiffness, not inside it."""
    beside = [key for key in given if key in SPHERE_KEYS and key not in model.model_fields]
    if beside:
        block = ", ".join(f"{key}: {_bare(given[key])}" for key in beside)
        more = "" if {"material", "young"} & set(beside) else ", material: steel"
        raise CaseError(
            f"the key {beside[0]!r} is not known here. It stands inside {stiffness!r}, a number or a block of spheres",
            remedy=f"Write {stiffness}: {{{block}{more}}}.",
            path=f"{path}.{beside[0]}",
        )


def _bare(value: Any) -> str:
    """Return a value as a message shows it, a text without quotes."""
    return shown(value)[1:-1] if isinstance(value, str) else shown(value)


def _of_spheres(block: Mapping[str, Any], path: str, n: Any) -> float:
    """Return the stiffness [N/m^1.5] of the spheres that a block gives in place of a number."""
    if n != EXPONENT:
        text = f"a stiffness by spheres is one of the power {EXPONENT:g}, and the exponent is {shown(n)}"
        raise CaseError(text, remedy=f"Leave exponent out, or give stiffness as a number in N/m^{n}.", path=path)
    for key in block:
        if key not in SPHERE_KEYS:
            text = f"the key {shown(key)} is not known here.{closest(str(key), SPHERE_KEYS)}"
            raise CaseError(text, remedy=f"Allowed: {', '.join(sorted(SPHERE_KEYS))}.", path=f"{path}.{key}")
    if not {"material", "young"} & set(block):
        remedy = f"Add material ({', '.join(MATERIALS)}), or young and poisson."
        raise CaseError("this key is missing", remedy=remedy, path=f"{path}.material")
    given = dict(block)
    for key, own in SPHERE_MATERIALS.items():
        if (name := given.pop(key, None)) is None:
            continue
        if not isinstance(name, str) or name not in MATERIALS:
            text = f"{shown(name)} is not the name of a material.{closest(str(name), MATERIALS)}"
            raise CaseError(text, remedy=f"Allowed: {listed(MATERIALS)}, or {' and '.join(own)}.", path=f"{path}.{key}")
        if set(own) & set(given):
            text = f"{key} is given beside {' or '.join(own)}"
            raise CaseError(text, remedy="Give one or the other.", path=f"{path}.{key}")
        given |= zip(own, (MATERIALS[name].young, MATERIALS[name].poisson), strict=True)
    spheres: Spheres = _made(Spheres, part_model(Spheres), given, path)
    return spheres.stiffness


def _with_exponent(text: str, path: str, unit: str, part: Any, given: Mapping[str, Any]) -> float | str:
    """Return in SI a number whose unit has the power of the part's option ``exponent``."""
    n = exponent_of(part, given)
    if isinstance(n, bool) or not isinstance(n, (int, float)):
        return text
    try:
        return to_si(text, with_power(unit, n))
    except ValueError as error:
        raise CaseError(str(error), remedy=CHECK_FILE, path=path) from error


def _read_inside(value: Any, path: str, group: Group, registry: Registry) -> Any:
    """Return the part that a field of another part holds: ``name``, or ``{kind: name, ...}``."""
    block = {"kind": value} if isinstance(value, str) else value
    if not isinstance(block, dict) or not isinstance(block.get("kind"), str):
        raise CaseError(
            f"{shown(value)} is given where {group.noun} is needed",
            remedy=f"Give one of {listed(registry.names(group))}, or {{kind: name, ...}} with its parameters.",
            path=path,
        )
    return read_part(block, path, group, registry)


def records_of(field: dataclasses.Field[Any]) -> tuple[type[Any], ...]:
    """Return the classes of the record in a field; none of plain values and parts."""
    found: tuple[type[Any], ...] = field.metadata.get("records", ())
    return found


def record_of(block: dict[str, Any], records: tuple[type[Any], ...]) -> type[Any] | None:
    """Return the class of the record in a block.

    It is that of its kind, or the one without a kind that has its keys.
    """
    found = [record for record in records if record.kind == block.get("kind", "")]
    own = [len({field.name for field in dataclasses.fields(record)} & set(block)) for record in found]
    return found[own.index(max(own))] if found else None


def _read_record(value: Any, path: str, records: tuple[type[Any], ...]) -> Any:
    """Return the record that a field holds.

    It is the one of its kind, or the one without a kind that has its keys.
    """
    kinds = [record.kind for record in records if record.kind]
    plain = [record for record in records if not record.kind]
    forms = [f"{{{', '.join(each.name for each in dataclasses.fields(record))}}}" for record in plain]
    allowed = ", ".join([*forms, *(f"{{kind: {kind}, ...}}" for kind in kinds)])
    if not isinstance(value, dict):
        raise CaseError(f"{shown(value)} is not allowed here. Allowed: {allowed}", remedy="Give a block.", path=path)
    kind, given = value.get("kind", ""), {key: each for key, each in value.items() if key != "kind"}
    chosen = record_of(value, records)
    if chosen is None:
        raise CaseError(
            f"there is no kind {shown(kind)}. Allowed: {allowed}",
            remedy=f"Kinds: {listed(kinds)}.",
            path=f"{path}.kind",
        )
    return _made(chosen, part_model(chosen), given, path)


def _read_before(nothing: bool, fits: Callable[[Any], bool], fault: str) -> Reader:
    """Return the reader of a part or a record in a field, which `read_part` reads before its holder."""

    def read(value: Any) -> Any:
        if (value is None and nothing) or fits(value):
            return value
        raise refuse(f"{shown(value)} {fault}")

    return Reader(read, {"type": "object"})


def _numbers(value: Any, unit: str) -> tuple[float, ...]:
    """Return a list of numbers in a unit as a tuple, in SI."""
    if not isinstance(value, list | tuple):
        raise refuse(f"{shown(value)} is not a list. Allowed: a list of numbers in {unit}")
    return tuple(Allowed(unit=unit, number=True).read(each) for each in value)


def group_of(field: dataclasses.Field[Any]) -> Group | None:
    """Return the group of the part in a field, None of plain values."""
    name = field.metadata.get("group", "")
    if not name:
        return None
    for group in GROUPS:
        if group.name == name:
            return group
    raise PluginError(
        f"the field {field.name!r} holds a part of {name!r}, which is not a group", remedy="Fix the plugin."
    )


def part_model(part: type[Any]) -> type[BaseModel]:
    """Return the pydantic model made from the fields of a part."""
    made: type[BaseModel] = _part_model(part)  # type: ignore[arg-type] # a class is hashable
    return made


def check_fields(part: type[Any]) -> None:
    """Raise `PluginError` where no case can give the type or default of a field."""
    hints = typing.get_type_hints(part)
    for field in dataclasses.fields(part):
        if not field.init:
            continue
        reader = _reader(part, field, hints[field.name])
        if field.default is dataclasses.MISSING:
            continue
        try:
            reader.read(field.default)
        except PydanticCustomError as error:
            raise PluginError(
                f"the default of the field {field.name!r} of {part.__module__}.{part.__name__}: {error.message()}",
                remedy="Fix the plugin.",
            ) from error


@cache
def _part_model(part: type[Any]) -> type[BaseModel]:
    hints = typing.get_type_hints(part)
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(part):
        if not field.init:
            continue
        reader = _reader(part, field, hints[field.name])
        default = ... if field.default is dataclasses.MISSING else field.default
        unit = field.metadata["unit"]
        described = field.metadata["description"] + ("" if unit == "1" else f" [{unit}]")
        fields[field.name] = (Annotated[Any, reader], Field(default, description=described))
    config = ConfigDict(frozen=True, extra="forbid", validate_default=True, protected_namespaces=())
    model: type[BaseModel] = create_model(part.__name__, __config__=config, **fields)
    return model


def _reader(part: type[Any], field: dataclasses.Field[Any], hint: Any) -> Reader:
    """Return the reader of the values that a field allows, from its type and its option."""
    members = typing.get_args(hint) if typing.get_origin(hint) in (Union, types.UnionType) else (hint,)
    nothing, group, records = types.NoneType in members, group_of(field), records_of(field)
    if group is not None:
        needed = f"is given where {group.noun} is needed"
        return _read_before(nothing, lambda value: not fault_of(type(value), group), needed)
    if records:
        return _read_before(nothing, lambda value: isinstance(value, records), "is not allowed here")
    if hint == tuple[float, ...]:
        return Reader(partial(_numbers, unit=field.metadata["unit"]), {"type": "array", "items": {"type": "number"}})
    words: tuple[str, ...] = ()
    for member in members:
        if typing.get_origin(member) is Literal:
            words += tuple(str(word) for word in typing.get_args(member))
        elif member not in (float, int, bool, Relative, types.NoneType):
            raise PluginError(
                f"the field {field.name!r} of {part.__module__}.{part.__name__} has the type {member!r}; "
                "a case can give float, int, bool, None, Relative and Literal words",
                remedy="Fix the plugin.",
            )
    return Allowed(
        unit=field.metadata["unit"],
        limits=tuple(field.metadata["limits"].items()),
        number=float in members,
        whole=int in members,
        boolean=bool in members,
        nothing=nothing,
        relative=Relative in members,
        words=words,
    ).reader()


def describe_part(part: Any, given: Mapping[str, Any] | str) -> dict[str, Any]:
    """Return a part as a case gives it, every field in SI.

    ``given`` is the block that a case gave, or the kind alone; a part inside that it is silent about has its own name.
    """
    block = {"kind": given} if isinstance(given, str) else given
    values: dict[str, Any] = {"kind": block["kind"]}
    for field in dataclasses.fields(part):
        if not field.init:
            continue
        values[field.name] = plain_value(getattr(part, field.name), block.get(field.name))
    return values


def plain_value(value: Any, given: Mapping[str, Any] | str | None = None) -> Any:
    """Return the value of a field as a case would give it.

    ``given`` is the block of a part in the case.
    """
    if isinstance(value, Relative):
        return {"relative": value.relative}
    if isinstance(value, tuple):
        return list(value)
    if dataclasses.is_dataclass(value) and hasattr(value, "kind"):  # a record of options
        own = {field.name: plain_value(getattr(value, field.name)) for field in dataclasses.fields(value)}
        return {"kind": value.kind, **own} if value.kind else own
    return describe_part(value, given or kind_of(value)) if dataclasses.is_dataclass(value) else value
