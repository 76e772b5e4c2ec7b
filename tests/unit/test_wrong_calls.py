"""Wrong calls of public classes name the parameters, in place of Python's TypeError."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import pytest

import impactlab as il
from impactlab.errors import CaseError


@pytest.mark.parametrize(
    ("call", "text", "remedy"),
    [
        (lambda: il.Rod("20 mm", "2 m"), "without the name of its parameter: '20 mm', '2 m'", "Write Rod(length=..."),  # type: ignore[call-arg]
        (lambda: il.Mass(1.0, 2.0), "without the name of its parameter: 2.0", "Write Mass(mass, velocity=..."),  # type: ignore[call-arg]
        (lambda: il.hopkinson.Bar(material="steel"), "Bar has no parameter 'material'", "Bar(diameter, wave_speed"),  # type: ignore[call-arg]
        (lambda: il.hopkinson.Bar("20 mm"), "Bar needs wave_speed and density too", "Bar(diameter, wave_speed"),  # type: ignore[call-arg]
        (lambda: il.hopkinson.Specimen(), "Specimen needs length and diameter", "Specimen(length, diameter)"),  # type: ignore[call-arg]
        (lambda: il.Contact("hammer"), "Contact needs right too", "Write Contact(left, right, law"),  # type: ignore[call-arg]
        (lambda: il.Signal("force:a|b", value=[1.0]), "Did you mean 'values'?", "Signal(channel, time, values"),  # type: ignore[call-arg]
        (lambda: il.Case(bodes={}), "Case needs bodies and solve too", "Write Case(bodies=..."),  # type: ignore[call-arg]
    ],
)
def test_a_wrong_call_names_the_parameters(call: Callable[[], Any], text: str, remedy: str) -> None:
    with pytest.raises(CaseError) as caught:
        call()
    assert text in caught.value.text
    assert remedy in caught.value.remedy


def test_signatures_stay_those_of_the_parameters() -> None:
    assert [*inspect.signature(il.Mass).parameters] == ["mass", "velocity", "rotation", "repeat", "others"]
    assert [*inspect.signature(il.Signal).parameters][:3] == ["channel", "time", "values"]


def test_a_type_error_of_a_right_call_is_not_hidden() -> None:
    class Broken(il.Mass):
        def __init__(self) -> None:
            raise TypeError("inside")

    with pytest.raises(TypeError, match="inside"):
        Broken()
