"""Readers of the fields of a case, each with one clear message.

They read numbers with a unit, words, ends and initial shapes. A field that allows several things is read by one reader
for all of them; a union of types would report one mistake with an error for each member.
"""

from __future__ import annotations

import math
import numbers
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from impactlab.casefile.text.words import shown
from impactlab.casefile.values.faults import refuse
from impactlab.casefile.values.formula import Formula, parse
from impactlab.casefile.values.loads import FORMS, MIN_SAMPLES, is_over_time, read_load
from impactlab.casefile.values.units import to_si
from impactlab.errors import NUMBER, WHOLE, closest
from impactlab.scene.bodies import AbstractLoad, End, Table
from impactlab.scene.ranges import COUNTS, Range, range_of
from impactlab.types import Relative

_LIMIT_WORDS = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}
_LIMIT_KEYS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}


@dataclass(frozen=True)
class Reader:
    """A pydantic annotation: a function that reads a value, and its JSON schema."""

    read: Callable[[Any], Any]
    schema: dict[str, Any] = field(hash=False, compare=False)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return dict(self.schema)


def object_schema(properties: Mapping[str, Any], *required: str) -> dict[str, Any]:
    """Return the JSON schema of a block with these keys and no others."""
    keys = {"properties": dict(properties), "required": list(required)}
    return {"type": "object", **keys, "additionalProperties": False}


def _column_schema(unit: str) -> dict[str, Any]:
    return {"type": "array", "items": {"type": ["number", "string"]}, "minItems": MIN_SAMPLES, "unit": unit}


@dataclass(frozen=True)
class Allowed:
    """Allowed values of one field: any of the kinds switched on here."""

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
        """Return the value in SI, or raise with the allowed values."""
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
            given = _as_float(value)
            if given.is_integer() and str(int(given)) in self.words:  # such as theta: 0
                return str(int(given))
        elif self.relative and isinstance(value, (Mapping, Relative)):
            return self._relative(value)
        raise self._refused(value, self._hint(value) if isinstance(value, str) else "")

    def _hint(self, given: str) -> str:
        """Return a hint at the likely meaning of a string that is not allowed."""
        if (self.whole or self.number) and given.strip().isdigit():
            return " Write the number without quotes."
        return closest(given, self.words)

    def _refused(self, value: Any, hint: str = "") -> PydanticCustomError:
        needs = WHOLE if self.whole and not self.number else NUMBER if self.number and not self.words else ""
        return refuse(f"{shown(value)} is not allowed here.{hint} Allowed: {self.words_of_allowed()}", needs)

    def words_of_allowed(self) -> str:
        """Return the allowed values, for people."""
        limits = " and ".join(f"{_LIMIT_WORDS[key]} {limit:g}" for key, limit in self.limits)
        kind = WHOLE if self.whole and not self.number else NUMBER
        choices = list(self.words)
        if self.number or self.whole:
            unit = f" in{self._shown_unit}" if self._shown_unit else ""
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
            numerals = [int(word) for word in self.words if word.removeprefix("-").isdecimal()]
            choices.append({"enum": [*self.words, *numerals]})
        if self.whole and not self.number:
            choices.append({"type": "integer", **limits})
        if self.number:
            choices.append({"type": "number", **limits})
            if self.unit != "1":
                choices.append({"type": "string", "description": f"number and unit, as in '1 {self.unit}'"})
        if self.relative:
            choices.append(object_schema({"relative": {"type": "number", **limits}}, "relative"))
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
            raise self._refused(value)
        return number

    def _relative(self, value: Any) -> Relative:
        given = {"relative": value.relative} if isinstance(value, Relative) else dict(value)
        number = given.get("relative")
        if set(given) != {"relative"} or isinstance(number, bool) or not isinstance(number, numbers.Real):
            raise self._refused(value)
        return Relative(self._limited(_finite(number), COUNTS))

    def _limited(self, number: float, sizes: Range | None = None) -> float:
        for key, limit in self.limits:
            if not getattr(operator, key)(number, limit):
                # Six digits would show a number just beyond its limit as the limit itself.
                given = f"{number:g}" if not getattr(operator, key)(float(f"{number:g}"), limit) else repr(number)
                raise refuse(f"{given}{self._shown_unit} is out of range. Allowed: {self.words_of_allowed()}")
        if self.whole and not self.number:
            return number
        least, most = sizes or range_of(self.unit)  # sizes that can be computed with
        positive = any(key in ("gt", "ge") and limit >= 0.0 for key, limit in self.limits)
        if abs(number) > most or (positive and 0.0 < number < least):
            unit, words = self._shown_unit, f"{least:g} to {most:g}" if positive else f"sizes up to {most:g}"
            raise refuse(f"{number:g}{unit} is beyond the numbers a case may hold. Allowed: {words}{unit}")
        return number

    @property
    def _shown_unit(self) -> str:
        return "" if self.unit == "1" else f" {self.unit}"


def positive(unit: str) -> Allowed:
    """Return the numbers above 0 in a unit."""
    return Allowed(unit=unit, limits=(("gt", 0.0),), number=True)


def _as_float(value: numbers.Real) -> float:
    """Return a number as a float, inf where it is beyond the range of floats."""
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _finite(value: numbers.Real) -> float:
    number = _as_float(value)
    if not math.isfinite(number):
        raise refuse(f"{shown(value)} is not a finite number")
    return number


def quantity(unit: str, *, nothing: bool = False, **limits: float) -> Reader:
    """Return the annotation of a number in a unit, or ``nothing``.

    ``gt``, ``ge``, ``lt``, ``le`` bound it.
    """
    return Allowed(unit=unit, limits=tuple(limits.items()), number=True, nothing=nothing).reader()


def whole(*, nothing: bool = False, **limits: float) -> Reader:
    """Return the annotation of a whole number, or ``nothing``; bounded as a `quantity`."""
    return Allowed(limits=tuple(limits.items()), whole=True, nothing=nothing).reader()


def words(*allowed: str, nothing: bool = False) -> Reader:
    """Return the annotation of one word out of a few, or ``nothing``."""
    return Allowed(words=allowed, nothing=nothing).reader()


_SUPPORTS = {"spring": ("spring", "N/m"), "dashpot": ("dashpot", "N s/m"), "mass": ("mass", "kg")}
_ROTATIONAL = Allowed(unit="N m", limits=(("ge", 0.0),), number=True)  # a radian has no dimension


@dataclass(frozen=True)
class EndReader:
    """Reads the support of an end: a word, or a block such as ``{spring: value}``."""

    body: str
    words: tuple[str, ...]
    turns: bool = False  # the end may rotate, and a spring resist it
    supports: Mapping[str, tuple[str, str]] = field(default_factory=lambda: _SUPPORTS)  # key: kind of end, unit
    load: tuple[str, str] = ("force", "N")  # key and unit

    def reader(self) -> Reader:
        """Return the annotation of such an end."""
        return Reader(self.read, self.schema())

    @property
    def allowed(self) -> str:
        """The allowed ends, for people."""
        turning = {"spring": ", rotational: N m"} if self.turns else {}
        held = [f"{{{key}: {unit}{turning.get(key, '')}}}" for key, (_, unit) in self.supports.items()]
        load, unit = self.load
        every = f"{', '.join((*self.words, *held))}, {{{load}: {unit}}}, or one of the three blocks with a {load} in it"
        return f"{every}; a {load} over time is {FORMS}"

    def read(self, value: Any) -> End:
        """Return the end, or raise with the allowed ends."""
        if isinstance(value, End):
            return value
        if isinstance(value, str) and value in self.words:
            return End(value)  # type: ignore[arg-type]
        if not isinstance(value, Mapping) or not value:
            hint = closest(value, self.words) if isinstance(value, str) else ""
            raise refuse(f"{shown(value)} is not an end of a {self.body}.{hint} Allowed: {self.allowed}")
        load, _ = self.load
        force, over_time = self._force(value[load]) if load in value else (0.0, None)
        turning = self.turns and "rotational" in value and "spring" in value
        rotational = _ROTATIONAL.read(value["rotational"]) if turning else 0.0
        held = [kind for kind in value if kind != load and not (kind == "rotational" and turning)]
        for kind in held:
            if kind not in self.supports:
                words = closest(str(kind), (*self.supports, load))
                raise refuse(
                    f"{shown(kind)} is not a valid support for an end of a {self.body}.{words} Allowed: {self.allowed}"
                )
        if len(held) > 1:
            raise refuse(f"{' and '.join(held)} are given for one end. Allowed: {self.allowed}")
        if not held:
            return End("free", force=force, load=over_time)
        kind, unit = self.supports[held[0]]
        return End(kind, positive(unit).read(value[held[0]]), force, rotational, over_time)  # type: ignore[arg-type]

    def _force(self, value: Any) -> tuple[float, AbstractLoad | None]:
        """Return the force of an end, constant or over time."""
        unit = self.load[1]
        if is_over_time(value):
            return 0.0, read_load(value, unit)
        return Allowed(unit=unit, number=True).read(value), None

    def schema(self) -> dict[str, Any]:
        """Return the JSON schema of such an end."""
        load, unit = self.load
        table = object_schema({"t": _column_schema("s"), "f": _column_schema(unit)}, "t", "f")
        file = object_schema({key: {"type": "string"} for key in ("file", "t", "f")}, "file", "t", "f")
        force = {load: {"anyOf": [Allowed(unit=unit, number=True).json_schema(), table, file], "unit": unit}}
        choices: list[dict[str, Any]] = [{"enum": list(self.words)}]
        for name, (_, unit) in self.supports.items():
            turning = {"rotational": _ROTATIONAL.json_schema()} if self.turns and name == "spring" else {}
            choices.append(object_schema({name: positive(unit).json_schema(), **turning, **force}, name))
        return {"anyOf": [*choices, object_schema(force, load)]}


END = EndReader("rod", ("free", "clamped", "infinite")).reader()
BEAM_END = EndReader("beam", ("free", "clamped", "pinned", "infinite"), turns=True).reader()


def shape(unit: str) -> Reader:
    """Return the annotation of a shape along a body at t = 0.

    It is a formula of x, or a table of values in a unit.
    """

    def read(value: Any) -> Any:
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
            columns = [_column(value["x"], "x", "m"), _column(value["u"], "u", unit)]
            if len(columns[0]) != len(columns[1]):
                raise refuse(
                    f"the table has {len(columns[0])} places x and {len(columns[1])} values u; give one u for each x"
                )
            if len(columns[0]) < 2 or any(b <= a for a, b in zip(columns[0], columns[0][1:], strict=False)):
                raise refuse("the places x of the table do not rise; give at least two, each above the one before")
            return Table(*columns)
        raise refuse(
            f"{shown(value)} is not a shape. Allowed: a formula of x such as '1e-5*cos(pi*x/L)', or "
            "{x: [...], u: [...]}"
        )

    table = object_schema({"x": _column_schema("m"), "u": _column_schema(unit)}, "x", "u")
    formula = {"type": "string", "maxLength": 400}
    return Reader(read, {"anyOf": [formula, {"type": "number"}, table, {"type": "null"}], "unit": unit})


def _column(value: Any, name: str, unit: str) -> tuple[float, ...]:
    if not isinstance(value, (list, tuple)):
        raise refuse(f"{name} of the table is {shown(value)}; give a list of numbers in {unit}")
    allowed = Allowed(unit=unit, number=True)
    return tuple(allowed.read(number) for number in value)


SHAPE, TWIST = shape("m"), shape("rad")
