"""The automatic choice on rows of beads: leapfrog, whose stated error holds, at a small part of the other cost."""

import numpy as np
import pytest

import impactlab as il
from impactlab.errors import CaseError
from impactlab.metrics.peaks import find_peak, peak_force
from impactlab.refine import choice, search
from impactlab.refine.descriptions.rods import MIN_FINENESS
from impactlab.refine.descriptions.rows_of_beads import row_of_beads
from impactlab.refine.errors.between_records import error_between_records
from impactlab.refine.errors.distances import difference
from impactlab.refine.errors.level_errors import PEAK_MARGIN, estimate_errors
from impactlab.refine.references.converged import descriptions_of
from impactlab.refine.studies import studies_of
from impactlab.scene.method import Simulation
from impactlab.scene.problem import RECORDS
from impactlab.scene.sizes import default_records
from tests.solving import run_case


def chain(beads, duration, **solve):
    """Return a bead of 4 g at 1 m/s that strikes equal ones."""
    return il.Case(
        bodies={"striker": il.Mass(4e-3, velocity=1.0), "bead": il.Mass(4e-3, repeat=beads)},
        contacts=[il.Chain(["striker", "bead"], {"kind": "hertz", "stiffness": 7.7e9})],
        solve={"duration": duration, **solve},
    )


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_a_chain_is_stepped_by_leapfrog_within_the_error_stated(tolerance):
    history = il.run(chain(12, 3e-4, tolerance=tolerance))
    assert history.choice.met
    assert history.choice.chosen.startswith("rigid bodies, leapfrog")
    fine = il.run(chain(12, 3e-4, integrator={"kind": "midpoint"}, step={"dt": 1e-8}, records=30001))
    laws = fine.method.laws
    error = difference(history, fine, history.scene, laws, ("displacements", "impulses", "peak_forces"))
    assert error <= history.choice.expected_error <= tolerance


def test_few_records_do_not_keep_a_chain_from_its_tolerance():
    """Means over several steps differ between runs by 2 % of a force: the largest forces of all steps are compared."""
    history = il.run(chain(40, 6e-4, tolerance=2e-3, records=400))
    assert history.choice.met
    assert history.assembly.stride > 1
    fine = il.run(chain(40, 6e-4, integrator={"kind": "central_difference"}, step={"dt": 5e-9}))
    peaks = [[max(span.peak_force for span in each.spans(contact.name)) for contact in fine.scene.contacts]
             for each in (history, fine)]  # fmt: skip
    assert peaks[0] == pytest.approx(peaks[1], rel=2e-3)
    assert peak_force(history, fine, fine.scene) == pytest.approx(
        max(abs(one / other - 1.0) for one, other in zip(*peaks, strict=True)), rel=1e-9
    )


def test_the_error_between_few_records_counts():
    """Runs that keep the same few instants have it in common: 2.9e-5 was stated of 7.5e-5."""
    fine = il.run(chain(40, 6e-4, integrator={"kind": "central_difference"}, step={"dt": 5e-9}, records=60_000))
    few = il.run(chain(40, 6e-4, tolerance=1e-3, records=100))
    apart = difference(few, fine, fine.scene, fine.method.laws, ("displacements",))
    assert error_between_records(few, few.scene) > 1e-5
    assert apart < few.choice.expected_error < 1e-3
    assert error_between_records(fine, fine.scene) < 1e-9
    with pytest.raises(CaseError, match=r"or more, a larger solve\.records"):
        il.run(chain(40, 6e-4, tolerance=3e-5, records=100))


def test_a_tolerance_that_few_records_miss_names_the_key_for_more():
    """The text that ends ``tolerance_not_met``; a run of all its steps has none."""
    scheme = {"integrator": {"kind": "central_difference"}, "step": {"dt": 1e-7}}
    few, all_steps = (il.run(chain(3, 6e-5, **scheme, records=records)) for records in (100, 1000))
    assert choice.between_records(all_steps) == ""
    assert choice.between_records(few).endswith(
        f"Only one step in {few.assembly.stride} is kept, and channels are interpolated between these; a larger "
        "solve.records may lower the error"
    )


def test_a_chain_of_a_thousand_beads_keeps_as_many_instants_as_memory_allows():
    """Its default, of fewer instants than that of small scenes, was taken for a number that the case gives."""
    request = Simulation(*chain(1000, 1e-3, tolerance=1e-3).simulation())
    assert request.scene.records < RECORDS
    assert row_of_beads(request).simulation(30_000).scene.records == default_records(request.scene, RECORDS) + 1
    given = Simulation(*chain(1000, 1e-3, tolerance=1e-3, records=300).simulation())
    assert row_of_beads(given).simulation(30_000).scene.records == 300


def test_no_description_takes_a_chain_of_one_contact_off_the_scheme_that_conserves_energy():
    history = run_case(
        bodies={"a": il.Mass(4e-3, velocity=1.0), "b": il.Mass(4e-3)},
        contacts=[il.Contact("a", "b", {"kind": "hertz", "stiffness": 7.7e9})],
        solve={"duration": 1e-4, "tolerance": 1e-3},
    )
    assert "leapfrog" not in history.choice.chosen


def test_contacts_ahead_of_a_wave_do_not_count():
    """The front of a wave in a chain falls doubly exponentially: forces of 1e-9 of the largest are not compared.

    The wave is stopped on its way. The last contacts that it has closed have forces whose errors are the largest ones.
    """
    coarse, fine = (
        il.run(chain(30, 2.98e-4, integrator={"kind": "central_difference"}, step={"dt": dt}, records=30001))
        for dt in (2e-8, 1e-8)
    )
    peaks = np.array([each.peak_force for each in fine.contacts])
    assert 0.0 < peaks.min() < 1e-9 * peaks.max()  # there are such contacts
    last = next(each for each in fine.scene.contacts if each.name == fine.contacts[int(np.argmin(peaks))].contact)
    found, wanted = (find_peak(each, last, np.zeros((0, 2)), hard=False).force for each in (coarse, fine))
    apart = abs(found / wanted - 1.0)
    assert peak_force(coarse, fine, fine.scene) < 0.5 * apart
    assert difference(coarse, fine, fine.scene, fine.method.laws, ("peak_forces",)) < 0.5 * apart


@pytest.mark.parametrize("beads", [2, 30])
def test_adaptive_steps_of_a_chain_cost_more_with_each_contact(beads):
    """Steps begin again where a contact closes or opens, and every step evaluates all laws: both are predicted."""
    scene, method = chain(beads, 5e-4, integrator={"kind": "central_difference"}, step={"dt": 5e-7}).simulation()
    adaptive = next(each for each in descriptions_of(Simulation(scene, method)) if each.name.startswith("adaptive"))
    steps, size = adaptive.work(MIN_FINENESS)
    done = il.run(chain(beads, 5e-4, integrator={"kind": "adaptive", "relative_tolerance": 1e-4})).cost
    # An evaluation takes some 20 us for each contact, and as long as ten contacts beside: by work, not by a clock.
    work = 2e-5 * done.rhs_evaluations * (beads + 10)
    assert size == beads - 1
    assert steps > 3 * size
    assert 1.0 / 3.0 < adaptive.seconds(MIN_FINENESS) / work < 3.0


def test_a_trial_that_is_too_long_is_compared_with_the_seconds_that_are_left():
    """The text read "would take 2.3 s of solving, beyond the 3 s", without those that other trials had taken."""
    scene, method = chain(2, 1e-4, tolerance=1e-3).simulation()
    study = studies_of(Simulation(scene, method))[0][0]
    study.next = 10**7
    assert "and 0.5 s are left of the 3 s" in search.beyond_budget(study, 0.5)
    assert "beyond the 3 s" in search.beyond_budget(study, search.BUDGET_S)


def test_a_long_run_keeps_one_step_in_four():
    """A record takes as long as several steps, and cubics between the instants kept add nothing to the error."""
    study = studies_of(Simulation(*chain(30, 6e-4, tolerance=1e-4).simulation()))[0][0]
    few, many = study.run(1500).history, study.run(40_000).history
    assert few.record_rate * few.dt == pytest.approx(1.0)
    assert many.record_rate * many.dt == pytest.approx(0.25)


def test_the_quantity_with_the_largest_error_is_named():
    """Of a wave that is stopped on its way it is one at the front, where all rises steeply."""
    asked = Simulation(*chain(30, 2.5e-4, tolerance=1e-3).simulation())
    study = studies_of(asked)[0][0]
    for steps in (1000, 2000, 4000):
        study.run(steps)
    estimate_errors(study, asked)
    named = study.levels[-1].worst
    quantity, _, last = named.rpartition("bead_")
    assert quantity.startswith(("displacement of", "impulse of", "peak force of"))
    front = max(int(each.contact.rpartition("_")[2]) for each in study.levels[-1].history.contacts)
    assert front - 4 < int(last) <= front
    worse = {on: difference(*(level.history for level in study.levels[-2:]), asked.scene, asked.method.laws, (on,))
             for on in ("displacements", "impulses", "peak_forces")}  # fmt: skip
    worse["peak_forces"] *= PEAK_MARGIN
    assert max(worse, key=lambda on: worse[on]).startswith(quantity.partition(" of")[0].replace(" ", "_"))


def test_a_coarse_contact_under_a_tolerance_has_a_smaller_one_as_remedy():
    """Mesh and step are those of the choice: the case has no setting for them."""
    masses, springs = [1e-3, 3e-2, 6e-3, 2e-3, 1e-3, 2e-2, 3e-3, 1e-3], [1e6, 3e6, 9e5, 4e6, 6e5, 5e6, 8e6]
    history = run_case(
        bodies={f"b{i}": il.Mass(mass, velocity=1.0 if i == 0 else 0.0) for i, mass in enumerate(masses)},
        contacts=[il.Contact(f"b{i}", f"b{i + 1}", {"kind": "penalty", "stiffness": k}) for i, k in enumerate(springs)],
        solve={"duration": 4e-4, "tolerance": 1e-2},
    )
    texts = [each.text for each in history.warnings if each.code == "coarse_contact"]
    assert texts
    assert all(text.endswith("give a smaller tolerance") for text in texts)
