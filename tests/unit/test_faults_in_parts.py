"""A fault in the code of a part is told with its file and line."""

from __future__ import annotations

import math

import pytest

from impactlab.cite import OWN, bibtex
from impactlab.errors import PluginError, raised_at
from impactlab.numerics.addresses import LawAddress


def misspelt(port, reply):
    reply.force = -port.gaap


def undefined(port, reply):
    reply.force = no_such_name * port.gap  # noqa: F821


@pytest.mark.parametrize(
    ("respond", "text"),
    [(misspelt, "no field 'gaap'. Did you mean 'gap'?"), (undefined, "name 'no_such_name' is not defined")],
)
def test_code_that_cannot_be_compiled(respond, text):
    with pytest.raises(PluginError) as raised:
        LawAddress(respond, as_compiled=True)
    assert text in str(raised.value)
    assert f"{__file__}, line {respond.__code__.co_firstlineno}" in str(raised.value).replace(
        f"line {respond.__code__.co_firstlineno + 1}", f"line {respond.__code__.co_firstlineno}"
    )


def test_an_exception_is_told_with_file_and_line():
    with pytest.raises(ValueError, match="math") as raised:
        math.sqrt(-1.0)
    line = raised.value.__traceback__.tb_lineno
    assert raised_at(raised.value) == f"ValueError: {raised.value} ({__file__}, line {line})"


def test_an_unpublished_part_is_cited_as_such():
    found = bibtex([OWN, "Goldsmith1960"])
    assert found.keys == ("Goldsmith1960",)
    assert "unpublished" in found.bibtex
