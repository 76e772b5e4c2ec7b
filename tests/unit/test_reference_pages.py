"""Pages of the reference that the site makes from the code: fields of records with their units, commands."""

import re

import pytest
import typer

from impactlab.cli import app
from tests.support import DOCS


@pytest.fixture
def extensions(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS / "_ext"))


def test_fields_of_records_have_the_comments_behind_them(extensions):
    from fields import fields_of

    source = 'class Blow:\n    """One µm."""\n\n    work: float = 0.0  # J, µ\n    _own: int\n'
    source += "    loop: Loop | None = (\n        None  # not this\n    )  # of the rock\n    name: str\n"
    source += "    exact: ClassVar[bool] = False  # not inherited;\n    # unless stated\n\n    # of more\n"
    fields = [("work", "float", "J, µ"), ("loop", "Loop | None", "of the rock"), ("name", "str", "")]
    assert fields_of(source) == [*fields, ("exact", "bool", "not inherited; unless stated")]


def test_a_record_gets_its_fields_unless_its_docstring_has_them(extensions):
    from fields import add

    from impactlab.history.base import ContactSpan

    lines = ["One period of contact."]
    add(None, "class", "", ContactSpan, None, lines)
    assert lines[2:4] == ["Attributes", "----------"]
    assert lines[lines.index("impulse : float") + 1] == "    N s"
    own = ["A bar.", "", "Parameters", "----------"]
    add(None, "class", "", ContactSpan, None, own)
    assert own[-1] == "----------"


def test_the_page_of_commands_has_every_option(extensions):
    from command_help import page

    text = page()
    for name, command in typer.main.get_command(app).commands.items():
        section = re.search(rf"## `{name}`\n(.*?)(?=\n## |\Z)", text, re.DOTALL)
        assert section, name
        for parameter in command.params:
            assert any(option in section[1] for option in (*parameter.opts, str(parameter.metavar))), (name, parameter)


def test_the_page_of_commands_is_in_the_site():
    assert "\ncommands\n" in (DOCS / "index.md").read_text(encoding="utf-8")
    assert "<!-- made: commands -->" in (DOCS / "commands.md").read_text(encoding="utf-8")
