"""Reader of YAML 1.2, event by event.

Limits, tags, anchors and double keys are refused before any value is built. Numbers are read by the core rules of YAML
1.2: ``2.1e11`` and ``1e-3`` are numbers, ``on`` is a text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from impactlab.casefile.text.limits import MAX_DEPTH, MAX_VALUES, REMEDY, Keys, dotted, plain_key, too_deep, too_many
from impactlab.casefile.text.words import shown
from impactlab.errors import CaseError

_INTEGER = re.compile(r"[-+]?[0-9]{1,400}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_WORDS: dict[str, bool | None] = {"": None, "~": None, "null": None, "Null": None, "NULL": None}
_WORDS |= {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
_INDENTED_BY_TAB = re.compile(r" *\t")
_TWO_COLONS = re.compile(r"\s*(?:- +)?([\w.-]+):\s+(\S.*:(?:\s.*)?)")  # a key, and a text with a colon

_NO_COLON = re.compile(r"([\w.-]+) +[{\[].*")  # a key and its block


def yaml_value(text: str, lines: dict[Keys, int | None], most: int = MAX_VALUES) -> Any:
    """Return the plain value of a text of at most so many values; write the line of each key into ``lines``."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    fault: Any = None
    try:
        for reader in ("safe", "rt"):  # the second is slower by a third, looks further ahead and knows more of a fault
            try:
                return _Composer(YAML(typ=reader, pure=True).parse(text), lines, most).document()
            except MarkedYAMLError as error:
                fault = error
        raise _marked(fault, text.splitlines()) from fault
    except YAMLError as error:
        raise CaseError(
            f"not YAML: {str(error)[:120]}", remedy="Remove the characters that are not printable."
        ) from error
    except (ValueError, RecursionError) as error:
        raise CaseError(f"not YAML: {str(error)[:120]}", remedy="Fix the text.") from error


def _marked(error: Any, lines: list[str]) -> CaseError:
    """Return the fault of a text that is not YAML, with its line."""
    mark = error.problem_mark or error.context_mark
    problem = str(error.problem or error.context or "the text cannot be read")[:120]
    remedy = "Fix the text there (or just above)."
    number = mark.line if mark else 0
    start = error.context_mark.line if error.context_mark else number
    before = lines[number][: mark.column] if mark and number < len(lines) else ""
    if "<block end>" in problem and before.strip():
        problem = f"{shown(lines[number][mark.column :].strip())} stands behind the end of a value"
        remedy = "Remove it, or put the whole value in quotes."
    elif "<block end>" in problem:
        problem = "this line is indented differently from the lines that it belongs to"
    elif problem.startswith("mapping values") and mark:
        found = _TWO_COLONS.fullmatch(lines[number])
        if found and found[2][0] in "[{":
            problem = f"a second key stands in the line of {shown(found[1])}"
            remedy = "Write each key in a line of its own, or all of them in braces: {key: value, key: value}."
        elif found:
            problem = "a text with a colon in it begins a second key"
            remedy = f"Put the text in quotes: {found[1]}: '{found[2].strip()}'."
        elif found := _NO_COLON.fullmatch(lines[number]):
            problem = f"a colon is missing behind {shown(found[1])}"
            remedy = f"Write {found[1]}: {{key: value}}."
        else:
            problem = "this line is indented as a part of the value above it"
            remedy = "Align it with the key that it belongs beside, or put that value in quotes."
    elif problem.startswith("expected ',' or") and (start < number or "<stream end>" in problem):
        bracket = "}" if "'}'" in problem else "]"
        opened = f", opened in line {start + 1}," if start < number else ""
        problem = f"a bracket{opened} is not closed: {bracket} is missing"
        remedy = f"Write {bracket} at the end of the block."
    elif problem.startswith("expected ',' or"):
        remedy = "Write a comma between two keys or values, and close each bracket."
    elif "end of stream" in problem:
        problem, remedy = "a quote is not closed", "Close it where the text ends."
    elif "'\\t'" in problem:
        remedy = "Write a space in place of the tab."
    if mark and any(_INDENTED_BY_TAB.match(line) for line in lines[max(0, number - 1) : number + 1]):
        remedy = "Indent with spaces, not tabs."
    return CaseError(f"not YAML: {problem}", remedy=remedy, line=number + 1 if mark else None)


class _Composer:
    """Builds plain values from YAML events, within the limits."""

    def __init__(self, events: Iterator[Any], lines: dict[Keys, int | None], most: int) -> None:
        self.events, self.most = events, most
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
                    raise CaseError("a % directive is not allowed", remedy=REMEDY, line=event.start_mark.line + 1)
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
        if self.count > self.most:
            raise too_many(line, self.most)
        if kind == "AliasEvent":
            raise CaseError(
                f"the alias *{str(event.anchor)[:20]} is not allowed", remedy="Write the value out again.", line=line
            )
        if event.anchor is not None:
            raise CaseError(
                f"the anchor &{str(event.anchor)[:20]} is not allowed", remedy="Remove it; write values out.", line=line
            )
        if event.tag is not None:
            raise CaseError(f"the tag {shown(str(event.tag))} is not allowed", remedy=f"Remove it. {REMEDY}", line=line)
        self.lines.setdefault(path, line)
        if kind == "ScalarEvent":
            return _scalar(event.value, path, plain=bool(event.implicit[0]), line=line)
        if depth > MAX_DEPTH:
            raise too_deep(line)
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
                raise CaseError("a key that is not a plain word", remedy=REMEDY, line=line)
            key = plain_key(str(event.value), line)
            if key in items:
                first = self.lines[(*path, key)]
                raise CaseError(
                    f"the key {shown(key)} is given twice (first in line {first})",
                    remedy="Keep one of the two.",
                    path=dotted((*path, key)),
                    line=line,
                )
            self.lines[(*path, key)] = line
            items[key] = self.node(next(self.events), (*path, key), depth + 1)
        return items


def _scalar(text: str, path: Keys, *, plain: bool, line: int) -> Any:
    if not plain:
        return text
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _NOT_FINITE.fullmatch(text):
        raise CaseError(f"{text} is not a finite number", remedy="Give a number.", path=dotted(path), line=line)
    if len(text) <= 400 and _FLOAT.fullmatch(text):
        number = float(text)
        if number in (float("inf"), float("-inf")):
            raise CaseError(
                f"{shown(text)} is beyond any number", remedy="Give a finite number.", path=dotted(path), line=line
            )
        return number
    return text
