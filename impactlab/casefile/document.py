"""Reader of a case file's text: plain values with their lines.

Case files are data: no text in one is ever run.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from impactlab.casefile.starter import known_case
from impactlab.casefile.text.limits import MAX_DEPTH, MAX_VALUES, REMEDY, SERIES, Keys, check_tree, too_deep, too_many
from impactlab.casefile.text.words import shown
from impactlab.casefile.text.yaml_values import yaml_value
from impactlab.errors import CaseError, closest

ENDINGS = ".yaml", ".yml", ".toml", ".json"  # of case files
MAX_BYTES = 1_000_000  # bytes
MAX_LINES = 50_000
MAX_VALUE = 10_000  # characters of a value given on the command line

_JSON_WORD = re.compile(r'"(?:\\.|[^"\\])*"|-?Infinity|NaN')
_DOTTED = re.compile(rf"""(?:[\w"'-]+\s*\.\s*){{{MAX_DEPTH + 1}}}""")
_BRACKETS = re.compile(r"""[\[\]{}]|"(?:\\.|[^"\\\n])*"?|'(?:\\.|[^'\\\n])*'?""")  # brackets, and texts to skip


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
    readers = dict(zip(ENDINGS, (parse_yaml, parse_yaml, parse_toml, parse_json), strict=True))
    reader = readers.get(path.suffix.lower())
    if reader is None and path.is_dir():
        reader = parse_yaml  # its text is asked for, and refused
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
        if known_case(path.stem) is not None:
            remedy = f"Give {path.stem!r}, without its ending, for the case of that name that comes with impactlab."
        raise CaseError(f"the case file {what}.{_neighbour(path)}", remedy=remedy)
    with path.open("rb") as stream:
        raw = stream.read(MAX_BYTES + 1)
    if len(raw) > MAX_BYTES:
        raise CaseError(f"the file is larger than {MAX_BYTES} bytes, the most a case may have", remedy=SERIES)
    if (lines := raw.count(b"\n")) > MAX_LINES:
        raise CaseError(f"the file has {lines} lines; at most {MAX_LINES} are allowed", remedy=SERIES)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CaseError(f"byte {error.start} is not UTF-8", remedy="Save the file as UTF-8 text.") from error


def _neighbour(path: Path) -> str:
    if not path.parent.is_dir():
        return f" There is no folder {shown(str(path.parent))}."
    files = (other for other in path.parent.iterdir() if other.suffix.lower() in ENDINGS and other.is_file())
    return closest(path.name, (other.name for other in files if closest(path.stem, [other.stem])))  # endings are alike


def parse_yaml(text: str, kind: Kind = CASE, most: int = MAX_VALUES) -> Document:
    """Return a YAML 1.2 text of at most so many values as a document."""
    lines: dict[Keys, int | None] = {}
    data = yaml_value(text, lines, most)
    return Document(_mapping(data, kind), lines)


def parse_value(text: str) -> Any:
    """Return a value given on the command line, a YAML scalar or flow collection."""
    if len(text) > MAX_VALUE:
        raise CaseError(
            f"a value of {len(text)} characters; at most {MAX_VALUE} are allowed",
            remedy="Write long values into a case file.",
        )
    return yaml_value(text, {})


def parse_json(text: str, kind: Kind = CASE) -> Document:
    """Return a JSON text as a document."""
    _limit_brackets(text)

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        items: dict[str, Any] = {}
        for key, value in pairs:
            if key in items:
                raise CaseError(f"the key {shown(key)} is given twice", remedy="Keep one of the two.")
            items[key] = value
        return items

    try:
        data = json.loads(text, object_pairs_hook=once, parse_constant=_refuse_constant)
    except CaseError as error:
        raise _placed_in_json(error, text) from None
    except json.JSONDecodeError as error:
        raise CaseError(f"not JSON: {error.msg}", remedy="Fix the text there.", line=error.lineno) from error
    except ValueError as error:
        raise CaseError(f"not JSON: {str(error)[:120]}", remedy=REMEDY) from error
    check_tree(data)
    lines: dict[Keys, int | None] = {}
    try:
        yaml_value(text, lines)  # JSON is YAML; read again for the lines alone
    except CaseError:
        lines = {}
    return Document(_mapping(data, kind), lines)


def _placed_in_json(error: CaseError, text: str) -> CaseError:
    """Return the error of a JSON text with its line.

    It is a key that is given twice, or a number that is not finite.
    """
    constant = next((found for found in _JSON_WORD.finditer(text) if found.group()[0] != '"'), None)
    if error.text.endswith("finite number") and constant is not None:
        error.line = text.count("\n", 0, constant.start()) + 1
        return error
    try:
        yaml_value(text, {})  # JSON is YAML, whose reader knows lines and path
    except CaseError as found:
        return found if "is given twice" in found.text else error
    return error


def parse_toml(text: str, kind: Kind = CASE) -> Document:
    """Return a TOML text as a document."""
    _limit_brackets(text)
    if text.count("=") + text.count(",") > MAX_VALUES:
        raise too_many()
    dotted = _DOTTED.search(text)
    if dotted:
        raise too_deep(text.count("\n", 0, dotted.start()) + 1)
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
            raise too_deep(text.count("\n", 0, found.start()) + 1)


def _refuse_constant(name: str) -> Any:
    raise CaseError(f"{name} is not a finite number", remedy="Give a number.")


def _mapping(data: Any, kind: Kind) -> dict[str, Any]:
    if not isinstance(data, dict):
        raise CaseError(f"the file holds {shown(data)}; {kind.keys}", remedy=kind.remedy, line=1)
    return data
