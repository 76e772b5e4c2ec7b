"""A student's split Hopkinson bar: from a scene in Python to gauges, waves, labelled data and figures, in a few lines.

The numbers are those of one-dimensional theory (Kolsky 1949; Graff 1975, section 2.6): a striker at v sends a strain of
v/(2 c) for twice its transit; through a specimen between equal bars it rises as 1 - r^2n, n wave trips after it came.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

CODE = """
import impactlab as il

bar = {"diameter": "16 mm", "material": "steel"}
train = ("striker", "incident", "specimen", "transmission")
case = il.Case(
    name="split_hopkinson_bar",
    bodies={
        "striker": il.Rod(length="200 mm", velocity="10 m/s", **bar),
        "incident": il.Rod(length="1 m", **bar),
        "specimen": il.Rod(length="8 mm", diameter="10 mm", material="aluminium"),
        "transmission": il.Rod(length="1 m", **bar),
    },
    contacts=[il.Contact(f"{a}.right", f"{b}.left", {"kind": "addition_deletion"}) for a, b in zip(train, train[1:])],
    probes=[{"body": name, "at": "0.5 m", "quantity": "strain"} for name in ("incident", "transmission")],
    solve={"duration": "600 us", "model": {"kind": "continuous"}},
)
history = il.run(case)
gauges = history.to_xarray().strain
incident = history.waves("incident", 1.0, "force")
transmitted = history.waves("transmission", 0.0, "force")
history.plot().savefig(folder / "gauges.png")
history.plot_xt().savefig(folder / "waves.png")
history.to_netcdf(folder / "run.nc")
"""

SPEED = math.sqrt(210e9 / 7850.0)
AREA = math.pi / 4.0 * 0.016**2
BAR, SPECIMEN = 7850.0 * SPEED * AREA, math.sqrt(70e9 * 2700.0) * math.pi / 4.0 * 0.01**2
REFLECTED = (BAR - SPECIMEN) / (BAR + SPECIMEN)
TRIP = 2.0 * 0.008 / math.sqrt(70e9 / 2700.0)  # s, of a wave through the specimen and back
STRAIN = 10.0 / (2.0 * SPEED)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return the names that the code of the student defines."""
    names: dict[str, Any] = {"folder": tmp_path_factory.mktemp("student")}
    exec(CODE, names)
    return names


def test_it_takes_few_lines() -> None:
    assert len([line for line in CODE.splitlines() if line.strip()]) <= 25


def test_the_incident_pulse(made: dict[str, Any]) -> None:
    gauge = made["gauges"].sel(strain_at="incident@0.5")
    arrives = 0.5 / SPEED
    during = gauge.sel(time=slice(arrives + 1e-6, arrives + 0.4 / SPEED - 1e-6))
    assert during.values == pytest.approx(np.full(during.size, STRAIN), rel=1e-9)
    assert during.size > 200
    assert np.abs(gauge.sel(time=slice(0.0, arrives - 1e-6))).max() < 1e-15
    assert gauge.attrs == {"units": "1", "long_name": "strain, positive in compression"}


def test_the_specimen_rings_up_in_steps(made: dict[str, Any]) -> None:
    gauge = made["gauges"].sel(strain_at="transmission@0.5")
    arrives = 1.5 / SPEED + 0.5 * TRIP
    for number in range(1, 15):
        step = gauge.sel(time=arrives + (number - 0.5) * TRIP, method="nearest")
        assert float(step) == pytest.approx(STRAIN * (1.0 - REFLECTED ** (2 * number)), rel=1e-9)


def test_the_waves_give_the_forces_on_the_specimen(made: dict[str, Any]) -> None:
    """What the gauges of a real bar are used for: force on either face, from what comes and what goes."""
    history, incident, transmitted = made["history"], made["incident"], made["transmitted"]
    t = incident.time
    faces = [
        history.evaluate(t, f"force:{name}")
        for name in ("incident.right|specimen.left", "specimen.right|transmission.left")
    ]
    largest = np.abs(faces[0]).max()
    # The faces may part when the pulse has passed: the waves at a free end have no force, as the contact then has.
    assert incident.total == pytest.approx(faces[0], abs=1e-9 * largest)
    assert transmitted.total == pytest.approx(faces[1], abs=1e-9 * largest)
    came = (t > 1.0 / SPEED) & (t < 1.4 / SPEED)
    assert incident.to_right[came][5:-5] == pytest.approx(np.full(came.sum() - 10, 210e9 * AREA * STRAIN), rel=1e-9)
    assert np.abs(transmitted.to_left[t < 2.0 / SPEED]).max() < 1e-9 * largest
    balanced = (t > 1.0 / SPEED + 20 * TRIP) & (t < 1.4 / SPEED)
    assert incident.total[balanced] == pytest.approx(transmitted.total[balanced], rel=0.01)


def test_figures_and_data_are_written(made: dict[str, Any]) -> None:
    folder: Path = made["folder"]
    assert {path.name for path in folder.iterdir()} == {"gauges.png", "waves.png", "run.nc"}
    again = made["il"].open_netcdf(folder / "run.nc")
    assert again.to_xarray().strain.identical(made["gauges"])
