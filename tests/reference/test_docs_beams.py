"""The pages on beams (first force, dispersive waves, bases): their conclusions and their closed forms."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from scipy.special import erfcx, j0

import impactlab as il
from studies.beams import bases, dispersive, first_force, scenes
from studies.pages import DOCS
from tests.cases.support import case_of

PAGE = (DOCS / "beams-first-force.md").read_text(encoding="utf-8")


def printed() -> dict[int, list[float]]:
    """Return the numbers of the table, by the number of modes."""
    lines = re.findall(r"^\| (\d+) \| (.*) \|$", PAGE, re.MULTILINE)
    return {int(modes): [float(cell.split()[0]) for cell in rest.split(" | ")] for modes, rest in lines}


@pytest.mark.slow
def test_the_words_are_true() -> None:
    table = printed()
    forces = np.array([table[modes][1] for modes in first_force.COUNTS])
    assert np.all(np.diff(forces) > 0.0)
    assert 1.0 < forces[-1] < 1.06  # levels off a few percent above
    plain = np.array([table[modes][4] for modes in first_force.COUNTS])
    assert plain[1:] / plain[:-1] == pytest.approx(2.0, rel=0.05)  # doubles with the number of modes
    times = np.geomspace(1e-5, first_force.LAST, 20)
    late, early = first_force.continuous(2e-8, 1.01 * times[-1]), first_force.continuous(4e-9, 8e-9)
    assert first_force.mean_force(late, times) == pytest.approx(first_force.endless(times), rel=0.06)
    assert first_force.mean_force(early, np.array([4e-9])) == pytest.approx(1.0, rel=1e-3)


@pytest.mark.slow
def test_a_whole_collision_is_that_of_the_page() -> None:
    # Runs of a hundred contacts follow the last digit: of them only what the page concludes is held.
    for line in dispersive.rebound().splitlines()[2:]:
        _, method, left, contacts, energy = (cell.strip() for cell in line.strip("|").split("|"))
        assert -0.8 < float(left.removesuffix(" v0")) < -0.5, line
        assert int(contacts) >= 5, line
        assert (float(energy.removesuffix(" %")) > 15.0) == ("group" in method), line


def test_transforms_with_singularities_on_the_imaginary_axis_are_inverted() -> None:
    """Talbot's contour with 60 terms left 1e-2 of a Love rod's wave: its branch points are those of J0 at t = 66."""
    t = np.linspace(0.5, 400.0, 60)
    assert scenes.inverted(lambda s: 1.0 / np.sqrt(s * s + 1.0), t) == pytest.approx(j0(t), abs=1e-8)
    assert scenes.inverted(lambda s: 1.0 / (s + np.sqrt(s)), t) == pytest.approx(erfcx(np.sqrt(t)), abs=1e-8)


def test_the_numbers_of_the_page_on_messengers() -> None:
    places = {place.name: place for place in dispersive.PLACES}
    for name in ("uniform rod, end", "Love rod, end", "pinned slender beam, middle", "pinned Timoshenko beam, middle"):
        # Rounding of hyperbolic functions of arguments up to 20 pi, some 1e3 times that of one.
        assert dispersive.missed(places[name], 10.0, "phase") < 1e-11, name
    for name in ("slender cantilever, tip", "Timoshenko cantilever, tip"):
        assert all(
            0.5 < dispersive.missed(places[name], points, "phase") < 1.2 for points in (4.0, 10.0, 40.0, 160.0)
        ), name
    # A slender beam's group speed is twice its phase speed: the messenger is off by as much as the wave turns.
    assert dispersive.missed(places["pinned slender beam, middle"], 40.0, "group") == pytest.approx(1.0, abs=0.02)


def test_at_a_tip_the_sketch_gains_energy_by_the_step_and_the_general_form_by_its_square() -> None:
    _, lines = dispersive.orders()
    for name, order in (("general, no residual", 2.0), ("sketch, phase speed", 1.0), ("sketch, group speed", 1.0)):
        gains = lines[name][1]
        assert np.log2(gains[1] / gains[3]) / 4.0 == pytest.approx(order, abs=0.1), name
        errors = lines[name][0]
        assert errors[0] > 10.0 * errors[3], name


def test_the_transform_of_a_timoshenko_beam_tends_to_the_slender_one() -> None:
    # Its first force is finite: rate -2 sqrt(kGA rho A)/M at t = 0, half of that at a tip. Late it is the slender beam.
    for tip, ways in ((False, 2.0), (True, 1.0)):
        problem = dispersive.long_beam(dispersive.SHEARED, tip)
        rate = ways * np.sqrt(scenes.SHEAR * scenes.LINE) / problem.mass
        early = 1e-3 * problem.end if not tip else 1e-5 * problem.end
        slowed = 1.0 - problem.exact(np.array([early]))[0]
        assert slowed == pytest.approx(1.0 - np.exp(-rate * early), rel=0.02)
        late = np.array([problem.end])
        other = dispersive.long_beam(dispersive.SLENDER, tip).exact(late)
        assert problem.exact(late)[0] == pytest.approx(other[0], abs=2e-3)


def test_mode_shapes_miss_the_static_compliance_by_the_cube_of_their_number() -> None:
    # The part of N modes left out of the flexibility of a beam is a sum of 1/k^4 from N on.
    for scene in (bases.PINNED, bases.TIP):
        order = math.log(bases.error(scene, "eigenvectors", 12) / bases.error(scene, "eigenvectors", 40), 40.0 / 12.0)
        assert order == pytest.approx(3.0, abs=0.2), scene.name


@pytest.mark.parametrize("basis", ["ritz", "craig_bampton", "striker_attached"])
def test_bases_with_a_shape_of_the_contact_beat_mode_shapes(basis: str) -> None:
    for scene in bases.SCENES:
        for count in (8, 12, 20):
            assert bases.error(scene, basis, count) < 0.5 * bases.error(scene, "eigenvectors", count), scene.name


def test_the_neighbourhood_of_a_contact_moves_first() -> None:
    # Early on the motion of a mesh lies within some wave lengths, which grow as the root of time, of the contact.
    assert bases.early("mesh", 0)[1] < 0.05
    assert bases.early("mesh", 0)[0] < 5e-3
    assert bases.early("substructured", 40)[0] < 0.5 * bases.early("craig_bampton", 40)[0]
    assert bases.early("substructured", 40)[0] < 0.2 * bases.early("eigenvectors", 40)[0]
    # Coarse pieces stay coarse: more modes of the struck one change nothing later.
    floor = [bases.error(bases.PINNED, "substructured", count) for count in (20, 40)]
    assert floor[0] == pytest.approx(floor[1], rel=0.05)


@pytest.mark.parametrize("modes", [5, 40, 160])
def test_the_first_kick_follows_its_closed_form(modes: int) -> None:
    # phi_i(L/2)^2 = 2/m for odd i: J = (1 + e) v0/(1/M + 2 n/m), n the odd ones, M = m.
    expected = 2.0 * bases.KICKED.mass / (1.0 + 2.0 * math.ceil(modes / 2.0))
    assert bases.kick(modes).impulse == pytest.approx(expected, rel=1e-12)
    assert bases.first_kick_of_a_run(modes) == pytest.approx(expected, rel=1e-12)


def test_the_velocities_after_a_kick_are_a_peak_that_narrows() -> None:
    # Sum of sin(i pi x/L) sin(i pi/2) over odd i: sin(2 n z)/(2 n sin z), z = pi (x/L - 1/2), n the odd ones.
    for modes in (20, 80):
        each, n = bases.kick(modes), modes // 2
        z = np.pi * (each.x / bases.KICKED.length - 0.5)
        middle = np.abs(z) < 1e-9
        kernel = np.where(middle, 1.0, np.sin(2 * n * z) / (2 * n * np.sin(np.where(middle, 1.0, z))))
        assert np.allclose(each.velocity / each.velocity.max(), kernel, atol=1e-9)
    widths = [bases.kick(modes).width for modes in (20, 40, 80)]
    assert widths[0] / widths[1] == pytest.approx(2.0, abs=0.1)
    assert widths[1] / widths[2] == pytest.approx(2.0, abs=0.1)
    # With few modes all of the beam moves at once.
    assert bases.kick(5).reach > 0.9


def test_ten_and_twenty_modes_give_the_peak_of_a_hertzian_contact_of_the_page() -> None:
    """0.05 % and 0.006 %, on the page and in the case: the middle is moved by five of the modes, and by ten."""
    page = (DOCS / "beams.md").read_text(encoding="utf-8")
    [told_of] = re.findall(r"ten modes give the peak force to ([\d.]+) % and twenty to ([\d.]+) %", page)
    ten, twenty = map(float, told_of)
    for modes, told in ((10, ten), (20, twenty)):
        (contact,) = il.run(case_of("sphere_on_beam").with_("solve.model", modes=modes)).contacts
        assert contact.peak_force is not None
        assert 100.0 * (contact.peak_force / 4.9771401 - 1.0) == pytest.approx(told, rel=0.1)
