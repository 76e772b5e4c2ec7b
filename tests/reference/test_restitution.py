"""A mass against a wall under each compliant law: what it must return with, and when, in closed form."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impactlab as il
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.khulief_shabana import KhuliefShabana
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Flores, Hertz, HuntCrossley, LankaraniNikravesh
from impactlab.errors import StepError
from impactlab.history import AbstractHistory
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.report.summary import summarise
from impactlab.scene import Mass, Rod, Wall
from impactlab.scene.method import Simulation, StepRule, sides
from impactlab.simulate import run
from impactlab.testing.scenes import CLAMPED, FREE, STEEL, in_a_row, struck
from tests.solving import in_steps, mesh, run_case

MASS, SPEED, STIFFNESS = 2.0, 1.5, 1e9


def hertz_time(exponent: float = 1.5) -> tuple[float, float]:
    """Largest indentation [m] and duration [s] of the lossless impact: 2 d/v0 times the integral of (1-x^(n+1))^-1/2.

    With n = 3/2 the factor is 2.9432751843 (4 sqrt(pi) Gamma(2/5)/(5 Gamma(9/10))).
    """
    power = exponent + 1.0
    deepest = (power * MASS * SPEED**2 / (2.0 * STIFFNESS)) ** (1.0 / power)
    factor = 2.0 * math.sqrt(math.pi) / power * math.gamma(1.0 / power) / math.gamma(1.0 / power + 0.5)
    return deepest, factor * deepest / SPEED


def on_wall(
    law: AbstractContactLaw, integrator: AbstractIntegrator, dt: float, duration: float, gap: float = 0.0
) -> Simulation:
    bodies = Mass("ball", MASS, SPEED), Wall("wall")
    return in_a_row(bodies, None, law, integrator, StepRule(dt=dt), gaps=gap, duration=duration)


def returned(history: AbstractHistory) -> float:
    """The speed after over the speed before."""
    return -float(history.evaluate(np.array([history.duration]), "velocity:ball")[0]) / SPEED


def test_the_factor_of_the_duration_is_the_published_one() -> None:
    deepest, duration = hertz_time()
    assert duration * SPEED / deepest == pytest.approx(2.9432751843, abs=1e-10)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 3.0])
@pytest.mark.parametrize("integrator", [Newmark(), ExactModal()], ids=["newmark", "exact_modal"])
def test_hertz_returns_all_and_lasts_as_long_as_it_must(integrator: AbstractIntegrator, exponent: float) -> None:
    deepest, duration = hertz_time(exponent)
    history = run(*on_wall(Hertz(STIFFNESS, exponent), integrator, duration / 1e4, 1.2 * duration))
    # 1e4 roundings of the energy in a random walk.
    assert history.energy.largest_gain < 1e-13
    assert history.energy.largest_loss < 1e-13
    assert returned(history) == pytest.approx(1.0, abs=1e-13)
    (span,) = history.contacts
    assert span.end is not None
    # Second order: measured 3e-8 with n = 3/2 and 1e4 steps; (w dt)^2/24 is below 1e-6 with any n here.
    assert span.end - span.start == pytest.approx(duration, rel=1e-6)
    assert span.impulse == pytest.approx(2.0 * MASS * SPEED, rel=1e-12)
    # The peak lies up to half a step beside a step's middle: n/2 (K d^n/(m d)) dt^2 /4 of it.
    assert span.peak_force == pytest.approx(STIFFNESS * deepest**exponent, rel=1e-6)


@pytest.mark.parametrize("steps", [3, 7, 20])
def test_hertz_keeps_its_energy_at_any_step(steps: int) -> None:
    _, duration = hertz_time()
    for gap in np.linspace(0.0, SPEED * duration / steps, 7):
        history = run(*on_wall(Hertz(STIFFNESS), Newmark(), duration / steps, 3.0 * duration, float(gap)))
        assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-14
        assert returned(history) == pytest.approx(1.0, abs=1e-14)


def test_error_of_the_hysteretic_laws_falls_with_the_square_of_the_step() -> None:
    law = HuntCrossley(STIFFNESS, restitution=0.5)
    _, duration = hertz_time()
    runs = [run(*on_wall(law, Newmark(), duration / steps, 2.0 * duration)) for steps in (250, 500, 1000)]
    errors = [returned(history) - law.restitutions().true for history in runs]
    # The next term of the error is smaller by the step over the duration.
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize(
    ("law", "true"),
    [
        (HuntCrossley(STIFFNESS, restitution=0.5), 0.662962),
        (LankaraniNikravesh(STIFFNESS, restitution=0.5), 0.725241),
        (Flores(STIFFNESS, restitution=0.5), 0.470445),
        (HuntCrossley(STIFFNESS, restitution=1.0), 1.0),
        (Flores(STIFFNESS, exponent=2.0, restitution=0.5), 0.470445),
        (Flores(STIFFNESS, restitution=0.05), None),
    ],
)
@pytest.mark.parametrize("integrator", [Newmark(), CentralDifference()], ids=["newmark", "central_difference"])
def test_hysteretic_laws_have_their_true_restitution(
    law: HuntCrossley, true: float | None, integrator: AbstractIntegrator
) -> None:
    if true is not None:
        assert law.restitutions().true == pytest.approx(true, abs=5e-7)  # six published digits
    _, duration = hertz_time(law.exponent)
    scene = on_wall(law, integrator, duration / 1e4, 6.0 * duration, gap=0.3 * SPEED * duration)
    history = run(*scene)
    assert returned(history) == pytest.approx(law.restitutions().true, abs=1e-6)
    said = summarise("on_wall", history)["method"]["laws"][0]["restitution"]
    assert said == {"nominal": law.restitution, "true": law.restitutions().true}
    if isinstance(integrator, Newmark):
        assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12
        lost = 0.5 * MASS * SPEED**2 * (1.0 - returned(history) ** 2)
        assert history.energy.booked["contact"][-1] == pytest.approx(lost, rel=1e-11)
    else:
        assert history.energy.largest_gain < 1e-6
    assert history.warnings == []


@pytest.mark.parametrize("nominal", [0.001, 0.05, 0.3, 0.7, 0.95, 0.9999, 1.0])
@pytest.mark.parametrize("kind", [HuntCrossley, LankaraniNikravesh, Flores])
def test_true_restitution_solves_its_equation(kind: type[HuntCrossley], nominal: float) -> None:
    law = kind(STIFFNESS, restitution=nominal)
    b, true = law.hysteresis(), law.restitutions().true
    left, right = b - math.log1p(b), -b * true - math.log1p(-b * true)
    # Both sides end near b^2/2 as differences of b and a logarithm; the right one is steep where b E nears 1.
    steep = b * true / (1.0 - b * true)
    assert abs(left - right) <= 1e-15 * (1.0 + b) * (1.0 + steep) + 1e-11 * b * b
    assert true == pytest.approx(1.0, abs=1e-15) if nominal == 1.0 else true < 1.0


@pytest.mark.parametrize(("ratio", "restitution"), [(0.1, 0.744079), (0.3, 0.450975), (0.5, 0.298436)])
def test_kelvin_voigt_never_pulling(ratio: float, restitution: float) -> None:
    frequency = math.sqrt(STIFFNESS / MASS)
    law = Penalty(STIFFNESS, 2.0 * ratio * MASS * frequency)
    damped = math.sqrt(1.0 - ratio**2)
    contact = (math.pi - math.atan2(2.0 * ratio * damped, 1.0 - 2.0 * ratio**2)) / (damped * frequency)
    history = run(*on_wall(law, Newmark(), contact / 2e4, 1.5 * contact))
    assert returned(history) == pytest.approx(math.exp(-ratio * frequency * contact), abs=1e-6)
    assert returned(history) == pytest.approx(restitution, abs=1.5e-6)  # six published digits
    (span,) = history.contacts
    assert span.end == pytest.approx(contact, rel=1e-4)  # the force ends with a slope; it is dated to a part of a step
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def test_tiny_steps_do_not_blow_up_the_rounding_of_a_spring() -> None:
    frequency = math.sqrt(STIFFNESS / MASS)
    history = run(*on_wall(Penalty(STIFFNESS, 0.2 * MASS * frequency), Newmark(), 4e-5 / frequency, 4.0 / frequency))
    # 1e5 roundings; the force was once a difference of two gaps over 1e-18 m/N, and the run gained 7e-8.
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-11


@pytest.mark.parametrize("restitution", [1.0, 0.9, 0.5, 0.2, math.exp(-2.0), 0.05])
def test_khulief_shabana_has_the_given_restitution(restitution: float) -> None:
    law = KhuliefShabana(STIFFNESS, restitution)
    frequency = math.sqrt(STIFFNESS / MASS)
    slow = 1.0 + law.spring(*facts(), math.nan)[1] / (MASS * frequency)
    history = run(*on_wall(law, Newmark(), 1e-4 * slow / frequency, 4.0 * slow / frequency))
    assert returned(history) == pytest.approx(restitution, abs=1e-6)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def test_khulief_shabana_takes_both_masses() -> None:
    law = KhuliefShabana(STIFFNESS, 0.5)
    bodies = Mass("ball", MASS, SPEED), Mass("wall", 3.0)
    time = 4.0 / math.sqrt(STIFFNESS * (1.0 / MASS + 1.0 / 3.0))
    history = run(*in_a_row(bodies, None, law, Newmark(), StepRule(dt=time / 4e4), duration=time))
    apart = [float(history.evaluate(np.array([time]), f"velocity:{name}")[0]) for name in ("ball", "wall")]
    assert (apart[1] - apart[0]) / SPEED == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("body", ["rod", "beam", "shaft"])
def test_khulief_shabana_counts_masses_at_ends(body: str) -> None:
    """A short stiff body with a mass of 1 kg at its other end, and 0.3 asked for.

    Its waves take (ball over contact stiffness against body) about 1e-4 of the energy. Without the mass at the end, 0.3
    was 0.315.
    """
    bodies: dict[str, dict[str, Any]] = {
        "rod": {"kind": "rod", "length": 0.01, "area": 1e-3, "material": "steel", "ends": {"right": {"mass": 1.0}}},
        "shaft": {
            "kind": "shaft",
            "length": 0.01,
            "section": {"diameter": 0.04},
            "material": "steel",
            "ends": {"right": {"inertia": 1.0 * 0.01**2}},  # 1 kg at the lever arm
        },
        "beam": {
            "kind": "beam",
            "length": 0.02,
            "section": {"width": 0.02, "height": 0.02},
            "material": "steel",
            "ends": {"left": {"mass": 0.5}, "right": {"mass": 0.5}},
        },
    }
    contact = {"between": ["ball", f"{body}.{'at(0.01)' if body == 'beam' else 'left'}"]}
    law = {"kind": "khulief_shabana", "stiffness": 1e5, "restitution": 0.3}
    duration = 1.2e-3
    history = run_case(
        bodies={"ball": il.Mass(0.01, velocity=1.0), body: bodies[body]},
        contacts=[contact | {"law": law} | ({"lever_arm": 0.01} if body == "shaft" else {})],
        solve=in_steps(duration, "newmark", mesh(4), dt=1e-7),
    )
    (span,) = history.contacts
    total = history.scene.bodies[body].moving_mass
    assert span.end is not None
    away = span.impulse / total - (1.0 - span.impulse / 0.01)
    assert away == pytest.approx(0.3, abs=5e-4)


@pytest.mark.parametrize(
    "law",
    [Hertz(STIFFNESS), HuntCrossley(STIFFNESS, restitution=0.5), Flores(STIFFNESS, restitution=0.1), Hertz(1e13, 3.0)],
    ids=["hertz", "hunt_crossley", "flores", "cubic"],
)
@pytest.mark.parametrize("share", [0.05, 0.1, 0.2, 0.25, 0.35, 0.5, 1.0, 3.0, 30.0])
def test_a_coarse_explicit_run_is_right_or_warned_of_or_fails(law: HuntCrossley, share: float) -> None:
    power = law.exponent + 1.0
    deepest = (power * MASS * SPEED**2 / (2.0 * law.stiffness)) ** (1.0 / power)
    right = 1.0 if (pair := law.restitutions()) is None else pair.true
    for start in (0.0, 0.21, 0.5, 0.83):
        dt = share * 2.9 * deepest / SPEED
        try:
            history = run(
                *on_wall(law, CentralDifference(), dt, 12.0 * dt + 20.0 * deepest / SPEED, start * SPEED * dt)
            )
        except StepError:
            continue
        if [warned.code for warned in history.warnings] == []:
            # Without a warning (w dt)^2 stays below 1/4: leapfrog is then a few per cent off at most.
            assert returned(history) == pytest.approx(right, abs=0.02)


def test_an_explicit_step_beyond_stability_is_refused() -> None:
    _, duration = hertz_time()
    with pytest.raises(
        StepError,
        match=r"ball\|wall: at this overlap the tangent stiffness of the power law exceeds the stability limit",
    ):
        run(*on_wall(Hertz(STIFFNESS), CentralDifference(), duration, 3.0 * duration))


def test_a_touch_at_rest_is_warned_of() -> None:
    bodies, law = (Mass("ball", MASS), Wall("wall")), HuntCrossley(STIFFNESS, restitution=0.5)
    history = run(*in_a_row(bodies, None, law, Newmark(), StepRule(dt=1e-5), duration=0.1, gravity=9.81))
    (warned,) = history.warnings
    assert warned.code == "slow_touch"
    assert warned.text.startswith("ball|wall: touches slower than slowest_approach")
    assert warned.text.endswith(": 1")


def facts() -> tuple:
    scene = on_wall(Hertz(STIFFNESS), Newmark(), 1.0, 1.0)
    return sides(*scene, scene.scene.contacts[0])


def test_located_events_begin_the_touch_where_the_gap_closes() -> None:
    _, duration = hertz_time()
    errors = []
    for steps in (50, 100, 200):
        scene = on_wall(Hertz(STIFFNESS), ExactModal(), duration / steps, 2.0 * duration, 0.3137 * SPEED * duration)
        history = run(*scene.but(events="located"))
        assert [event.kind for event in history.events] == ["close", "open"]
        assert history.events[0].time == pytest.approx(0.3137 * duration, rel=1e-12)
        assert returned(history) == pytest.approx(1.0, abs=1e-13)
        errors.append((history.events[1].time - history.events[0].time) / duration - 1.0)
    # Second order; the next term is smaller by the step over the duration.
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


def test_khulief_shabana_on_a_continuous_rod_is_solved_from_event_to_event() -> None:
    rod = Rod("rod", (STEEL,), FREE, CLAMPED)
    law = KhuliefShabana(STIFFNESS, 0.5, effective_mass=MASS)
    spring = law.spring(*facts(), math.nan)
    scene = struck(rod, Continuous(), law, mass=MASS, velocity=SPEED, round_trips=4.0)
    same = scene.but(law=Penalty(*spring))
    history, other = run(*scene), run(*same)
    assert history.dt is None
    times = np.linspace(0.0, scene.scene.duration, 50)
    assert (history.evaluate(times, "velocity:hammer") == other.evaluate(times, "velocity:hammer")).all()


def test_hertz_on_a_continuous_rod_is_the_limit_of_the_mesh() -> None:
    speeds = []
    for model, step in ((Continuous(), StepRule(dt=2e-8)), (FiniteElement(200), StepRule(points_per_period=20))):
        bodies = Mass("ball", STEEL.mass, SPEED), Rod("rod", (STEEL,), FREE, CLAMPED)
        scene = in_a_row(bodies, model, Hertz(1e11), Newmark(), step, round_trips=4.0)
        history = run(*scene)
        speeds.append(returned(history))
        assert len(history.contacts) == 1
    # The mesh is wrong by (k h)^2/24 of the waves that the contact makes: a few of 1e-5 with 200 elements.
    assert speeds[0] == pytest.approx(speeds[1], abs=1e-4)


def test_the_approach_speed_is_that_of_the_touch_under_leapfrog() -> None:
    """A mass that a spring still pushes as it meets a wall: the speed was that in the middle of the step before.

    The error was of the order of the step then. 1 kg is pressed by 3 mm into a spring of 1e6 N/m and meets the wall
    after 1 mm, at v0 = w sqrt(3^2 - 2^2) mm; from there both forces act, and scipy integrates.
    """
    pressed, way, k, stiffness, factor = 3e-3, 1e-3, 1e6, 3e7, 1.5 * 0.5
    speed = np.sqrt(k * (pressed**2 - (pressed - way) ** 2))
    touch, end = np.arccos((pressed - way) / pressed) / np.sqrt(k), 2e-3

    def motion(_: float, y: np.ndarray) -> list[float]:
        indentation = max(0.0, y[0] - way)
        wall = stiffness * indentation**1.5 * max(0.0, 1.0 + factor / speed * y[1])
        return [y[1], k * max(0.0, pressed - y[0]) - wall]

    exact = solve_ivp(motion, (touch, end), [way, speed], rtol=1e-11, atol=1e-15, max_step=1e-5).y[0, -1]
    errors = []
    for dt in (1.3e-5, 3.25e-6):
        spring = il.Contact("w", "m", {"kind": "penalty", "stiffness": k}, gap=-pressed, overlap="allowed")
        law = {"kind": "hunt_crossley", "stiffness": stiffness, "restitution": 0.5}
        case = il.Case(
            bodies={"w": il.Wall(), "m": il.Mass(1.0), "z": il.Wall()},
            contacts=[spring, il.Contact("m", "z", law, gap=way)],
            solve={"duration": end, "integrator": {"kind": "central_difference"}, "step": {"dt": dt}},
        )
        errors.append(abs(float(il.run(case).evaluate(end, "position:m")) - exact) / way)
    assert errors[0] < 1e-4
    assert errors[1] < 1e-5


@pytest.mark.parametrize("scheme", ["newmark", "bathe", "generalised_alpha"])
@pytest.mark.parametrize("restitution", [1e-3, 1e-6])
def test_steps_in_which_hysteresis_turns_the_mass_round_are_warned_of(scheme: str, restitution: float) -> None:
    """With a nominal restitution of 1e-6 a mass came back from a wall with up to a quarter of its speed, unwarned.

    The damping of Flores' law stops it: it returns with less than 1/(a v0) = e/(1.6 (1 - e)) of its speed.
    """
    law = {"kind": "flores", "stiffness": 3e7, "restitution": restitution}
    history = run_case(
        bodies={"m": il.Mass(1.0, velocity=1.0), "w": il.Wall()},
        contacts=[il.Contact("m", "w", law, gap=1.03e-4)],
        solve={"duration": 0.01, "integrator": {"kind": scheme}, "step": {"dt": 1e-5}},
    )
    wrong = -float(history.evaluate(0.01, "velocity:m")) > 2.0 * restitution / 1.6
    assert wrong == (restitution == 1e-6) == ("coarse_contact" in {warning.code for warning in history.warnings})
