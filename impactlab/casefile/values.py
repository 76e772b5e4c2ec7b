"""What a field of a case may hold, each with one clear message: numbers with a unit, words, ends, initial shapes.

A field that allows several things is read by one reader that knows them all; a union of types would answer one
mistake with an error for each member.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from impactlab.casefile.formula import Formula, parse
from impactlab.casefile.units import takes_texts, to_si
from impactlab.casefile.words import closest, shown
from impactlab.scene.bodies import End, Table
from impactlab.scene.ranges import COUNTS, Range, range_of
from impactlab.types import Relative

_LIMIT_WORDS = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}
_LIMIT_KEYS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
_LIMIT_TESTS: dict[str, Callable[[float, float], bool]] = {
    "gt": lambda value, limit: value > limit,
    "ge": lambda value, limit: value >= limit,
    "lt": lambda value, limit: value < limit,
    "le": lambda value, limit: value <= limit,
}


def refuse(text: str) -> PydanticCustomError:
    """Return the error of a value, with a text that is shown as it stands."""
    return PydanticCustomError("value", "{text}", {"text": text})


@dataclass(frozen=True)
class Reader:
    """A pydantic annotation that reads a value by one function and describes itself to the JSON schema."""

    read: Callable[[Any], Any]
    schema: dict[str, Any] = field(hash=False, compare=False)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return dict(self.schema)


@dataclass(frozen=True)
class Allowed:
    """What one field may hold: any of the kinds switched on here."""

    unit: str = "1"
    limits: tuple[tuple[str, float], ...] = ()
    number: bool = False
    whole: bool = False
    boolean: bool = False
    nothing: bool = False
    relative: bool = False
    words: tuple[str, ...] = ()

    def reader(self) -> Reader:
        """Return the annotation of a field that allows this."""
        return Reader(self.read, self.json_schema())

    def read(self, value: Any) -> Any:
        """Return the value in SI, or raise with what is allowed."""
        if value is None and self.nothing:
            return None
        if isinstance(value, bool):
            if self.boolean:
                return value
        elif isinstance(value, str):
            if value in self.words:
                return value
            if self.number and (not self.words or value[:1].isdigit() or value[:1] in "+-."):
                return self._limited(self._with_unit(value))
        elif isinstance(value, numbers.Real):
            if self.whole and not self.number:
                return int(self._limited(self._whole(value)))
            if self.number:
                return self._limited(_finite(value))
        elif self.relative and isinstance(value, (Mapping, Relative)):
            return self._relative(value)
        hint = closest(value, self.words) if isinstance(value, str) else ""
        raise refuse(f"{shown(value)} is not allowed here.{hint} Allowed: {self.words_of_allowed()}")

    def words_of_allowed(self) -> str:
        """Return what is allowed, for people."""
        limits = " and ".join(f"{_LIMIT_WORDS[key]} {limit:g}" for key, limit in self.limits)
        kind = "a whole number" if self.whole and not self.number else "a number"
        choices = list(self.words)
        if self.number or self.whole:
            unit = "" if self.unit == "1" else f" in {self.unit}"
            choices.append(f"{kind}{unit}{' ' + limits if limits else ''}")
        if self.relative:
            choices.append("{relative: number}")
        if self.boolean:
            choices.append("true or false")
        if self.nothing:
            choices.append("null")
        return ", ".join(choices)

    def json_schema(self) -> dict[str, Any]:
        """Return the JSON schema of such a field."""
        limits = {_LIMIT_KEYS[key]: limit for key, limit in self.limits}
        choices: list[dict[str, Any]] = []
        if self.words:
            choices.append({"enum": list(self.words)})
        if self.whole and not self.number:
            choices.append({"type": "integer", **limits})
        if self.number:
            choices.append({"type": "number", **limits})
            if takes_texts(self.unit):
                choices.append({"type": "string", "description": f"number and unit, as in '1 {self.unit}'"})
        if self.relative:
            relative = {"relative": {"type": "number", **limits}}
            choices.append(
                {"type": "object", "properties": relative, "required": ["relative"], "additionalProperties": False}
            )
        if self.boolean:
            choices.append({"type": "boolean"})
        if self.nothing:
            choices.append({"type": "null"})
        described: dict[str, Any] = choices[0] if len(choices) == 1 else {"anyOf": choices}
        return {**described, "unit": self.unit} if self.number or self.whole else described

    def _with_unit(self, text: str) -> float:
        try:
            return to_si(text, self.unit)
        except ValueError as error:
            raise refuse(str(error)) from error

    def _whole(self, value: numbers.Real) -> float:
        number = _finite(value)
        if number != int(number):
            raise refuse(f"{shown(value)} is not allowed here. Allowed: {self.words_of_allowed()}")
        return number

    def _relative(self, value: Any) -> Relative:
        given = {"relative": value.relative} if isinstance(value, Relative) else dict(value)
        number = given.get("relative")
        if set(given) != {"relative"} or isinstance(number, bool) or not isinstance(number, numbers.Real):
            raise refuse(f"{shown(value)} is not allowed here. Allowed: {self.words_of_allowed()}")
        return Relative(self._limited(_finite(number), COUNTS))

    def _limited(self, number: float, sizes: Range | None = None) -> float:
        for key, limit in self.limits:
            if not _LIMIT_TESTS[key](number, limit):
                unit = "" if self.unit == "1" else f" {self.unit}"
                # Six digits would show a number just beyond its limit as the limit itself.
                given = f"{number:g}" if not _LIMIT_TESTS[key](float(f"{number:g}"), limit) else repr(number)
                raise refuse(f"{given}{unit} is out of range. Allowed: {self.words_of_allowed()}")
        return self._in_range(number, sizes or range_of(self.unit))

    def _in_range(self, number: float, sizes: Range) -> float:
        """Return a number whose size can be computed with, or refuse it (`impactlab.scene.ranges`)."""
        if self.whole and not self.number:
            return number
        least, most = sizes
        positive = any(key in ("gt", "ge") and limit >= 0.0 for key, limit in self.limits)
        if abs(number) > most or (positive and 0.0 < number < least):
            unit = "" if self.unit == "1" else f" {self.unit}"
            words = f"{least:g} to {most:g}" if positive else f"sizes up to {most:g}"
            raise refuse(f"{number:g}{unit} is beyond the numbers a case may hold. Allowed: {words}{unit}")
        return number


def _finite(value: numbers.Real) -> float:
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise refuse(f"{shown(value)} is not a finite number")
    return number


def quantity(unit: str, **limits: float) -> Reader:
    """Return the annotation of a number in a unit; ``gt``, ``ge``, ``lt``, ``le`` bound it."""
    return Allowed(unit=unit, limits=tuple(limits.items()), number=True).reader()


def words(*allowed: str) -> Reader:
    """Return the annotation of one word out of a few."""
    return Allowed(words=allowed).reader()


_SUPPORTS = {"spring": ("spring", "N/m"), "dashpot": ("dashpot", "N s/m"), "mass": ("mass", "kg")}
_ROTATIONAL = Allowed(unit="N m", limits=(("ge", 0.0),), number=True)  # a radian has no dimension


@dataclass(frozen=True)
class EndReader:
    """Reads what holds an end of a body: a word, or ``{spring: value}`` and the like."""

    body: str
    words: tuple[str, ...]
    turns: bool = False  # the end may rotate, and a spring resist it
    supports: Mapping[str, tuple[str, str]] = field(default_factory=lambda: _SUPPORTS)  # key: kind of end, unit
    load: tuple[str, str] = ("force", "N")  # key and unit

    @property
    def allowed(self) -> str:
        """What is allowed, for people."""
        turning = {"spring": ", rotational: N m"} if self.turns else {}
        held = [f"{{{key}: {unit}{turning.get(key, '')}}}" for key, (_, unit) in self.supports.items()]
        load, unit = self.load
        return f"{', '.join((*self.words, *held))}, {{{load}: {unit}}}, or one of the three with a {load}"

    def read(self, value: Any) -> End:
        """Return the end, or raise with what is allowed."""
        if isinstance(value, End):
            return value
        if isinstance(value, str):
            if value in self.words:
                return End(value)  # type: ignore[arg-type]
            hint = closest(value, self.words)
            raise refuse(f"{shown(value)} is not an end of a {self.body}.{hint} Allowed: {self.allowed}")
        if not isinstance(value, Mapping) or not value:
            raise refuse(f"{shown(value)} is not an end of a {self.body}. Allowed: {self.allowed}")
        load, unit = self.load
        force = Allowed(unit=unit, number=True).read(value[load]) if load in value else 0.0
        turning = self.turns and "rotational" in value and "spring" in value
        rotational = _ROTATIONAL.read(value["rotational"]) if turning else 0.0
        held = [kind for kind in value if kind != load and not (kind == "rotational" and turning)]
        for kind in held:
            if kind not in self.supports:
                words = closest(str(kind), (*self.supports, load))
                raise refuse(f"{shown(kind)} cannot hold an end.{words} Allowed: {self.allowed}")
        if len(held) > 1:
            raise refuse(f"{' and '.join(held)} hold one end together. Allowed: {self.allowed}")
        if not held:
            return End("free", force=force)
        [name] = held
        kind, unit = self.supports[name]
        number = Allowed(unit=unit, limits=(("gt", 0.0),), number=True).read(value[name])
        return End(kind, number, force, rotational)  # type: ignore[arg-type]

    def schema(self) -> dict[str, Any]:
        """Return the JSON schema of such an end."""
        choices: list[dict[str, Any]] = [{"enum": list(self.words)}]
        load, unit = self.load
        force = {load: Allowed(unit=unit, number=True).json_schema()}
        for name, (_, unit) in self.supports.items():
            value = Allowed(unit=unit, limits=(("gt", 0.0),), number=True).json_schema()
            turning = {"rotational": _ROTATIONAL.json_schema()} if self.turns and name == "spring" else {}
            choices.append(
                {
                    "type": "object",
                    "properties": {name: value, **turning, **force},
                    "required": [name],
                    "additionalProperties": False,
                }
            )
        choices.append({"type": "object", "properties": force, "required": [load], "additionalProperties": False})
        return {"anyOf": choices}


_ROD_END = EndReader("rod", ("free", "clamped", "infinite"))
_BEAM_END = EndReader("beam", ("free", "clamped", "pinned", "infinite"), turns=True)
END = Reader(_ROD_END.read, _ROD_END.schema())
BEAM_END = Reader(_BEAM_END.read, _BEAM_END.schema())


def _read_shape(value: Any) -> Any:
    if value is None or isinstance(value, (Formula, Table)):
        return value
    if isinstance(value, str):
        try:
            parse(value)
        except ValueError as error:
            raise refuse(str(error)) from error
        return value
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        return repr(_finite(value))
    if isinstance(value, Mapping) and set(value) == {"x", "u"}:
        columns = [_column(value["x"], "x"), _column(value["u"], "u")]
        if len(columns[0]) != len(columns[1]):
            raise refuse(
                f"the table has {len(columns[0])} places x and {len(columns[1])} values u; give one u for each x"
            )
        if len(columns[0]) < 2 or any(b <= a for a, b in zip(columns[0], columns[0][1:], strict=False)):
            raise refuse("the places x of the table do not rise; give at least two, each above the one before")
        return Table(*columns)
    raise refuse(
        f"{shown(value)} is not a shape. Allowed: a formula of x such as '1e-5*cos(pi*x/L)', or {{x: [...], u: [...]}}"
    )


def _column(value: Any, name: str) -> tuple[float, ...]:
    if not isinstance(value, (list, tuple)):
        raise refuse(f"{name} of the table is {shown(value)}; give a list of numbers in m")
    metre = Allowed(unit="m", number=True)
    return tuple(metre.read(number) for number in value)


_COLUMN = {"type": "array", "items": {"type": ["number", "string"]}, "minItems": 2, "unit": "m"}
SHAPE = Reader(
    _read_shape,
    {
        "anyOf": [
            {"type": "string", "maxLength": 400},
            {"type": "number"},
            {
                "type": "object",
                "properties": {"x": _COLUMN, "u": _COLUMN},
                "required": ["x", "u"],
                "additionalProperties": False,
            },
            {"type": "null"},
        ],
        "unit": "m",
    },
)
