"""A piece of the step loop that a scene was not given ends the run with an error, never the process."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz
from impactlab.errors import StepError
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.newmark import Newmark
from impactlab.models.finite_element import FiniteElement
from impactlab.scene.bodies import End, Mass, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import run, stepped_run
from impactlab.simulate.stepping import pieces
from impactlab.simulate.stepping.arrays import (
    BOOK_DASHPOTS,
    MARCH_ROWS,
    PIECES,
    READ_LENGTHS,
    SAMPLE_ROWS,
    ClockRecord,
    StepArrays,
)
from impactlab.simulate.stepping.setup import assembly
from impactlab.simulate.stepping.unfilled import address_without
from impactlab.testing.scenes import in_a_row, mass_on_rod


def plain(step: float) -> Simulation:
    return mass_on_rod(FiniteElement(8), Penalty(), Newmark(), StepRule(courant=step), round_trips=0.1)


def with_a_dashpot(step: float) -> Simulation:
    end = End("dashpot", 1e3)
    return mass_on_rod(FiniteElement(8), Penalty(), Newmark(), StepRule(courant=step), right=end, round_trips=0.1)


def row_of_beads(step: float) -> Simulation:
    beads = [Mass(f"m{number}", 1.0, velocity=float(number == 0)) for number in range(4)]
    law, rule = Hertz(1e9), StepRule(dt=step * 1e-5)
    return in_a_row([*beads, Wall("end")], None, law, CentralDifference(), rule, duration=1e-3)


@pytest.mark.parametrize(
    ("scene", "piece", "step"),
    [
        (with_a_dashpot, READ_LENGTHS, 0.41),
        (with_a_dashpot, BOOK_DASHPOTS, 0.42),
        (row_of_beads, MARCH_ROWS, 0.43),
        (row_of_beads, SAMPLE_ROWS, 0.44),
    ],
)
def test_a_missing_piece_ends_the_run_with_an_error(
    monkeypatch: pytest.MonkeyPatch, scene: Callable[[float], Simulation], piece: int, step: float
) -> None:
    def all_but_one(m: StepArrays, clock: ClockRecord) -> None:
        pieces.fill_pieces(m, clock)
        assert m.pieces[piece] != address_without(piece)
        m.pieces[piece] = address_without(piece)

    monkeypatch.setattr(assembly, "fill_pieces", all_but_one)
    with pytest.raises(StepError, match=f"called its piece {piece} .* was not set up") as caught:
        run(*scene(step))
    assert "Report it" in caught.value.remedy
    monkeypatch.undo()
    assert run(*scene(step + 0.01)).cost.steps > 1  # the fault is told once


def test_a_scene_that_needs_no_piece_has_all_places_filled() -> None:
    made = stepped_run.Prepared(*plain(0.45)).assembly()
    assert made is not None
    held = made.memory.pieces.tolist()
    assert held == [address_without(piece) for piece in range(PIECES)]
    assert len({*held}) == PIECES
