"""The page of dispersive waves: what it says is what its script measures, and its closed forms are sound."""

from __future__ import annotations

import numpy as np
import pytest

from studies.beams import dispersive as script
from studies.beams import scenes


@pytest.mark.slow
def test_a_whole_collision_is_what_the_page_concludes() -> None:
    # Runs of a hundred contacts follow the last digit: of them only what the page concludes is held.
    for line in script.rebound().splitlines()[2:]:
        _, method, left, contacts, energy = (cell.strip() for cell in line.strip("|").split("|"))
        assert -0.8 < float(left.removesuffix(" v0")) < -0.5, line
        assert int(contacts) >= 5, line
        assert (float(energy.removesuffix(" %")) > 15.0) == ("group" in method), line


def test_what_the_page_says_of_messengers() -> None:
    places = {place.name: place for place in script.PLACES}
    for name in ("uniform rod, end", "Love rod, end", "pinned slender beam, middle", "pinned Timoshenko beam, middle"):
        # Rounding of hyperbolic functions of arguments up to 20 pi, some 1e3 times that of one.
        assert script.missed(places[name], 10.0, "phase") < 1e-11, name
    for name in ("slender cantilever, tip", "Timoshenko cantilever, tip"):
        assert all(0.5 < script.missed(places[name], points, "phase") < 1.2 for points in (4.0, 10.0, 40.0, 160.0)), (
            name
        )
    # A slender beam's group speed is twice its phase speed: the messenger is off by as much as the wave turns.
    assert script.missed(places["pinned slender beam, middle"], 40.0, "group") == pytest.approx(1.0, abs=0.02)


def test_at_a_tip_the_sketch_gains_energy_by_the_step_and_the_general_form_by_its_square() -> None:
    _, lines = script.orders()
    for name, order in (("general, no residual", 2.0), ("sketch, phase speed", 1.0), ("sketch, group speed", 1.0)):
        gains = lines[name][1]
        assert np.log2(gains[1] / gains[3]) / 4.0 == pytest.approx(order, abs=0.1), name
        errors = lines[name][0]
        assert errors[0] > 10.0 * errors[3], name


def test_the_transform_of_a_timoshenko_beam_tends_to_the_slender_one() -> None:
    # Its first force is finite: rate -2 sqrt(kGA rho A)/M at t = 0, half of that at a tip. Late it is the slender beam.
    for tip, ways in ((False, 2.0), (True, 1.0)):
        problem = script.long_beam(script.SHEARED, tip)
        rate = ways * np.sqrt(scenes.SHEAR * scenes.LINE) / problem.mass
        early = 1e-3 * problem.end if not tip else 1e-5 * problem.end
        slowed = 1.0 - problem.exact(np.array([early]))[0]
        assert slowed == pytest.approx(1.0 - np.exp(-rate * early), rel=0.02)
        late = np.array([problem.end])
        other = script.long_beam(script.SLENDER, tip).exact(late)
        assert problem.exact(late)[0] == pytest.approx(other[0], abs=2e-3)
