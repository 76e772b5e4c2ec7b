"""Functions on signals name a value that is none of those they take, in an error of impactlab."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from impactlab import dispersion, hopkinson, piling
from impactlab.errors import ImpactlabError
from impactlab.scene import BeamSegment

DT = 5e-7
TIME = DT * np.arange(2000)
PULSE = 1e-3 * np.where((TIME > 5e-5) & (TIME < 1.5e-4), np.sin(np.pi * (TIME - 5e-5) / 1e-4) ** 2, 0.0)
BAR = hopkinson.Bar("20 mm", 5000.0, 8000.0, 0.29)
SPECIMEN = hopkinson.Specimen("6 mm", "8 mm")
TEST = hopkinson.Test(DT, BAR, PULSE, -0.5 * PULSE, 0.5 * PULSE)
BEAM = BeamSegment(1.0, 1e-4, 2.1e11, 7850.0, inertia=1e-9)
HEAD_TIME = np.linspace(0.0, 0.05, 200)
HEAD_FORCE = 1e6 * np.sin(np.pi * HEAD_TIME / 0.02) * (HEAD_TIME < 0.02)

CALLS = {
    "bar": (
        hopkinson.Bar,
        {"diameter": 0.02, "wave_speed": 5000.0, "density": 8000.0, "poisson": 0.29, "dispersion": "love"},
    ),
    "measured": (
        hopkinson.measured,
        {
            "incident_gauge": PULSE - 0.5 * np.roll(PULSE, 600),
            "transmission_gauge": 0.5 * np.roll(PULSE, 600),
            "dt": DT,
            "bar": BAR,
            "distances": (0.75, 0.75),
            "threshold": 0.02,
            "far_ends": (0.75, 0.75),
            "zero": (0.0, 4e-5),
        },
    ),
    "one_gauge": (
        hopkinson.one_gauge,
        {
            "strain": PULSE - 0.5 * np.roll(PULSE, 600),
            "dt": DT,
            "bar": BAR,
            "distance": 0.75,
            "threshold": 0.02,
            "end": 9e-4,
        },
    ),
    "two_gauges": (
        hopkinson.two_gauges,
        {"first": PULSE, "second": np.roll(PULSE, 100), "dt": DT, "bar": BAR, "places": (0.2, 0.45), "at": 1.0},
    ),
    "force_and_velocity": (hopkinson.force_and_velocity, {"force": PULSE, "velocity": PULSE, "bar": BAR}),
    "pulses": (hopkinson.pulses, {"signal": PULSE, "dt": DT, "threshold": 0.05, "quiet": 0.0}),
    "cut": (hopkinson.cut, {"signal": PULSE, "dt": DT, "start": 0.0, "end": 1e-4}),
    "shift": (hopkinson.shift, {"signal": PULSE, "dt": DT, "distance": 0.1, "bar": BAR, "band": 1e5}),
    "test": (
        hopkinson.Test,
        {"dt": DT, "bar": BAR, "incident": PULSE, "reflected": -0.5 * PULSE, "transmitted": 0.5 * PULSE},
    ),
    "evaluate": (hopkinson.evaluate, {"test": TEST, "specimen": SPECIMEN, "waves": 3}),
    "equilibrium": (hopkinson.equilibrium, {"test": TEST, "floor": 0.05}),
    "between": (hopkinson.evaluate(TEST, SPECIMEN).between, {"start": 0.0, "end": 1e-4}),
    "case_method": (
        piling.case_method,
        {
            "time": HEAD_TIME,
            "force": HEAD_FORCE,
            "velocity": HEAD_FORCE / 4e5,
            "impedance": 4e5,
            "length": 20.0,
            "wave_speed": 4000.0,
            "damping": 0.4,
        },
    ),
    "guided_rod": (dispersion.guided_rod, {"wave_speed": 5000.0, "rate": 100.0}),
    "free_rod": (dispersion.free_rod, {"wave_speed": 5000.0, "rate": 100.0, "gyration": 0.006, "branch": "axial"}),
    "beam": (dispersion.beam, {"segment": BEAM, "rate": 60.0, "plane": "chord", "tension": 0.0}),
}
WRONG = ["a", (), [], {}, (1.0,), object(), 1 + 2j, [["a"]], np.zeros((2, 2)), "20 kg"]


@pytest.mark.filterwarnings("ignore::impactlab.errors.RunWarning")
@pytest.mark.parametrize(("name", "key"), [(name, key) for name, (_, given) in CALLS.items() for key in given])
def test_a_value_of_another_kind_is_an_error_of_impactlab(name, key):
    function, given = CALLS[name]
    function(**given)
    for wrong in WRONG:
        with pytest.raises(ImpactlabError):
            function(**(given | {key: wrong}))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: hopkinson.Bar(0.02, 5000.0, 8000.0, "x"), "Poisson's ratio: 'x' is not a number"),
        (lambda: hopkinson.Bar(0.02, 5000.0, 8000.0, None), "Poisson's ratio is None; it must be a plain number"),
        (lambda: hopkinson.Bar(True, 5000.0, 8000.0), "diameter of the bar is True; it must be a number in m"),
        (lambda: hopkinson.measured(PULSE, PULSE, DT, BAR, (0.75,)), r"distances: 1 value given\. Allowed: a pair"),
        (lambda: hopkinson.measured(PULSE, PULSE, DT, BAR, "75 cm"), r"distances: '75 cm' given\. Allowed: a pair"),
        (lambda: hopkinson.measured(PULSE, PULSE, DT, BAR, ("x", 1.0)), "a distance to the specimen: 'x' is not"),
        (lambda: hopkinson.cut("signal.csv", DT, 0.0, 1.0), "the signal is 'signal.csv'; it must be a row of numbers"),
        (lambda: hopkinson.shift(PULSE, DT, 0.1, 5000.0), "a Bar is needed, and 5000.0 is given"),
        (lambda: dispersion.free_rod(5000.0, 1.0, branch="x"), r"branch is 'x'\. Allowed: axial or bending"),
        (lambda: dispersion.beam(BEAM, 1.0, "axial"), r"plane is 'axial'\. Allowed: chord or flap"),
    ],
)
def test_the_error_names_the_value_and_the_allowed_ones(make, said):
    with pytest.raises(ImpactlabError, match=said):
        make()


def test_the_case_method_takes_texts_with_units_as_other_functions_do():
    function, given = CALLS["case_method"]
    texts = {"impedance": "400 kN s/m", "length": "2000 cm", "wave_speed": "4 km/s"}
    assert function(**(given | texts)).total == function(**given).total


@pytest.mark.parametrize("percentiles", [["a"], "5,50", [None], None, [50.0, 100.0], []])
def test_percentiles_that_are_no_numbers_are_refused_with_those_that_are(percentiles):
    case = il.Case(
        bodies={"hammer": il.Mass(1.0, velocity=1.0), "wall": il.Wall()},
        contacts=[il.Contact("hammer", "wall", {"kind": "penalty", "stiffness": 1e6})],
        solve={"duration": "1 ms", "step": {"dt": "1 us"}},
    )
    with pytest.raises(il.CaseError, match="between 0 and 100"):
        il.uncertainty(case, {"bodies.hammer.mass": "normal(1, 1 %)"}, percentiles=percentiles)
