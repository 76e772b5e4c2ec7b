"""Velocities, momenta and energies at the ends of a run are those of these instants, whatever the scheme keeps."""

import math
import pickle

import numpy as np
import pytest

import impactlab as il
from impactlab.metrics.impact import momentum_error
from impactlab.report import summary
from tests.cases.support import CASES
from tests.solving import in_steps, mesh, run_case, struck_rod

LEAPFROG = {"kind": "central_difference"}
GRAVITY, MASS = 9.81, 2.0  # m/s2, kg


def final(history):
    """Return velocities, momenta and energies at the end of a run, as its summary has them."""
    bodies = summary.final(history)["bodies"]
    return {f"{key}:{name}": value for name, body in bodies.items() for key, value in body.items()}


def falling(dt, end=0.1):
    return run_case(
        bodies={"mass": il.Mass(MASS, velocity=1.0), "wall": il.Wall()},
        contacts=[il.Contact("mass", "wall", {"kind": "penalty", "stiffness": 1e6}, gap=10.0)],
        gravity=GRAVITY,
        solve={"duration": end, "integrator": LEAPFROG, "step": {"dt": dt}},
    )


@pytest.mark.parametrize("dt", [1e-3, 0.7e-3, 0.97e-3])  # the last step ends with the run, or beyond it
def test_a_falling_mass_has_the_velocity_of_the_end(dt):
    history, speed = falling(dt), 1.0 + GRAVITY * 0.1
    assert final(history)["velocity:mass"] == pytest.approx(speed, rel=1e-12)
    assert history.at_end("momentum:mass") == pytest.approx(MASS * speed, rel=1e-12)
    assert history.evaluate([0.0, 0.05], "velocity:mass") == pytest.approx([1.0, 1.0 + 0.05 * GRAVITY], rel=1e-12)
    assert history.evaluate([0.0, 0.05], "momentum:mass") == pytest.approx([2.0, 2.0 + 0.1 * GRAVITY], rel=1e-12)


@pytest.mark.parametrize("dt", [1e-3, 0.7e-3])
def test_energies_of_a_falling_mass_are_those_of_both_ends(dt):
    history = falling(dt)
    found, small = summary.energy(history), MASS * (GRAVITY * dt) ** 2
    assert found["initial"] == pytest.approx(1.0, abs=small)
    assert found["final"] == pytest.approx(1.0 * (1.0 + GRAVITY * 0.1) ** 2, abs=small)
    assert found["work"] == pytest.approx(MASS * GRAVITY * (0.1 + 0.5 * GRAVITY * 0.01), abs=2.0 * small)
    assert found["largest_gain"] < 1e-12 > found["largest_loss"]


@pytest.mark.parametrize("beyond", [0.0, 0.3, 0.5, 0.7])  # of the last step that lies beyond the end of the run
def test_a_run_that_ends_in_contact_has_its_velocity_to_second_order(beyond):
    omega = math.sqrt(1e6 / MASS)
    end = 0.6 * math.pi / omega
    errors = []
    for steps in (50, 100):
        history = run_case(
            bodies={"mass": il.Mass(MASS, velocity=1.0), "wall": il.Wall()},
            contacts=[il.Contact("mass", "wall", {"kind": "penalty", "stiffness": 1e6})],
            solve={"duration": end, "integrator": LEAPFROG, "step": {"dt": end / (steps - beyond)}},
        )
        errors.append(abs(final(history)["velocity:mass"] - math.cos(omega * end)))
    assert errors[0] < (omega * end / 50) ** 2  # half a step early it was 0.018, ten times this
    assert errors[1] < errors[0] / 3.0


@pytest.mark.parametrize("scheme", ["central_difference", "generalised_alpha", "newmark"])
def test_a_mass_on_a_bar_ends_as_the_exact_solution_does(scheme):
    def run(**method):
        return il.run(struck_rod({"kind": "penalty", "stiffness": 1e9}, {"duration": 1e-4, **method}))

    def ends(history):
        return final(history) | {"impulse": history.contacts[0].impulse}

    exact = ends(run(model={"kind": "continuous"}))
    model = {"kind": "finite_element", "mass": "lumped"}
    coarse, fine = (
        ends(run(model=model | {"elements": n}, integrator={"kind": scheme}, step={"courant": 0.5})) for n in (50, 200)
    )
    assert abs(coarse["impulse"] - exact["impulse"]) < 1e-3  # generalised-alpha 5e-3
    assert abs(fine["impulse"] - exact["impulse"]) < 1e-4
    for name, size in (("velocity:hammer", 1.0), ("momentum:rod", 2.133), ("energy:rod", 1.0665)):
        assert abs(coarse[name] - exact[name]) < 1e-4 * size  # 1.5e-3, 4e-3 and 2e-3 half a step early
        assert abs(fine[name] - exact[name]) < 1e-5 * size


@pytest.mark.parametrize("scheme", ["central_difference", "newmark", "moreau_jean"])
@pytest.mark.parametrize("share", [0.02, 0.5, 0.98, 1.0])  # of the step with the kick that is in the run
def test_a_kick_in_the_last_step_is_in_the_velocity_as_a_whole(scheme, share):
    end = (4.0 + share) * 1e-3
    history = run_case(
        bodies={"one": il.Mass(2.0, velocity=1.0), "other": il.Mass(3.0)},
        contacts=[il.Contact("one", "other", {"kind": "impulse_momentum", "restitution": 0.5}, gap=3.6e-3)],
        gravity=GRAVITY,
        solve={"duration": end, "integrator": {"kind": scheme}, "step": {"dt": 1e-3}},
    )
    (kick,) = history.events
    assert kick.time == pytest.approx(4e-3)
    found = final(history)
    assert found["velocity:one"] == pytest.approx(1.0 + GRAVITY * end - 0.9, rel=1e-9)
    assert found["velocity:other"] == pytest.approx(GRAVITY * end + 0.6, rel=1e-9)


@pytest.mark.parametrize("share", [0.02, 0.4, 0.5, 0.6, 1.0])
def test_a_closing_jump_in_the_last_step_of_leapfrog_is_given_at_once(share):
    history = run_case(
        bodies={"one": il.Mass(2.0, velocity=1.0), "other": il.Mass(3.0)},
        contacts=[il.Contact("one", "other", {"kind": "velocity_complementarity"}, gap=3.6e-3)],
        solve={"duration": (4.0 + share) * 1e-3, "integrator": LEAPFROG, "step": {"dt": 1e-3}},
    )
    assert history.contacts[0].impulse == pytest.approx(1.2)  # a share of a step more or less before
    assert final(history)["velocity:one"] == pytest.approx(0.4)
    assert final(history)["velocity:other"] == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("law", "scheme"),
    [
        ("addition_deletion", "central_difference"),
        ("paoli_schatzman", "newmark"),
        ("penalty", "newmark"),
        ("penalty", "generalised_alpha"),
    ],
)
def test_a_touch_after_the_end_of_the_run_is_not_in_its_velocities(law, scheme):
    """The last step holds the force of a touch that comes when the run is over, and its losses."""

    def ends(duration):
        # the third step begins at 0.7 us, the touch is at 1 us
        solve = in_steps(duration, scheme, mesh(50, "lumped"), dt=3.5e-7)
        history = il.run(struck_rod({"kind": law}, solve, gap=1e-6))
        return history, final(history)

    history, found = ends(0.98e-6)
    assert not history.events
    assert found["velocity:hammer"] == pytest.approx(1.0, rel=1e-12)
    assert found["momentum:rod"] == pytest.approx(0.0, abs=1e-12)
    assert summary.energy(history)["booked"]["contact"] == pytest.approx(0.0, abs=1e-15)
    history, found = ends(1.02e-6)
    assert [event.kind for event in history.events] == ["close"]
    assert found["velocity:hammer"] < 1.0 - 1e-5


@pytest.mark.parametrize("share", [0.2, 0.6])  # of the last step that lies within the run
@pytest.mark.parametrize("scheme", ["newmark", "generalised_alpha", "moreau_jean"])
def test_a_touch_after_the_end_of_the_run_leaves_another_contact_as_it_was(scheme: str, share: float) -> None:
    """A mass presses a spring; a second one that catches up with it after the end changed its velocity by 1e-3."""
    omega, dt = math.sqrt(1e6 / MASS), 1e-5
    end = (60.0 + share) * dt
    touch = 60.8 * dt
    gap = 3.0 * touch - math.sin(omega * touch) / omega
    history = run_case(
        bodies={"second": il.Mass(1.0, velocity=3.0), "mass": il.Mass(MASS, velocity=1.0), "wall": il.Wall()},
        contacts=[
            il.Contact("second", "mass", {"kind": "penalty", "stiffness": 1e9}, gap=gap),
            il.Contact("mass", "wall", {"kind": "penalty", "stiffness": 1e6}),
        ],
        solve={"duration": end, "integrator": {"kind": scheme}, "step": {"dt": dt}},
    )
    (span,) = history.contacts
    found = history.at_end("velocity:mass")
    assert found == pytest.approx(math.cos(omega * end), abs=(omega * dt) ** 2)
    assert span.impulse == pytest.approx(MASS - history.at_end("momentum:mass"), rel=1e-9)
    assert history.at_end("velocity:second") == pytest.approx(3.0, rel=1e-14)


def test_a_bead_that_touches_a_rod_after_the_end_of_the_run_keeps_its_momentum() -> None:
    """Its motion stands in the arrays of its row, too, from which the touch was not taken: 2.5e-3 kg m/s were lost."""
    dt = 5e-7
    history = run_case(
        bodies={
            "one": il.Mass(0.5, velocity=2.0),
            "two": il.Mass(0.3, velocity=0.5),
            "rod": il.Rod(length=0.2, area=1e-4, material="steel"),
        },
        contacts=[
            il.Contact("one", "two", {"kind": "penalty", "stiffness": 1e8}),
            il.Contact("two", "rod.left", {"kind": "addition_deletion"}, gap=4.8 * dt),
        ],
        solve=in_steps(9.44 * dt, LEAPFROG, mesh(8, "lumped"), dt=dt),
    )
    assert {event.contact for event in history.events} == {"one|two"}
    given, momenta = (
        history.impulse_of("one|two"),
        [history.at_end(f"momentum:{name}") for name in history.scene.bodies],
    )
    assert momenta == pytest.approx([1.0 - given, 0.15 + given, 0.0], abs=1e-14)


def test_values_at_the_end_change_nothing_in_the_run_and_survive_a_copy():
    history = falling(0.7e-3)
    before = [bytes(array) for array in history.assembly.memory]
    steps = history.assembly.clock.step
    found = final(history), summary.energy(history)
    assert [bytes(array) for array in history.assembly.memory] == before
    assert history.assembly.clock.step == steps
    copy = pickle.loads(pickle.dumps(falling(0.7e-3)))
    assert (final(copy), summary.energy(copy)) == found


def test_runs_that_need_no_velocity_at_the_end_take_no_further_step(monkeypatch):
    from impactlab.simulate.stepping.results import beyond_end

    taken = []
    monkeypatch.setattr(beyond_end, "advance_dated", lambda *given: taken.append(given))
    history = falling(1e-3)
    history.evaluate(np.linspace(0.0, 0.1, 11), "gap:mass|wall")
    assert not taken


def test_free_faces_of_delay_lines_have_the_velocity_of_the_end_to_second_order():
    """A step gives the mean velocity of a face without mass: it belongs to the middle of the step."""

    def run(dt):
        solve = {"duration": 1e-4, "model": {"kind": "continuous"}, "step": {"dt": dt}}
        history = il.run(struck_rod({"kind": "hertz", "stiffness": 1e10}, solve))
        return history.evaluate([5e-5, 1e-4], "velocity:rod@0")

    fine, *errors = (run(dt) for dt in (2.5e-8, 2e-7, 4e-7))
    assert np.abs(errors[0] - fine) == pytest.approx([0.0, 0.0], abs=1e-6)  # 2e-4 before
    assert np.abs(errors[1] - fine) == pytest.approx([0.0, 0.0], abs=4e-6)


@pytest.mark.parametrize("scheme", ["central_difference", "generalised_alpha"])
def test_the_impulse_of_faces_that_are_pressed_together_at_the_start_counts_from_there(scheme: str) -> None:
    """Both schemes take forces at instants: half a step of the force at t = 0 lies before the run, or is missing."""
    case = il.load_case(CASES / "hard" / "overlap.yaml").variant("hertz")
    found, reference = (il.run(case.with_("solve.integrator", {"kind": kind})) for kind in (scheme, "newmark"))
    assert momentum_error(found, found, found.scene) < 1e-12
    assert found.contacts[0].impulse == pytest.approx(reference.contacts[0].impulse, rel=2e-3)


def struck(law, integrator, end, gap, events="dated"):
    """Return a mass on a clamped bar, with steps of 1 us."""
    explicit, modes = integrator == "central_difference", integrator == "exact_modal"
    model = {"kind": "modal", "modes": 8} if modes else mesh(10, "lumped" if explicit else None)
    solve = in_steps(end, integrator, model, dt=1e-6) | {"events": events}
    return il.run(struck_rod(law, solve, mass=0.5, gap=gap))


@pytest.mark.parametrize("integrator", ["exact_modal", "midpoint"])
@pytest.mark.parametrize("law", [{"kind": "impulse_momentum", "restitution": 0.8}, {"kind": "addition_deletion"}])
def test_a_run_with_located_events_ends_with_the_velocity_after_its_last_touch(integrator, law):
    # It was on a line across the touch at 3.4 us, to the end of a step that reached beyond the run.
    found = [struck(law, integrator, end, 3.4e-6, "located") for end in (3.42e-6, 3.9e-6)]
    for history in found:
        assert final(history)["velocity:hammer"] < 0.95
        given = sum(span.impulse for span in history.contacts)
        assert final(history)["velocity:hammer"] == pytest.approx(1.0 - given / 0.5, abs=1e-12)
        assert history.energy.largest_gain < 1e-6
    early, late = (final(history)["velocity:hammer"] for history in found)
    assert late == pytest.approx(early, abs=5e-3)


@pytest.mark.parametrize(
    ("law", "integrator", "end", "gap"),
    [
        ({"kind": "addition_deletion"}, "newmark", 7.3e-6, 0.5e-6),
        ({"kind": "addition_deletion"}, "newmark", 4.5e-6, 3.4e-6),
        ({"kind": "impulse_momentum", "restitution": 0.8}, "newmark", 20.5e-6, 0.5e-6),
        ({"kind": "impulse_momentum", "restitution": 0.8}, "moreau_jean", 22.5e-6, 0.5e-6),
        ({"kind": "addition_deletion"}, "central_difference", 18e-6, 3.4e-6),
        ({"kind": "velocity_complementarity", "restitution": 0.5}, "central_difference", 14e-6, 0.5e-6),
        ({"kind": "velocity_complementarity"}, "newmark", 4.5e-6, 3.4e-6),
        ({"kind": "penalty", "stiffness": 2e9}, "central_difference", 46e-6, 0.0),
        ({"kind": "penalty", "stiffness": 2e9}, "central_difference", 4e-6, 3.4e-6),  # its force begins after the end
        ({"kind": "penalty", "stiffness": 2e9}, "generalised_alpha", 6.3e-6, 0.0),
        ({"kind": "addition_deletion"}, "generalised_alpha", 1e-6, 0.0),  # the last step closes, and ends with the run
        ({"kind": "addition_deletion"}, "generalised_alpha", 5e-6, 3.4e-6),
        ({"kind": "augmented_lagrangian"}, "generalised_alpha", 5e-6, 3.4e-6),
        ({"kind": "impulse_momentum"}, "generalised_alpha", 1.3e-6, 0.0),  # kicked in the step before the last one
        ({"kind": "modal_messengers"}, "exact_modal", 96.4e-6, 0.5e-6),  # closed faces press, whatever their gap
    ],
)
def test_impulses_up_to_the_end_are_those_of_the_momentum_there(law, integrator, end, gap):
    history = struck(law, integrator, end, gap)
    given = history.impulse_of("hammer|rod.left")
    assert history.at_end("momentum:hammer") == pytest.approx(0.5 - given, abs=1e-9)


def test_a_step_beyond_the_end_is_taken_when_an_impulse_there_is_read() -> None:
    """The checks of a run read impulses up to its last step, so that a run costs no second copy of its arrays."""
    case = il.load_case("cases/axial_impact.yaml").method("finite_element").with_("solve.duration.round_trips", 1.0)
    history = il.run(case)
    assert "_around" not in vars(history)
    (span,) = history.contacts
    assert span.end is None
    assert "_around" in vars(history)
    changed = float(np.diff(history.evaluate([0.0, history.duration], "velocity:hammer"))[0])
    assert span.impulse == pytest.approx(-2.133 * changed, rel=1e-12)


@pytest.mark.parametrize("steps", [0.3, 0.9, 1.3, 2.5])
@pytest.mark.parametrize("kind", ["generalised_alpha", "central_difference", "newmark"])
def test_a_run_of_a_step_or_two_has_the_impulse_of_a_force_that_pushes(kind, steps):
    """A mass is pushed back by a spring alone, from t = 0 on: K v0 t^2/2 to rounding, as the run is a hundred times
    shorter than its period; straight lines between instants a step apart are off by K v0 dt^2/2 at most."""
    dt, stiffness = 1e-6, 1e6
    history = run_case(
        bodies={"mass": il.Mass(MASS, velocity=1.0), "wall": il.Wall()},
        contacts=[il.Contact("mass", "wall", {"kind": "penalty", "stiffness": stiffness})],
        solve={"duration": steps * dt, "integrator": {"kind": kind}, "step": {"dt": dt}},
    )
    impulse = history.impulse_of("mass|wall")  # leapfrog meets the spring in its second step
    assert 0.0 <= impulse == pytest.approx(0.5 * stiffness * (steps * dt) ** 2, abs=0.5 * stiffness * dt**2)
    if history.contacts:
        assert history.at_end("momentum:mass") == pytest.approx(MASS - impulse, rel=1e-13)


def test_generalised_alpha_ends_at_the_momentum_of_the_end_to_second_order():
    """The line to the step after the end missed it by K v0 dt^2/2, four times as much as that of the last step."""
    dt, stiffness, steps = 1e-6, 1e6, 8
    history = run_case(
        bodies={"mass": il.Mass(MASS, velocity=1.0), "wall": il.Wall()},
        contacts=[il.Contact("mass", "wall", {"kind": "penalty", "stiffness": stiffness})],
        solve={"duration": steps * dt, "integrator": {"kind": "generalised_alpha"}, "step": {"dt": dt}},
    )
    error = history.contacts[0].impulse - 0.5 * stiffness * (steps * dt) ** 2
    assert abs(error) < 0.15 * stiffness * dt**2


@pytest.mark.parametrize("end", [91e-6, 93e-6, 97e-6])  # s: 1, 3, 7 tenths of the last step
@pytest.mark.parametrize("steps", [10, 1000])  # of the run: of a long one few samples of energies and momenta are kept
def test_generalised_alpha_has_an_impulse_of_a_force_that_began_in_the_last_steps(end: float, steps: int) -> None:
    """It read -7e-5 N s for 3.5e-5: the line of the impulses was extended back beyond the touch."""
    stiffness, after = 1e9, end - 85e-6  # N/m^1.5; s since the touch
    dt, before = 10e-6, (steps - 10) * 10e-6  # the same last steps after a longer flight
    history = run_case(
        bodies={"mass": il.Mass(1.0, velocity=1.0), "wall": il.Wall()},
        contacts=[il.Contact("mass", "wall", {"kind": "hertz", "stiffness": stiffness}, gap=85e-6 + before)],
        solve={
            "duration": end + before,
            "integrator": {"kind": "generalised_alpha", "rho_inf": 1.0},
            "step": {"dt": dt},
        },
    )
    (span,) = history.contacts
    rate = 1.5 * stiffness * math.sqrt(after + dt)  # N/s, the largest in this step; the mass is hardly slowed down
    assert span.impulse > 0.0
    assert span.impulse == pytest.approx(0.4 * stiffness * after**2.5, abs=(1 / 8 + 1 / 12) * rate * dt**2)


@pytest.mark.parametrize("share", [0.1, 0.6])  # of the last step that lies within the run
def test_losses_booked_at_the_end_are_those_of_the_last_step_where_kicks_go_on(share: float) -> None:
    """Without the next kick the step beyond the end loses far more: 3.0 mJ were booked, less than a step before."""
    steps, dt = 12, 1e-6
    viscous = {"young": 2.1e11, "density": 7900.0, "viscosity": 1e5}
    history = run_case(
        bodies={"mass": il.Mass(5.0, velocity=1.0), "rod": il.Rod(length=0.3, area=1e-4, material=viscous)},
        contacts=[il.Contact("mass", "rod.left", {"kind": "impulse_momentum", "restitution": 0.6})],
        solve={
            "duration": (steps - 1 + share) * dt,
            "model": {"kind": "finite_element", "elements": 20},
            "integrator": {"kind": "newmark"},
            "step": {"dt": dt},
        },
    )
    before, after = history.energy.booked["damping"][-2:]
    assert 0.0 < before <= summary.energy(history)["booked"]["damping"] <= after


HARD, PRESSED = {"kind": "addition_deletion"}, {"kind": "penalty", "stiffness": 1e8}
KICKED, NITSCHE = {"kind": "impulse_momentum"}, {"kind": "nitsche"}
PUSHED, MOREAU = {"kind": "wave_initialised"}, {"kind": "paoli_schatzman"}


@pytest.mark.parametrize(
    ("scheme", "laws", "gaps", "end"),  # of the second mass and of the rod, in steps; the end of the run
    [
        ("hht_alpha", (PRESSED, KICKED), (0.0, 0.0), 0.4),  # the line from the step after the kick went below zero
        ("generalised_alpha", (PRESSED, HARD), (0.3, 0.0), 0.6),
        ("exact_modal", ({"kind": "hertz", "stiffness": 1e10}, PUSHED), (0.9, 0.5), 1.2),
        ("midpoint", (KICKED, NITSCHE), (0.0, 0.0), 0.3),
        ("bathe", (MOREAU, NITSCHE), (2.8, 1.3), 2.4),  # touches after the end beside Nitsche's pushes
        ("hht_alpha", (MOREAU, NITSCHE), (2.8, 0.3), 2.4),
    ],
)
def test_short_runs_end_with_the_momenta_that_their_impulses_give(scheme, laws, gaps, end) -> None:
    dt, rod = 1e-6, il.Rod(length=0.2, area=5e-4, material="steel")
    bodies = {"second": il.Mass(0.5, velocity=2.0), "first": il.Mass(1.0, velocity=1.0), "rod": rod}
    model = {"kind": "modal", "elements": 8, "modes": 6} if scheme == "exact_modal" else mesh(8)
    history = run_case(
        bodies=bodies,
        contacts=[
            il.Contact("second", "first", laws[0], gap=gaps[0] * dt),
            il.Contact("first", "rod.left", laws[1], gap=gaps[1] * dt),
        ],
        solve=in_steps(end * dt, scheme, model, dt=dt),
    )
    one, other = (history.impulse_of(name) for name in ("second|first", "first|rod.left"))
    momenta = [history.at_end(f"momentum:{name}") for name in history.scene.bodies]
    assert momenta == pytest.approx([1.0 - one, 1.0 + one - other, other], abs=1e-12)
    assert min(one, other) >= 0.0
    if gaps[0] > 2.0:
        assert one == 0.0


@pytest.mark.parametrize("end", [2.2, 2.8])
def test_faces_that_part_in_the_last_step_have_given_their_whole_impulse(end: float) -> None:
    """The impulse of the contact counted the whole step, the momentum a share of it: 0.2 N s were missing."""
    dt = 1e-6
    history = run_case(
        bodies={"one": il.Mass(1.0, velocity=1.0), "other": il.Mass(1.0)},
        contacts=[il.Contact("one", "other", {"kind": "penalty", "stiffness": 1e12}, gap=0.3 * dt)],
        solve=in_steps(end * dt, "newmark", dt=dt),
    )
    (span,) = history.contacts
    assert span.end is not None
    assert [history.at_end(f"momentum:{name}") for name in ("one", "other")] == pytest.approx(
        [1.0 - span.impulse, span.impulse], rel=1e-12
    )
