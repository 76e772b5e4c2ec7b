"""Cases of granular chains: the numbers in their files, by scipy alone and by the travelling wave; all methods run."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import impactlab as il
from impactlab.casefile import Case
from impactlab.cite import entries, source_key
from impactlab.granular import leading_wave, solitary_wave
from impactlab.history import AbstractHistory
from tests.cases.granular import chain_of, marched

FOLDER = Path(__file__).resolve().parents[2] / "cases" / "granular"
FILES = sorted(FOLDER.glob("*.yaml"))
MASS, STIFFNESS = 4.1102503884466466e-3, 7.692307692307692e9


def case_of(name: str) -> Case:
    return il.load_case(FOLDER / f"{name}.yaml")


def at_end(history: AbstractHistory, case: Case) -> np.ndarray:
    names = case.scene().bodies
    return np.array([float(history.evaluate(history.duration, f"velocity:{name}")) for name in names])


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_case_states_its_purpose_and_all_its_methods_keep_energy_and_momentum(file: Path) -> None:
    head = file.read_text(encoding="utf-8").split("schema_version")[0]
    assert "# Why it exists:" in head
    assert "# What is exact:" in head
    case = il.load_case(file)
    assert source_key(case.source) in entries()
    assert len(case.method_names) > 1
    for method in case.method_names:
        history = il.run(case.method(method))
        momenta = [history.evaluate([0.0, history.duration], f"momentum:{name}") for name in case.scene().bodies]
        before, after = np.sum(momenta, axis=0)
        assert after == pytest.approx(before, rel=1e-11), method
        assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-4, method


def test_the_wave_has_the_speed_of_the_discrete_chain() -> None:
    history = il.run(case_of("solitary_wave"))
    names = [contact.name for contact in history.scene.contacts]
    wave = leading_wave(history, names[:-4])  # the force of the last contacts is that of a free end
    half = len(wave.forces) // 2
    assert np.ptp(wave.forces[half:]) < 1e-5 * wave.forces[-1]
    factors = wave.factors(STIFFNESS, MASS)[half:]
    assert np.ptp(factors) < 1e-5
    assert factors == pytest.approx(solitary_wave().factor, rel=2e-5)
    assert "0.9055158" in (FOLDER / "solitary_wave.yaml").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_thousand_beads_hand_the_wave_on_unchanged() -> None:
    history = il.run(case_of("solitary_wave").variant("thousand"))
    wave = leading_wave(history, [contact.name for contact in history.scene.contacts][:-4])
    half = len(wave.forces) // 2
    assert np.ptp(wave.forces[half:]) < 1e-3 * wave.forces[-1]
    factors = wave.factors(STIFFNESS, MASS, 100)[half:]
    assert np.ptp(factors) < 1e-3
    assert factors == pytest.approx(0.9055, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "first", "last", "within"), [("tapered_chain", 0, -1, 2e-4), ("decorated_chain", 0, -2, 2e-3)]
)
def test_the_numbers_in_a_file_are_those_of_scipy(name: str, first: int, last: int, within: float) -> None:
    case = case_of(name)
    exact = marched(*chain_of(case), case.scene().duration)
    head = case.file and Path(case.file).read_text(encoding="utf-8").split("schema_version")[0]
    numbers = [(text, float(text)) for text in re.findall(r"(?<=\s)\d+\.\d+(?= (?:N|m/s))", head)]
    known = [exact.forces[first], exact.forces[last], exact.velocities[-1], -exact.velocities[0]]
    for text, number in numbers:
        assert any(abs(number - value) <= 0.51 * 10.0 ** -len(text.partition(".")[2]) for value in known), text
    assert len(numbers) >= 3
    assert at_end(il.run(case), case) == pytest.approx(
        exact.velocities, abs=within * float(np.abs(exact.velocities).max())
    )


def test_a_short_tapered_chain_converges_to_the_solution_of_scipy() -> None:
    case = case_of("tapered_chain").with_settings({"bodies.bead.repeat": 6, "solve.duration": 1.5e-4})
    exact = marched(*chain_of(case), 1.5e-4, 1e-11)
    errors = []
    answers = []
    for dt in (1e-7, 5e-8):
        finer = case.with_("solve.step", {"dt": dt})
        answers.append(at_end(il.run(finer), finer))
        errors.append(float(np.max(np.abs(answers[-1] - exact.velocities))))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)  # of the second order
    assert (4.0 * answers[1] - answers[0]) / 3.0 == pytest.approx(exact.velocities, abs=3e-6)


@pytest.mark.slow
def test_a_long_chain_keeps_its_tolerance_up_to_the_front_of_its_wave() -> None:
    """Forces at the front still rise, from 1e-9 of the largest: the choice takes more steps than it keeps records."""
    bead = {"kind": "mass", "mass": 1e-3}
    case = Case.from_dict({
        "bodies": {"striker": {**bead, "velocity": 0.5}, "bead": {**bead, "repeat": 200}},
        "contacts": [{"chain": ["striker", "bead"], "law": {"kind": "hertz", "stiffness": 5e9}}],
        "solve": {"duration": 2.1e-3, "tolerance": 1e-3},
    })  # fmt: skip
    history = il.run(case)
    assert history.choice is not None
    assert history.choice.met
    known = marched(*chain_of(case), 2.1e-3).forces
    for contact, force in zip(history.scene.contacts, known, strict=True):
        if force > 1e-9 * known.max():
            assert max(each.peak_force or 0.0 for each in history.spans(contact.name)) == pytest.approx(force, rel=1e-3)


def test_a_rod_hands_its_momentum_to_the_bar_through_the_beads() -> None:
    history = il.run(case_of("chain_between_rods").method("newmark"))
    given = [history.impulse_of(contact.name) for contact in history.scene.contacts]
    assert given[0] > given[-1] > 0.9 * given[0]
    peaks = [max(span.peak_force or 0.0 for span in history.spans(each.name)) for each in history.scene.contacts]
    assert min(peaks) > 0.0


def test_beads_far_ahead_of_the_wave_move_by_less_than_a_float_holds():
    """The speed of the last face underflowed with the step: the run ended in a division by zero at step 46."""
    history = il.run(case_of("chain_between_rods").with_settings({"solve.duration": 2e-5}))
    assert history.energy.largest_gain < 0.01
