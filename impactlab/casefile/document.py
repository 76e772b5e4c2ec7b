"""Reads the text of a case file into plain values with their lines. Case files are data: nothing in one ever runs.

YAML is taken event by event, so that limits, tags, anchors and double keys are refused before any value is built, and
numbers are read by the core rules of YAML 1.2 (``2.1e11`` and ``1e-3`` are numbers, ``on`` is a text).
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from impactlab.casefile.starter import cases
from impactlab.casefile.words import closest, shown
from impactlab.errors import CaseError

MAX_BYTES = 1_000_000  # bytes
MAX_LINES = 50_000
MAX_VALUES = 25_000  # keys, list entries and values: YAML takes some 40 us for each
MAX_GIVEN = 2_000_000  # the same of a case made in Python
MAX_DEPTH = 24  # levels of nesting
MAX_KEY = 120  # characters
MAX_VALUE = 10_000  # characters of a value given on the command line

Keys = tuple[str, ...]
"""Where a value stands: keys and list positions from the top, as texts."""

_INTEGER = re.compile(r"[-+]?[0-9]{1,400}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_WORDS: dict[str, bool | None] = {"": None, "~": None, "null": None, "Null": None, "NULL": None}
_WORDS |= {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
_INDENTED_BY_TAB = re.compile(r" *\t")
_JSON_WORD = re.compile(r'"(?:\\.|[^"\\])*"|-?Infinity|NaN')
_DOTTED = re.compile(rf"""(?:[\w"'-]+\s*\.\s*){{{MAX_DEPTH + 1}}}""")
_BRACKETS = re.compile(r"""[\[\]{}]|"(?:\\.|[^"\\\n])*"?|'(?:\\.|[^'\\\n])*'?""")  # brackets, and texts to skip
_SERIES = "A case describes a scene; keep measured series outside it."
_REMEDY = "A case holds plain keys and values only; see `impactlab new` for one to start from."


class Kind(NamedTuple):
    """The keys that a file needs, for the message where it has none."""

    keys: str  # as in: a case has keys such as ...
    remedy: str


CASE = Kind("a case has keys such as schema_version, bodies, contacts, solve", "Start from `impactlab new`.")


class Document(NamedTuple):
    """A case as plain dicts, lists and scalars, and the line of each key."""

    data: dict[str, Any]
    lines: dict[Keys, int | None]
    given: Mapping[Keys, str] = {}  # values that do not stand in the file: the option that gave each; never written to


def read_document(path: Path, kind: Kind = CASE) -> Document:
    """Return the document in a file: YAML, TOML or JSON, by its ending.

    Raises
    ------
    CaseError
        If the file is missing, too large, too deep, or of another format than its ending.
    """
    readers = {".yaml": parse_yaml, ".yml": parse_yaml, ".toml": parse_toml, ".json": parse_json}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise CaseError(
            f"{path.name!r} is not a case file by its ending. Allowed: {', '.join(readers)}",
            remedy="Rename the file after the format it is written in.",
            file=str(path),
        )
    try:
        return reader(_text(path), kind)
    except CaseError as error:
        error.located(str(path), error.line)
        raise


def _text(path: Path) -> str:
    if not path.is_file():
        what = "is a folder, not a file" if path.is_dir() else "does not exist"
        remedy = "Give the path of a case file."
        if path.stem in cases():
            remedy = f"Give {path.stem!r}, without its ending, for the case of that name that comes with impactlab."
        raise CaseError(f"the case file {what}.{_neighbour(path)}", remedy=remedy)
    with path.open("rb") as stream:
        raw = stream.read(MAX_BYTES + 1)
    if len(raw) > MAX_BYTES:
        raise CaseError(f"the file is larger than {MAX_BYTES} bytes, the most a case may have", remedy=_SERIES)
    if (lines := raw.count(b"\n")) > MAX_LINES:
        raise CaseError(f"the file has {lines} lines; at most {MAX_LINES} are allowed", remedy=_SERIES)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CaseError(f"byte {error.start} is not UTF-8", remedy="Save the file as UTF-8 text.") from error


def _neighbour(path: Path) -> str:
    if not path.parent.is_dir():
        return f" There is no folder {shown(str(path.parent))}."
    files = (other for other in path.parent.iterdir() if other.is_file())
    return closest(path.name, (other.name for other in files if closest(path.stem, [other.stem])))  # endings are alike


def parse_yaml(text: str, kind: Kind = CASE) -> Document:
    """Return a YAML 1.2 text as a document."""
    lines: dict[Keys, int | None] = {}
    data = _yaml_value(text, lines)
    return Document(_mapping(data, kind), lines)


def parse_value(text: str) -> Any:
    """Return a value given on the command line, a YAML scalar or flow collection."""
    if len(text) > MAX_VALUE:
        raise CaseError(
            f"a value of {len(text)} characters; at most {MAX_VALUE} are allowed",
            remedy="Write long values into a case file.",
        )
    return _yaml_value(text, {})


def parse_json(text: str, kind: Kind = CASE) -> Document:
    """Return a JSON text as a document."""
    _limit_brackets(text)

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        items: dict[str, Any] = {}
        for key, value in pairs:
            if key in items:
                raise CaseError(f"the key {shown(key)} stands twice", remedy="Keep one of the two.")
            items[key] = value
        return items

    try:
        data = json.loads(text, object_pairs_hook=once, parse_constant=_refuse_constant)
    except CaseError as error:
        raise _placed_in_json(error, text) from None
    except json.JSONDecodeError as error:
        raise CaseError(f"not JSON: {error.msg}", remedy="Fix the text there.", line=error.lineno) from error
    except ValueError as error:
        raise CaseError(f"not JSON: {str(error)[:120]}", remedy=_REMEDY) from error
    check_tree(data)
    lines: dict[Keys, int | None] = {}
    try:
        _yaml_value(text, lines)  # JSON is YAML; read again for the lines alone
    except CaseError:
        lines = {}
    return Document(_mapping(data, kind), lines)


def _placed_in_json(error: CaseError, text: str) -> CaseError:
    """Return the error of a JSON text with its line: of a key that stands twice, or a number that is not finite."""
    constant = next((found for found in _JSON_WORD.finditer(text) if found.group()[0] != '"'), None)
    if error.text.endswith("finite number") and constant is not None:
        error.line = text.count("\n", 0, constant.start()) + 1
        return error
    try:
        _yaml_value(text, {})  # JSON is YAML, whose reader knows lines and path
    except CaseError as found:
        return found if "stands twice" in found.text else error
    return error


def parse_toml(text: str, kind: Kind = CASE) -> Document:
    """Return a TOML text as a document."""
    _limit_brackets(text)
    if text.count("=") + text.count(",") > MAX_VALUES:
        raise _too_many()
    dotted = _DOTTED.search(text)
    if dotted:
        raise _too_deep(text.count("\n", 0, dotted.start()) + 1)
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        found = re.search(r"at line (\d+)", str(error))
        line = int(found.group(1)) if found else None
        raise CaseError(f"not TOML: {str(error)[:120]}", remedy="Fix the text there.", line=line) from error
    check_tree(data)
    return Document(_mapping(data, kind), _toml_lines(text))


def _toml_lines(text: str) -> dict[Keys, int | None]:
    lines: dict[Keys, int | None] = {}
    table: Keys = ()
    counts: dict[Keys, int] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        header = re.match(r"\s*(\[{1,2})\s*([\w.\"' -]+?)\s*\]", line)
        key = re.match(r"\s*([\w.\"'-]+)\s*=", line)
        if header:
            table = _split(header.group(2))
            if header.group(1) == "[[":
                counts[table] = counts.get(table, -1) + 1
                table = (*table, str(counts[table]))
            lines.setdefault(table, number)
        elif key:
            lines.setdefault((*table, *_split(key.group(1))), number)
    return lines


def _split(dotted: str) -> Keys:
    return tuple(part.strip(" \"'") for part in dotted.split("."))


def _limit_brackets(text: str) -> None:
    depth = 0
    for found in _BRACKETS.finditer(text):
        depth += {"[": 1, "{": 1, "]": -1, "}": -1}.get(found.group(), 0)
        if depth > MAX_DEPTH:
            raise _too_deep(text.count("\n", 0, found.start()) + 1)


def _refuse_constant(name: str) -> Any:
    raise CaseError(f"{name} is not a finite number", remedy="Give a number.")


def _mapping(data: Any, kind: Kind) -> dict[str, Any]:
    if not isinstance(data, dict):
        raise CaseError(f"the file holds {shown(data)}; {kind.keys}", remedy=kind.remedy, line=1)
    return data


def _too_deep(line: int) -> CaseError:
    return CaseError(f"nested deeper than {MAX_DEPTH} levels, the most a case may have", remedy=_REMEDY, line=line)


def _too_many(line: int | None = None, most: int = MAX_VALUES) -> CaseError:
    return CaseError(f"more than {most} values, the most a case may have", remedy=_SERIES, line=line)


def check_tree(data: Any, most: int = MAX_VALUES) -> None:
    """Raise `CaseError` on too many values, or a key that cannot be shown."""
    count, waiting = 0, [data]
    while waiting:
        value = waiting.pop()
        count += 1
        if count > most:
            raise _too_many(most=most)
        if isinstance(value, dict):
            for key in value:
                _key(key, None)
        if isinstance(value, (dict, list)):
            waiting.extend(value.values() if isinstance(value, dict) else value)


def _yaml_value(text: str, lines: dict[Keys, int | None]) -> Any:
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    try:
        return _Composer(YAML(typ="rt", pure=True).parse(text), lines).document()
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = str(error.problem or error.context or "the text cannot be read")[:120]
        if "<block end>" in problem:
            problem = "this line is indented differently from the lines that it belongs to"
        remedy = "Fix the text there (or just above)."
        if mark and any(
            _INDENTED_BY_TAB.match(line) for line in text.splitlines()[max(0, mark.line - 1) : mark.line + 1]
        ):
            remedy = "Indent with spaces, not tabs."
        raise CaseError(f"not YAML: {problem}", remedy=remedy, line=mark.line + 1 if mark else None) from error
    except YAMLError as error:
        raise CaseError(
            f"not YAML: {str(error)[:120]}", remedy="Remove the characters that are not printable."
        ) from error
    except (ValueError, RecursionError) as error:
        raise CaseError(f"not YAML: {str(error)[:120]}", remedy="Fix the text.") from error


class _Composer:
    """Builds plain values from YAML events, within the limits."""

    def __init__(self, events: Iterator[Any], lines: dict[Keys, int | None]) -> None:
        self.events = events
        self.count = 0
        self.lines = lines

    def document(self) -> Any:
        value = None
        documents = 0
        for event in self.events:
            kind = type(event).__name__
            if kind == "DocumentStartEvent":
                documents += 1
                if event.version or event.tags:
                    raise CaseError("a % directive is not allowed", remedy=_REMEDY, line=event.start_mark.line + 1)
                if documents > 1:
                    raise CaseError(
                        "a second document begins here", remedy="A file holds one case.", line=event.start_mark.line + 1
                    )
            elif kind not in ("StreamStartEvent", "StreamEndEvent", "DocumentEndEvent"):
                value = self.node(event, (), 1)
        return value

    def node(self, event: Any, path: Keys, depth: int) -> Any:
        kind = type(event).__name__
        line = event.start_mark.line + 1
        self.count += 1
        if self.count > MAX_VALUES:
            raise _too_many(line)
        if kind == "AliasEvent":
            raise CaseError(
                f"the alias *{str(event.anchor)[:20]} is not allowed", remedy="Write the value out again.", line=line
            )
        if event.anchor is not None:
            raise CaseError(
                f"the anchor &{str(event.anchor)[:20]} is not allowed", remedy="Remove it; write values out.", line=line
            )
        if event.tag is not None:
            raise CaseError(
                f"the tag {shown(str(event.tag))} is not allowed", remedy=f"Remove it. {_REMEDY}", line=line
            )
        self.lines.setdefault(path, line)
        if kind == "ScalarEvent":
            return _scalar(event.value, path, plain=bool(event.implicit[0]), line=line)
        if depth > MAX_DEPTH:
            raise _too_deep(line)
        return self.sequence(path, depth) if kind == "SequenceStartEvent" else self.mapping(path, depth)

    def sequence(self, path: Keys, depth: int) -> list[Any]:
        items: list[Any] = []
        for event in self.events:
            if type(event).__name__ == "SequenceEndEvent":
                break
            items.append(self.node(event, (*path, str(len(items))), depth + 1))
        return items

    def mapping(self, path: Keys, depth: int) -> dict[str, Any]:
        items: dict[str, Any] = {}
        for event in self.events:
            if type(event).__name__ == "MappingEndEvent":
                break
            line = event.start_mark.line + 1
            if type(event).__name__ != "ScalarEvent" or event.anchor is not None or event.tag is not None:
                raise CaseError("a key that is not a plain word", remedy=_REMEDY, line=line)
            key = _key(str(event.value), line)
            if key in items:
                first = self.lines[(*path, key)]
                raise CaseError(
                    f"the key {shown(key)} stands twice (first in line {first})",
                    remedy="Keep one of the two.",
                    path=_dotted((*path, key)),
                    line=line,
                )
            self.lines[(*path, key)] = line
            items[key] = self.node(next(self.events), (*path, key), depth + 1)
        return items


def _key(key: str, line: int | None) -> str:
    """Return a key that is safe to show in a message, or refuse it."""
    if len(key) > MAX_KEY or not key.isprintable():
        raise CaseError(
            f"the key {shown(key)} is not a plain word of at most {MAX_KEY} characters", remedy=_REMEDY, line=line
        )
    return key


def check_texts(data: Any, path: Keys = ()) -> None:
    """Raise `CaseError` where a text holds a lone surrogate, which no output can show."""
    if isinstance(data, str):
        if data.isascii():
            return
        try:
            data.encode("utf-8")
        except UnicodeEncodeError:
            raise CaseError(
                f"{shown(data)} contains an incomplete Unicode character (lone surrogate)",
                remedy="Remove the characters that are not text.",
                path=_dotted(path),
            ) from None
    elif isinstance(data, dict):
        for key, value in data.items():
            check_texts(key, path)
            check_texts(value, (*path, key))
    elif isinstance(data, list):
        for number, value in enumerate(data):
            check_texts(value, (*path, str(number)))


def _dotted(path: Keys) -> str:
    """Return a path as a message shows it."""
    return ".".join(path)[:200]


def _scalar(text: str, path: Keys, *, plain: bool, line: int) -> Any:
    if not plain:
        return text
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _NOT_FINITE.fullmatch(text):
        raise CaseError(f"{text} is not a finite number", remedy="Give a number.", path=_dotted(path), line=line)
    if len(text) <= 400 and _FLOAT.fullmatch(text):
        number = float(text)
        if number in (float("inf"), float("-inf")):
            raise CaseError(
                f"{shown(text)} is beyond any number", remedy="Give a finite number.", path=_dotted(path), line=line
            )
        return number
    return text
