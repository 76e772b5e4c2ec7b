"""Texts become plain values with lines, within limits; whatever could run or grow is refused."""

from __future__ import annotations

import pytest

from impactlab.casefile import document
from impactlab.casefile.document import parse_json, parse_toml, parse_value, parse_yaml
from impactlab.casefile.text import yaml_values
from impactlab.errors import CaseError


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2.1e11", 2.1e11),
        ("1e-3", 1e-3),
        ("1E5", 1e5),
        ("12", 12),
        ("-.5", -0.5),
        ("on", "on"),
        ("yes", "yes"),
        ("true", True),
        ("null", None),
        ("", None),
        ("'12'", "12"),
        ("1_000", "1_000"),
        ("0x10", "0x10"),
        ("1:30", "1:30"),
        ("2001-01-01", "2001-01-01"),
        ("[1, {a: b}]", [1, {"a": "b"}]),
    ],
)
def test_scalars_follow_the_core_rules_of_yaml_1_2(text, value):
    assert parse_value(text) == value
    assert type(parse_value(text)) is type(value)


def test_merge_keys_are_plain_keys():
    assert parse_yaml("<<: {a: 1}\nb: 2").data == {"<<": {"a": 1}, "b": 2}


def test_lines_of_keys():
    document = parse_yaml("a: 1\nb:\n  c:\n    - x: 1\n    - {y: 2,\n       z: 3}\n")
    assert document.lines[("a",)] == 1
    assert document.lines[("b", "c", "0", "x")] == 4
    assert document.lines[("b", "c", "1", "z")] == 6


def test_toml_has_lines_too():
    document = parse_toml("a = 1\n[b]\nc.d = 2\n[[e]]\nf = 3\n[[e]]\nf = 4\n")
    assert document.lines[("a",)] == 1
    assert document.lines[("b", "c", "d")] == 3
    assert document.lines[("e", "1", "f")] == 7


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{a: 1, a: 2}", "the key 'a' is given twice"),
        ("? [a]\n: 1", "a key that is not a plain word"),
        ("%YAML 1.1\n---\na: 1", "a % directive"),
        ("a: !!float 3", "the tag"),
        ("!x {a: 1}", "the tag"),
        ("!!str a: 1", "a key that is not a plain word"),
        ("&k a: 1", "a key that is not a plain word"),
        ("- 1", "a list of 1"),
        ("a: 1\n\tb: 2", "not YAML"),
        ("a: 'x", "not YAML"),
        ("a: }", "not YAML"),
    ],
)
def test_yaml_that_is_refused(text, says):
    with pytest.raises(CaseError) as caught:
        parse_yaml(text)
    assert says in str(caught.value)
    assert caught.value.line is not None


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        ("title: Exercise 1: steel\na: 1", 1, "Put the text in quotes: title: 'Exercise 1: steel'."),
        ("title: rods\n  solve: 1", 2, "this line is indented as a part of the value above it"),
        ("a: {b: 1}\nsolve {duration: 1, x: 9}", 2, "a colon is missing behind 'solve'\nWrite solve: {key: value}."),
        ("a: [b, c] law: {kind: x}", 1, "a second key stands in the line of 'a'"),
        ("a:\n  x: {b: 1, c: 2\n  y: 3", 3, "a bracket, opened in line 2, is not closed: } is missing"),
        ("x: [1, 2\ny: 3", 2, "a bracket, opened in line 1, is not closed: ] is missing"),
        ("x: {a: 1 m b: 2}", 1, "Write a comma between two keys"),
        ("a: 'it's'", 1, "stands behind the end of a value"),
        ("a: 'x", 1, "a quote is not closed"),
        ("a:\t3", 1, "Write a space in place of the tab."),
        ("a:\n\tb: 3", 2, "Indent with spaces, not tabs."),
        ("a:\n  b: 1\n c: 2", 3, "this line is indented differently from the lines that it belongs to"),
    ],
)
def test_text_that_is_not_yaml_is_named_with_its_line(text, line, says):
    with pytest.raises(CaseError) as caught:
        parse_yaml(text)
    assert says in str(caught.value)
    assert caught.value.line == line


@pytest.mark.parametrize(
    "text", ["[" * 100_000, "{a: " * 50_000, "- " * 100_000, "a: " + "[{a: " * 10_000, "? " * 100_000]
)
def test_deep_yaml_is_refused_where_it_becomes_too_deep(text, monkeypatch):
    made = []

    class Counted(yaml_values._Composer):
        def __init__(self, *given):
            super().__init__(*given)
            made.append(self)

    monkeypatch.setattr(yaml_values, "_Composer", Counted)
    with pytest.raises(CaseError):
        parse_yaml(text)
    assert made[0].count <= 2 * yaml_values.MAX_DEPTH


@pytest.mark.parametrize(
    ("parse", "text"),
    [
        (parse_json, "[" * 100_000 + "]" * 100_000),
        (parse_json, '{"a":' * 100_000),
        (parse_toml, "a = " + "[" * 100_000),
        (parse_toml, "a = " + "{a = " * 50_000),
        (parse_toml, ".".join(["a"] * 50_000) + " = 1"),
        (parse_toml, "[" + ".".join(["a"] * 50_000) + "]"),
    ],
)
def test_deep_json_and_toml_are_refused_before_they_are_parsed(parse, text, monkeypatch):
    monkeypatch.setattr(document.json, "loads", pytest.fail)
    monkeypatch.setattr(document.tomllib, "loads", pytest.fail)
    with pytest.raises(CaseError, match="nested deeper than 24 levels"):
        parse(text)


def test_brackets_in_texts_are_no_nesting():
    assert parse_json('{"a": "' + "[" * 100 + '"}').data == {"a": "[" * 100}
    assert parse_toml("a = '" + "[" * 100 + "'").data == {"a": "[" * 100}


def test_json_that_is_refused():
    with pytest.raises(CaseError, match="the key 'a' is given twice"):
        parse_json('{"a": 1, "a": 2}')
    with pytest.raises(CaseError, match="NaN is not a finite number"):
        parse_json('{"a": NaN}')
    for text, line, path in (
        ('{"NaN": 1,\n"a": "\\" NaN",\n"b": -Infinity}', 3, ""),
        ('{"a": {\n"b": 1,\n"c": 2,\n"b": 3}}', 4, "a.b"),
    ):
        with pytest.raises(CaseError) as caught:
            parse_json(text)
        assert (caught.value.line, caught.value.path) == (line, path)
    with pytest.raises(CaseError, match="not JSON") as caught:
        parse_json('{\n"a": 1,\nb}')
    assert caught.value.line == 3


def test_toml_that_is_refused():
    with pytest.raises(CaseError, match="not TOML") as caught:
        parse_toml("a = 1\na = 2\n")
    assert caught.value.line == 2


def test_values_of_the_command_line_are_short():
    with pytest.raises(CaseError, match="at most 10000 are allowed"):
        parse_value("x" * 10_001)
