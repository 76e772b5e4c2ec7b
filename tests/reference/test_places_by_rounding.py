"""Places that meet an end or a step of a rod to rounding: lengths of segments are sums, 0.1 + 0.2 > 0.3 > ... .

Rods of c 5000 m/s and Z 4000 N s/m at an area of 1 cm2. Expected numbers are d'Alembert's.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.errors import CaseError
from impactlab.types import Array

STEEL = {"young": 2e11, "density": 8000.0}
CONTINUOUS: dict[str, Any] = {"model": {"kind": "continuous"}}
MESH: dict[str, Any] = {
    "model": {"kind": "finite_element", "elements": 480, "mass": "lumped"},
    "integrator": {"kind": "central_difference"},
    "step": {"courant": 0.9},
}
LENGTHS = (0.7, 0.1)  # m, whose sum is less than 0.8


def stepped(lengths: tuple[float, ...], areas: tuple[float, ...], **more: Any) -> il.Rod:
    """A rod of segments."""
    pieces = [{"length": x, "area": area, "material": STEEL} for x, area in zip(lengths, areas, strict=True)]
    return il.Rod(segments=pieces, **more)


def probe(at: float, quantity: str, **more: Any) -> dict[str, Any]:
    return {"body": "rod", "at": at, "quantity": quantity, **more}


def pushed(solve: dict[str, Any]) -> il.Case:
    """A rod of 0.8 m pushed by 1 kN: its far end moves at 2 F/Z from 160 us on."""
    rod = stepped(LENGTHS, (1e-4, 1e-4), ends={"left": {"force": 1e3}})
    probes = [probe(0.8, "velocity"), probe(0.8, "strain"), probe(0.75, "strain", length=0.1)]
    return il.Case(bodies={"rod": rod}, probes=probes, solve={"duration": 2.4e-4, **solve})


@pytest.mark.parametrize("solve", [CONTINUOUS, MESH], ids=["continuous", "mesh"])
def test_a_probe_at_the_sum_of_the_lengths_is_at_the_end(solve: dict[str, Any]) -> None:
    assert sum(LENGTHS) < 0.8
    history = il.run(pushed(solve))
    t = np.array([1e-4, 2.0e-4])
    assert history.evaluate(t, "velocity:rod@0.8") == pytest.approx([0.0, 0.5], abs=0.01)
    gauge = history.measured(2)  # from 0.7 m to the end: the front of F/(E A) is at 0.775 m at 155 us
    assert np.interp(1.55e-4, gauge.time, gauge.values) == pytest.approx(0.75 * 1e3 / (2e11 * 1e-4), rel=0.02)
    right, left = history.travelling("rod", 0.8, t)
    assert right == pytest.approx([0.0, 0.25], abs=0.01)
    assert left == pytest.approx([0.0, 0.25], abs=0.01)


@pytest.mark.parametrize("solve", [CONTINUOUS, MESH], ids=["continuous", "mesh"])
@pytest.mark.parametrize(("lengths", "at"), [(LENGTHS, 0.8), ((0.1, 0.2), 0.3)])
def test_a_contact_at_the_sum_of_the_lengths_is_at_the_end(
    lengths: tuple[float, ...], at: float, solve: dict[str, Any]
) -> None:
    """A uniform rod at 1 m/s on a wall: force Z v for one round trip, waves Z v/2 to either side."""
    case = il.Case(
        bodies={"rod": stepped(lengths, (1e-4, 1e-4), velocity=1.0), "wall": il.Wall()},
        contacts=[il.Contact(f"rod.at({at})", "wall", {"kind": "addition_deletion"})],
        probes=[probe(at, "velocity")],
        solve={"duration": 3.9e-4 * at, **solve},  # within the round trip
    )
    history = il.run(case)
    assert history.evaluate(np.array([2e-4 * at]), f"force:rod.at({at:g})|wall") == pytest.approx(4000.0, rel=1e-3)
    right, left = history.travelling("rod", at, np.array([2e-4 * at]))
    assert right == pytest.approx(0.5, abs=1e-3)
    assert left == pytest.approx(-0.5, abs=1e-3)


def test_a_mass_on_such_an_end_meets_the_wall() -> None:
    """The face carries the mass, as `rod.right` does, and a hard contact of two masses is refused."""
    for face in ("rod.right", "rod.at(0.3)"):
        rod = stepped((0.1, 0.2), (1e-4, 1e-4), velocity=1.0, ends={"right": {"mass": 0.1}})
        contact = il.Contact(face, "wall", {"kind": "addition_deletion"})
        case = il.Case(
            bodies={"rod": rod, "wall": il.Wall()}, contacts=[contact], solve={"duration": 2e-4, **CONTINUOUS}
        )
        with pytest.raises(CaseError, match="both faces have mass"):
            il.run(case)


def test_a_place_beyond_the_end_is_refused() -> None:
    rod = stepped(LENGTHS, (1e-4, 1e-4))
    with pytest.raises(CaseError, match=r"x = 0\.80000001 m lies outside the body 'rod'. Allowed: 0 to 0\.8 m"):
        il.Case(bodies={"rod": rod}, probes=[probe(0.80000001, "velocity")], solve={"duration": 1e-4}).check()


def at_step(history: Any, t: float) -> list[Array]:
    """Strain at the step: its channel, its field, its two waves together."""
    waves = history.waves("rod", 0.3, "strain", [t])
    return [
        history.evaluate(np.array([t]), "strain:rod@0.3"),
        history.field("rod", t, "strain", [0.3]).values,
        waves.total,
    ]


@pytest.mark.parametrize("solve", [CONTINUOUS, MESH], ids=["continuous", "mesh"])
def test_strain_at_a_step_is_that_behind_it(solve: dict[str, Any]) -> None:
    """A force of 10 kN meets areas 1 : 4 at 0.1 m + 0.2 m: 8/5 of it goes on, with a strain of 8/5 F/(E 4 cm2)."""
    assert 0.1 + 0.2 > 0.3
    rod = stepped((0.1, 0.2, 0.3), (1e-4, 1e-4, 4e-4), ends={"left": {"force": 1e4}})
    probes = [probe(0.3, quantity) for quantity in ("velocity", "strain")]
    case = il.Case(bodies={"rod": rod}, probes=probes, snapshots=[9e-5], solve={"duration": 1e-4, **solve})
    history = il.run(case)
    for found in at_step(history, history.duration * 0.9):
        assert found == pytest.approx(1.6 * 1e4 / (2e11 * 4e-4), rel=0.05)
    right, left = history.travelling("rod", 0.3, np.array([9e-5]))  # nothing comes from behind the step
    assert right == pytest.approx(1.6 * 1e4 / 16000.0, rel=0.05)
    assert left == pytest.approx(0.0, abs=0.05)
