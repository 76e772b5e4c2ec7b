"""Units pass one strict pattern before pint sees them."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

import impactlab as il
from impactlab.casefile.values import units, usual_units
from impactlab.casefile.values.units import to_si
from impactlab.casefile.values.usual_units import usual_factor


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("210 GPa", "Pa", 2.1e11),
        ("210GPa", "Pa", 2.1e11),
        ("0.3 m", "m", 0.3),
        ("58 us", "s", 58e-6),
        ("58 µs", "s", 58e-6),
        ("9 cm^2", "m2", 9e-4),
        ("9 cm2", "m2", 9e-4),
        ("9 cm**2", "m2", 9e-4),
        ("9cm²", "m2", 9e-4),
        ("7.9 g/cm³", "kg/m3", 7900.0),
        ("3 m·s⁻¹", "m/s", 3.0),
        ("7.9 g/cm^3", "kg/m3", 7900.0),
        ("1 kN/mm", "N/m", 1e6),
        ("2 N s/m", "N s/m", 2.0),
        ("2 N*s/m", "N s/m", 2.0),
        ("-9.81 m/s2", "m/s2", -9.81),
        ("1 inch", "m", 0.0254),
        (" 1e-3 km ", "m", 1.0),
        ("500 1/s", "1/s", 500.0),
        ("2 1/ms", "1/s", 2000.0),
        ("2 s^-1", "1/s", 2.0),
    ],
)
def test_numbers_with_units(text, unit, value):
    assert to_si(text, unit) == value


@pytest.mark.parametrize(
    ("text", "unit", "why"),
    [
        ("5 ton", "kg", "may be a metric, short or long ton: write t for 1000 kg"),
        ("-5 grad", "rad", "may be degrees or gon"),
        ("10 Hz", "rad/s", "may count turns or radians"),
        ("2 kHz", "rad/s", "may count turns or radians"),
        ("60 rpm", "Hz", "is an angular rate"),
        ("3 rad/s", "Hz", "is an angular rate"),
        ("3 deg/ms", "Hz", "is an angular rate"),
    ],
)
def test_units_of_two_meanings_are_refused(text, unit, why):
    with pytest.raises(ValueError, match=why):
        to_si(text, unit)


@pytest.mark.parametrize(("text", "unit", "value"), [("30 rpm", "rad/s", 3.1415926535898), ("2 MHz", "Hz", 2e6)])
def test_rates_and_frequencies_have_units_of_their_own(text, unit, value):
    assert to_si(text, unit) == value


@pytest.mark.parametrize(
    "text",
    [
        "0,3 m", "9**9**9", "9**9**9 m", "9 m**9**9", "9 m^99999", "(3 m)", "3 m + 2 m", "3*4 m", "m", "", "3", "3 m;",
        "__import__('os')", "3 __m", "nan m", "inf m", "1e9999 m", "0x3 m", "3 " + "m" * 100, "3 m\n4 m", "٣ m",
        "10² m", "3 1/m 1/m", "31/m", "3 2/m", "3 m^²", "3 m⁹⁹⁹", "3 m⁻", "² m",
    ],
)  # fmt: skip
def test_all_else_is_refused_and_no_large_power_is_computed(text, monkeypatch):
    def factor(given, wanted):
        assert max(map(int, re.findall("[0-9]+", given)), default=1) <= 9
        return units_factor(given, wanted)

    units_factor = units._factor
    monkeypatch.setattr(units, "_factor", factor)
    with pytest.raises(ValueError, match=r"allowed: a number in m, or a number and a unit such as '30 cm'"):
        to_si(text, "m")


def test_reasons():
    with pytest.raises(ValueError, match=r"write the decimal point as '\.'"):
        to_si("0,3 m", "m")
    with pytest.raises(ValueError, match="'3 kg' has a unit of another dimension"):
        to_si("3 kg", "m")
    with pytest.raises(ValueError, match="has a unit that is not known"):
        to_si("3 wombats", "m")
    with pytest.raises(ValueError, match="is beyond any finite number"):
        to_si("1e308 km", "m")


def test_pint_is_imported_only_for_a_unit_that_is_not_usual():
    code = (
        "import sys; from impactlab import load_case; from impactlab.casefile.values.units import to_si; "
        "load_case('cases/free_rod.yaml'); assert 'pint' not in sys.modules; "
        "to_si('1 inch', 'm'); assert 'pint' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


BASE = ("kg", "m", "s", "rad", "Hz")  # of the powers of a usual unit


def by_pint(given: str, wanted: str) -> float:
    """Return the factor that pint gives between two units."""
    return float(units._units().Quantity(1.0, given).to(wanted).magnitude)


@pytest.mark.parametrize("name", usual_units._UNITS)
def test_usual_units_are_those_of_pint(name):
    powers = zip(BASE, usual_units._UNITS[name].powers, strict=True)
    wanted = "*".join(f"{base}**{power}" for base, power in powers if power)
    assert usual_factor(name, wanted) == pytest.approx(by_pint(name, wanted), rel=1e-15)


TERMS = st.lists(
    st.tuples(st.sampled_from([*usual_units._UNITS]), st.sampled_from((1, 2, 3, -1, 1.5, 2.5)), st.sampled_from("*/")),
    min_size=1,
    max_size=4,
)


@given(TERMS)
def test_products_of_usual_units_are_those_of_pint(terms):
    """Each term against the same one without prefix, so that both texts have one dimension."""
    plain = {"g": "kg", "t": "kg", "min": "s", "deg": "rad"}
    texts = {"given": "", "wanted": ""}
    for name, power, sign in terms:
        of = next(each for each in sorted(usual_units._NAMED, key=len, reverse=True) if name.endswith(each))
        for text, unit in (("given", name), ("wanted", plain.get(of, of))):
            texts[text] += (sign if texts[text] else "") + unit + (f"**{power:g}" if power != 1 else "")
    assert usual_factor(**texts) == pytest.approx(by_pint(**texts), rel=4e-15)


@pytest.mark.parametrize(
    ("one", "other"), [("m", "s"), ("1/s", "rad/s"), ("Hz", "1/s"), ("rpm", "Hz"), ("ton", "kg"), ("", "m")]
)
def test_units_outside_the_table_are_left_to_pint(one, other):
    assert usual_factor(one, other) is None


@pytest.mark.parametrize(
    ("law", "key", "unit"),
    [
        ({"flow": {"yield_stress": 5e7, "hardening": 1e9}}, "flow.yield_stress", "Pa"),
        ({"flow": {"strain": [0, 0.1], "stress": [1e8, 2e8]}}, "flow.stress", "Pa"),
        ({"flow": {"kind": "johnson_cook", "A": 9e7, "C": 0.02}}, "flow.reference_rate", "1/s"),
        ({"flow": {"yield_stress": 5e7}, "rate": {"kind": "cowper_symonds", "D": 6500, "q": 4}}, "rate.D", "1/s"),
        ({"flow": {"yield_stress": 5e7}}, "flow.unknown", ""),
        ({"flow": {"yield_stress": 5e7}}, "rate.D", ""),
        ({"flow": {"yield_stress": 5e7}}, "young", "Pa"),
    ],
)
def test_numbers_of_the_records_in_a_law_have_units(law, key, unit):
    """Bounds of a fit such as 40 MPa were refused there, and tables had no unit."""
    specimen = {"kind": "specimen", "length": 5e-3, "area": 1e-4, "young": 7e10, **law}
    case = il.Case(
        bodies={"hammer": il.Mass(1.0, velocity=2.0), "wall": il.Wall()},
        contacts=[il.Contact("hammer", "wall", specimen)],
        solve={"duration": 1e-4, "integrator": {"kind": "newmark"}, "step": {"dt": 1e-6}},
    )
    assert case.unit_of(f"contacts.0.law.{key}") == unit


@pytest.mark.parametrize(("law", "unit"), [({}, "N/m^1.5"), ({"exponent": 1.25}, "N/m^1.25")])
def test_a_stiffness_with_an_exponent_has_the_unit_of_its_number(law, unit):
    """Bounds of a fit such as 30 kN/mm^1.5 were refused."""
    case = il.Case(
        bodies={"hammer": il.Mass(1.0, velocity=2.0), "wall": il.Wall()},
        contacts=[il.Contact("hammer", "wall", {"kind": "hertz", "stiffness": 1e9, **law})],
        solve={"duration": 1e-4, "integrator": {"kind": "newmark"}, "step": {"dt": 1e-6}},
    )
    assert case.unit_of("contacts.0.law.stiffness") == unit
    assert to_si(f"1 k{unit}", unit) == 1000.0
