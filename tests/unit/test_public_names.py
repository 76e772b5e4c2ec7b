"""Completion and `help` of packages list their public names; reprs of results are one line."""

from __future__ import annotations

import pydoc
import subprocess
import sys
from importlib import import_module

import numpy as np
import pytest

import impactlab as il
from impactlab import drilling, granular, hopkinson, piling
from impactlab.derivatives.table import Sensitivities, Sensitivity
from impactlab.fits.result import Fitted
from impactlab.history.base import BranchChange, Cost, Event
from impactlab.history.choice import Choice
from impactlab.history.energy import EnergyBook, EnergyEnds
from impactlab.history.instruments import Measured
from impactlab.scene.method import Method
from impactlab.startup.lazy import public_names
from impactlab.sweeps import Sampled

PACKAGES = ("hopkinson", "piling", "drilling", "granular", "integrators", "simulate")


@pytest.mark.parametrize("name", PACKAGES)
def test_completion_lists_the_public_names_alone(name: str) -> None:
    package = import_module(f"impactlab.{name}")
    assert dir(package) == sorted(package.__all__)
    assert all(hasattr(package, each) for each in dir(package))


@pytest.mark.parametrize("name", [each for each in PACKAGES if each != "simulate"])
def test_the_docstring_has_a_line_for_each_public_name(name: str) -> None:
    package = import_module(f"impactlab.{name}")
    lines = (package.__doc__ or "").splitlines()
    for each in package.__all__:
        assert any(each in line.split("  ")[0].split(", ") or f"({each})" in line for line in lines), each


def test_help_documents_functions_that_are_imported_on_first_use() -> None:
    text = pydoc.render_doc(hopkinson, renderer=pydoc.plaintext)
    assert "    measured(\n" in text or "    measured(incident_gauge" in text
    assert "Return the waves at the specimen from one gauge on each bar." in text
    assert "class Specimen" in text


def test_modules_of_applications_need_no_import_of_their_own() -> None:
    used = "il.granular.sphere_mass(1.0, 3000.0), il.piling.blow.__name__, 'hopkinson' in dir(il)"
    code = f"import impactlab as il; print({used})"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.split() == [str(granular.sphere_mass(1.0, 3000.0)), "blow", "True"]


def test_a_changed_list_does_not_change_the_names() -> None:
    listed = public_names(["b", "a"])
    listed().append("c")
    assert listed() == ["a", "b"]


def test_reprs_of_results_with_arrays_are_one_line() -> None:
    n = 1000
    t, names = 1e-6 * np.arange(n), tuple(f"bead_{number}|bead_{number + 1}" for number in range(n))
    wave = granular.LeadingWave(names, t, np.linspace(1200.0, 900.0, n))
    assert repr(wave) == (
        "<LeadingWave along 1000 contacts, 0 to 999 µs: largest forces 1.2 kN in the first, 900 N in the last>"
    )
    one = piling.Driven(5e-3, 5e-3, 2e4, t, np.zeros(n - 1), {"toe": 2e4})
    assert repr(one) == "<Driven: head 5 mm, toe 5 mm, 20 kN left at the toe>"
    assert repr(piling.Driving((one, one, one))) == (
        "<Driving of 3 blows: set 5 mm from blow 1 on, 200 blows per metre>"
    )
    assert repr(piling.Driving((one,))) == "<Driving of 1 blow: the last moves head 5 mm, toe 5 mm>"
    head = piling.Head(t, np.full(n, 4e6), np.full(n, 1.6), 2.5e6)
    assert repr(head).startswith("<Head of 1000 samples, 0 to 999 µs: largest force 4 MN, velocity 1.6 m/s")
    two = np.array([1.0, 2.0])
    graph = piling.BearingGraph(np.array([1e6, 2e6]), np.array([10e-3, 2e-3]), np.array([100.0, 500.0]), two, two, two)
    assert repr(graph) == "<BearingGraph of 2 capacities, 1 to 2 MN: sets 2 to 10 mm>"
    assert list(graph.to_pandas()["set [m]"]) == [10e-3, 2e-3]
    assert graph.to_pandas().index.name == "capacity [N]"
    one_graph = piling.BearingGraph(np.array([1.5e6]), np.array([10e-3]), np.array([100.0]), two[:1], two[:1], two[:1])
    assert repr(one_graph) == "<BearingGraph of 1 capacity, 1.5 MN: set 10 mm>"
    driven = piling.Driving((one, one._replace(toe_force=None))).to_pandas()
    assert list(driven.index) == [1, 2]
    assert np.isnan(driven["force left at the toe [N]"][2])
    loop = drilling.Loop(t, 1e-3 * np.ones(n), 5e4 * np.ones(n), np.linspace(0.0, 146.6, n))
    assert repr(loop) == "<Loop of 1000 samples, 0 to 999 µs: penetration to 1 mm, force to 50 kN, work 146.6 J>"
    found = drilling.Efficiencies(np.array([1e7, 1e8]), np.array([0.5, 0.7]), *np.zeros((3, 2)))
    assert repr(found) == "<Efficiencies of 2 stiffnesses, 10 to 100 MN/m: the largest is 0.7 at 100 MN/m>"
    assert found.to_pandas()["efficiency [1]"][1e8] == 0.7
    assert repr(granular.solitary_wave()).startswith("<SolitaryWave of exponent 1.5, 4096 points: C 0.9055")


def test_reprs_of_fits_and_sensitivities_have_units_and_intervals() -> None:
    fitted = Fitted(
        "contacts.0.law.stiffness", 1.2345e9, 1.2e9, 1.27e9, "N/m", "near an edge", {"jacobian": (0.0, 1.0)}
    )
    assert repr(fitted) == (
        "<Fitted contacts.0.law.stiffness: 1.2345e+09 N/m, 95 % interval 1.2e+09 to 1.27e+09; near an edge>"
    )
    nan = float("nan")
    row = Sensitivity("impulse", "a|b", "N s", "bodies.a.mass", 2.0, "kg", 3.6, 2.6, 0.1, "tangent", nan, nan, nan, nan)
    assert repr(row) == "<Sensitivity of impulse a|b to bodies.a.mass: 2.6 N s/kg, error 0.1 N s/kg (tangent)>"
    assert repr(row._replace(derivative=nan, found="withheld")).endswith("bodies.a.mass: withheld>")
    assert repr(Sensitivities("case", (row,))).startswith("<Sensitivities of 'case'\n  quantity")
    unopened = row._replace(quantity="first_opening", value=nan, derivative=nan, found="withheld", reason="closed")
    assert str(Sensitivities("case", (row, unopened))).splitlines()[2:] == [  # a row without a value is a note alone
        "first_opening a|b by bodies.a.mass: closed"
    ]


def test_the_repr_of_a_long_row_of_bodies_is_short() -> None:
    bodies = {"striker": il.Mass(1.0, velocity=1.0), "bead": il.Mass(1.0, repeat=50)}
    law = {"kind": "hertz", "stiffness": 1e9}
    case = il.Case(
        bodies=bodies, contacts=[il.Chain(["striker", "bead"], law)], solve={"duration": 1, "tolerance": 0.1}
    )
    assert "bead_7 (mass) and 43 more; 50 contacts" in repr(case)


def test_the_repr_of_energies_has_their_balance() -> None:
    t = np.linspace(0.0, 600e-6, 4)
    book = EnergyBook(
        t,
        {"rod": np.array([15.78, 12.0, 10.0, 8.335]), "mass": np.zeros(4)},
        np.zeros(4),
        {"contact": np.array([0.0, 3.78, 5.78, 7.445]), "ends": np.zeros(4)},
        np.zeros(4),
    )
    assert repr(book) == (
        "<EnergyBook of 2 bodies at 4 instants, 0 to 600 µs: total 15.78 J to 8.335 J, work 0 J, losses 7.445 J, "
        "largest gain 0 %>"
    )


def test_reprs_of_records_of_a_run_have_units() -> None:
    assert repr(Event(178.2e-6, "a|b", "open")) == "Event('a|b', open, time=178.2 µs)"
    assert repr(Event(0.0, "a|b", "impulse", 2e-3)) == "Event('a|b', impulse, time=0 s, impulse=2 mN s)"
    assert repr(BranchChange(5e-6, "a|b", "yielding")) == "BranchChange('a|b', yielding, time=5 µs)"
    assert repr(EnergyEnds(5.0, 4.0, 0.5, {"contact": 1.0, "ends": 0.5})) == (
        "EnergyEnds(initial=5 J, final=4 J, work=500 mJ, losses=1.5 J)"
    )
    assert repr(Cost(1e-3, 2e-5, 18)) == "Cost(steps=18, setup=1 ms, solve=20 µs, checks=0 s)"
    assert repr(Cost(steps=9, rhs_evaluations=90, unknowns=4)).startswith("Cost(steps=9, unknowns=4, rhs_evaluations=9")
    t = 1e-6 * np.arange(1000)
    assert repr(Measured(t, 1e-3 * t / t[-1], 3)) == (
        "<Measured: 1000 samples at 0 to 999 µs, 0 to 0.001, 3 beyond the range of the converter>"
    )
    assert repr(Sampled("strain:rod@0.1", t)) == "<Sampled 'strain:rod@0.1' at 1000 times, 0 to 999 µs>"
    assert repr(Sampled("strain:rod@0.1", ())) == "Sampled('strain:rod@0.1', ())"
    chosen = Choice(1e-3, Method({}, {}, None, None), "rigid bodies, 200 steps", 4e-4, "one resolution", (), 0.1)
    assert repr(chosen) == "<Choice of 'rigid bodies, 200 steps': expected error 0.0004, within 0.001>"
