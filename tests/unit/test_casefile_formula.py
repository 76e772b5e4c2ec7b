"""Formulas of x are data: a short list of what they may hold, walked with numpy, never run as code."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from impactlab.casefile.values import formula as formula_module
from impactlab.casefile.values.formula import Formula, parse


@pytest.mark.parametrize(
    ("text", "function"),
    [
        ("0", lambda x: 0.0 * x),
        ("x", lambda x: x),
        ("1e-5*sin(2*pi*x/L)", lambda x: 1e-5 * np.sin(2 * np.pi * x / 0.5)),
        ("-x**2 + 3*x - +1", lambda x: -(x**2) + 3 * x - 1),
        ("exp(-abs(x - L/2)/0.1)", lambda x: np.exp(-abs(x - 0.25) / 0.1)),
        ("sqrt(x)*cos(x)**2/4", lambda x: np.sqrt(x) * np.cos(x) ** 2 / 4),
        ("(x + 1)**-2", lambda x: (x + 1.0) ** -2),
        ("(x + 1)**0.5", lambda x: (x + 1.0) ** 0.5),
    ],
)
def test_formulas_are_evaluated_along_the_rod(text, function):
    x = np.linspace(0.0, 0.5, 11)
    values = Formula(text, 0.5)(x)
    np.testing.assert_allclose(values, function(x), rtol=1e-14)
    assert values.shape == x.shape
    assert values.dtype == float


REFUSED = [
    ("__import__('os').system('id')", "the formula calls"),
    ("open('/etc/passwd')", "functions allowed: abs, cos, exp, sin, sqrt"),
    ("().__class__", "the formula holds"),
    ("x.__class__", "the formula holds 'x.__class__'"),
    ("sin.__globals__", "the formula holds"),
    ("sin", "the formula names 'sin'"),
    ("y", "the formula names 'y'"),
    ("x[0]", "the formula holds 'x[0]'"),
    ("[x for x in (1,2)]", "the formula holds"),
    ("lambda: 0", "the formula holds"),
    ("x if x else 1", "the formula holds"),
    ("x < 1", "the formula holds 'x < 1'"),
    ("x and 1", "the formula holds"),
    ("x := 1", "is not a formula"),
    ("x = 1", "is not a formula"),
    ("'x'", "the formula holds"),
    ("f'{x}'", "the formula holds"),
    ("True", "the formula holds true"),
    ("1j", "the formula holds 1j"),
    ("x^2", "write a power as **"),
    ("x % 2", "the formula holds"),
    ("x // 2", "the formula holds"),
    ("x @ x", "the formula holds"),
    ("~x", "the formula holds"),
    ("sin(x, x)", "sin() in a formula takes one value"),
    ("sin(x=1)", "sin() in a formula takes one value"),
    ("sin(*x)", "the formula holds"),
    ("2**x", "the exponent x is not a number"),
    ("9**9**9", "exponents are plain numbers"),
    ("9**999999999", "is too large; at most 20 is allowed"),
    ("9**-999999999", "is too large; at most 20 is allowed"),
    ("1e999", "not a finite number"),
    ("1" + "0" * 390, "not a finite number"),
    ("", "is not a formula"),
    ("x\n+1;", "is not a formula"),
    ("x\0", "is not a formula"),
    ("(" * 190 + "x" + ")" * 190, ""),
    ("-" * 399 + "x", "the formula"),
    ("+".join(["x"] * 190), "at most 150 are allowed"),
    ("x" * 401, "at most 400 are allowed"),
]


@pytest.mark.parametrize(("text", "says"), REFUSED, ids=[str(number) for number in range(len(REFUSED))])
def test_all_else_is_refused_before_it_is_evaluated(text, says, monkeypatch):
    if says:
        monkeypatch.setattr(formula_module, "_evaluate", pytest.fail)
        with pytest.raises(ValueError) as caught:
            parse(text)
        assert says.strip("'") in str(caught.value).replace("'x'", "x") or says in str(caught.value)
        assert len(str(caught.value)) < 300
    else:
        Formula(text, 1.0)(np.zeros(2))


@given(st.text(max_size=60))
def test_any_text_is_a_formula_or_a_value_error(text):
    try:
        formula = Formula(text, 1.0)
    except ValueError:
        return
    assert formula(np.linspace(0.0, 1.0, 5)).shape == (5,)


def test_formulas_travel_to_other_processes():
    formula = Formula("x**2", 1.0)
    copy = pickle.loads(pickle.dumps(formula))
    assert copy == formula
    assert copy(np.array([3.0]))[0] == 9.0
