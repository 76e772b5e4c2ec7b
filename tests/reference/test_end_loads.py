"""A force over time on an end: closed forms of a uniform rod, orders of the schemes, balances of energy and momentum.

The rod: 0.5 m, c 5000 m/s, Z 4000 N s/m, so T = 0.2 ms. Its end moves with F(t)/Z and, free, with 2 F(t - n T)/Z more
from each echo.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.contact.penalty import Penalty
from impactlab.errors import CaseError
from impactlab.exact.solve import solve
from impactlab.history.base import AbstractHistory
from impactlab.history.extremes import extremes
from impactlab.metrics.impact import momentum_error
from impactlab.scene import End, Mass
from impactlab.scene.bodies import FunctionLoad, SampledLoad
from impactlab.simulate import prepare, run
from impactlab.testing.plain_loop import PlainLoop
from impactlab.testing.strategies import in_other_units, mirrored
from impactlab.types import Array
from tests.reference.exact_scenes import CLAMPED, FREE, HARD, point, rod, scene
from tests.solving import in_steps, mesh, run_case

Z, T, F = 4000.0, 2e-4, 1e4
SINE = "1e4*sin(2*pi*t/2e-4)"
PULSE = {"t": [0, 1e-5, 5e-5, 6e-5], "f": [0, "10 kN", 1e4, 0]}  # over before the run ends: it stays 0
MESH = {"kind": "finite_element", "elements": 20, "mass": "lumped"}
SCHEMES = [
    "newmark",
    "central_difference",
    "midpoint",
    "hht_alpha",
    "generalised_alpha",
    "nonsmooth_generalised_alpha",
    "bathe",
    "moreau_jean",
    "contact_stabilised_newmark",
]
KEEPING = {"newmark", "central_difference", "midpoint", "moreau_jean", "contact_stabilised_newmark"}  # damp nothing


def pushed(
    force: Any, integrator: Any = "newmark", model: Any = MESH, dt: Any = 1e-6, duration: float = 2 * T, **more: Any
) -> il.Case:
    """A rod under a force on its left end, without contacts."""
    ends = {"left": {"force": force}, "right": more.pop("right", "free")}
    rod = il.Rod(length=0.5, area=1e-4, material={"young": 200e9, "density": 8000.0}, ends=ends)
    chosen = {"kind": integrator} if isinstance(integrator, str) else integrator
    solve = {"duration": duration, "model": model, "integrator": chosen, **({"step": {"dt": dt}} if dt else {}), **more}
    return il.Case(bodies={"rod": rod}, solve=solve, probes=[{"body": "rod", "at": 0.0, "quantity": "velocity"}])


def largest(book: Any) -> float:
    """The largest error of the energy balance over the largest work."""
    return float(np.abs(book.balance).max() / np.abs(book.work).max())


def moved(history: AbstractHistory, duration: float = 2 * T) -> Array:
    return history.evaluate(np.linspace(0.0, duration, 201), "displacement:rod@0")


def trapezoid(t: Array) -> Array:
    return np.interp(t, [0.0, 1e-5, 5e-5, 6e-5], [0.0, F, F, 0.0])


@pytest.mark.parametrize("integrator", ["newmark", "central_difference"])
def test_a_trapezoid_and_its_echoes(integrator: str) -> None:
    """v(0, t) = F(t)/Z + 2 F(t - T)/Z + 2 F(t - 2T)/Z; the mesh smears a kink of v with order 1."""
    t = np.linspace(0.0, 2.5 * T, 501)
    exact = (trapezoid(t) + 2.0 * trapezoid(t - T) + 2.0 * trapezoid(t - 2.0 * T)) / Z
    errors = []
    for elements in (100, 400):
        mesh = MESH | {"elements": elements}
        history = il.run(pushed(PULSE, integrator, mesh, 5e-5 / elements, 2.5 * T))
        errors.append(np.sqrt(np.mean((history.evaluate(t, "velocity:rod@0") - exact) ** 2)) / (F / Z))
    assert errors[1] < 0.03
    assert 0.8 < np.log2(errors[0] / errors[1]) / 2.0 < 1.2
    assert history.load_impulses["rod"] == pytest.approx(F * 5e-5, rel=1e-12)
    assert history.evaluate([2.5 * T], "momentum:rod") == pytest.approx([F * 5e-5], rel=1e-9)
    assert "displacement:rod@0" in history.channels(), "a loaded end is recorded without a probe"


@pytest.mark.parametrize("integrator", SCHEMES)
def test_schemes_keep_their_order(integrator: str) -> None:
    """Second order under a smooth force that is there at t = 0; energy closes, to rounding where nothing damps."""
    force = "1e4*cos(2*pi*t/2e-4)"
    mesh = MESH | {"elements": 6}  # its highest period is T/6, which 100 steps to T resolve
    exact = moved(il.run(pushed(force, integrator, mesh, T / 6400)))
    errors = [np.abs(moved(il.run(pushed(force, integrator, mesh, T / n))) - exact).max() for n in (100, 200)]
    assert 1.8 < np.log2(errors[0] / errors[1]) < 2.3
    book = il.run(pushed(force, integrator, mesh, T / 200)).energy
    assert largest(book) < (1e-13 if integrator in KEEPING else 1e-4)


@pytest.mark.parametrize("integrator", SCHEMES)
def test_a_constant_force_as_a_formula_or_a_table(integrator: str) -> None:
    """The same motion, to rounding; a table of one value is that constant force, bit by bit."""
    constant = moved(il.run(pushed(F, integrator)))
    assert np.abs(moved(il.run(pushed("1e4 + 0*t", integrator))) - constant).max() < 1e-13 * np.abs(constant).max()
    table = {"t": np.linspace(0.0, 2 * T, 7), "f": np.full(7, F)}
    assert np.array_equal(moved(il.run(pushed(table, integrator))), constant)


@pytest.mark.parametrize(
    ("model", "integrator"),
    [
        ({"kind": "modal", "elements": 20}, "exact_modal"),
        ({"kind": "modal", "basis": "craig_bampton", "elements": 20, "modes": 19}, "newmark"),
        ({"kind": "finite_element", "elements": 20}, {"kind": "adaptive", "relative_tolerance": 1e-9}),
    ],
    ids=["modes", "Craig-Bampton", "adaptive"],
)
@pytest.mark.parametrize("force", [SINE, PULSE], ids=["sine", "pulse"])
def test_modes_and_adaptive_steps_against_the_mesh(model: Any, integrator: Any, force: Any) -> None:
    """They agree with all modes of the mesh, and close energy and momentum."""
    step = 2e-7 if isinstance(integrator, str) else None
    found, mesh = (
        il.run(pushed(force, integrator, model, step)),
        il.run(pushed(force, "midpoint", MESH | {"mass": "consistent"}, 1e-7)),
    )
    assert np.abs(moved(found) - moved(mesh)).max() < 1e-3 * np.abs(moved(mesh)).max()
    assert largest(found.energy) < 1e-8
    assert momentum_error(found, found, found.scene) < 1e-9


def test_the_stepped_delay_line() -> None:
    """A hertz contact far away makes the continuous rod a delay line: F(t)/Z plus echoes, as means over steps."""
    rod = il.Rod(length=0.5, area=1e-4, material={"young": 200e9, "density": 8000.0}, ends={"left": {"force": PULSE}})
    law = {"kind": "hertz", "stiffness": 1e9}
    history = run_case(
        bodies={"far": il.Mass(1.0), "rod": rod},
        contacts=[il.Contact("rod.right", "far", gap=1.0, law=law)],
        solve={"duration": 2.5 * T, "model": {"kind": "continuous"}, "step": {"dt": 1e-6}},
    )
    t = np.arange(0, 500) * 1e-6  # ends of steps: displacements are exact there, as 1 us divides all breaks
    once = np.concatenate(([0.0], np.cumsum(0.5e-6 * (trapezoid(t[1:]) + trapezoid(t[:-1])))))
    later = [np.interp(t - n * T, t, once, left=0.0) for n in (1, 2)]
    exact = (once + 2.0 * later[0] + 2.0 * later[1]) / Z
    assert history.evaluate(t, "displacement:rod@0") == pytest.approx(exact, abs=1e-12 * exact.max())
    assert largest(history.energy) < 1e-13


def test_located_events_cut_the_load_too() -> None:
    """A rod pushed against a mass: the impulse given is that of the force, whatever the cuts."""
    rod = il.Rod(length=0.5, area=1e-4, material={"young": 200e9, "density": 8000.0}, ends={"left": {"force": PULSE}})
    law = {"kind": "penalty", "stiffness": 1e8}
    solve = {"duration": 6 * T, "model": {"kind": "modal", "modes": 20}, "integrator": {"kind": "exact_modal"}}
    case = il.Case(
        bodies={"rod": rod, "ball": il.Mass(0.1)},
        contacts=[il.Contact("rod.right", "ball", gap=1e-5, law=law)],
        solve={**solve, "step": {"dt": 1e-6}, "events": "located"},
    )
    history = il.run(case)
    assert history.contacts, "they meet"
    assert history.load_impulses["rod"] == pytest.approx(F * 5e-5, rel=1e-12)
    total = history.evaluate([history.duration], "momentum:rod") + history.evaluate([history.duration], "momentum:ball")
    assert total == pytest.approx([F * 5e-5], rel=1e-9)
    assert largest(history.energy) < 1e-9


@pytest.mark.parametrize("integrator", SCHEMES)
def test_the_plain_loop_takes_the_same_steps(integrator: str) -> None:
    case = pushed(PULSE, integrator, dt=1.7e-6)
    loop, history = PlainLoop(prepare(*case.simulation())), il.run(case)
    for _ in range(150):
        loop.step()
    u = history.evaluate(np.array([loop.time]), "displacement:rod@0")
    assert loop.state[loop.parts["rod"]][0] == pytest.approx(float(u[0]), rel=1e-11)


@pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
def test_a_beam_under_a_force_over_time(theory: str) -> None:
    """The mesh and the characteristics agree, and a cantilever pushed slowly stands in its static deflection."""
    steel = {"young": 210e9, "density": 7800.0, "shear_modulus": 81e9}
    ends = {"left": "clamped", "right": {"force": {"t": [0.0, 1.0], "f": [0.0, 10.0]}}}
    beam = il.Beam(length=1.0, section={"width": 0.02, "height": 0.02}, material=steel, theory=theory, ends=ends)
    solve = {"duration": 1.0, "model": {"kind": "finite_element", "elements": 8}, "step": {"dt": 1e-4}}
    history = il.run(il.Case(bodies={"beam": beam}, solve=solve))
    stiffness = 3.0 * 210e9 * (0.02**4 / 12.0)
    static = (
        10.0 / stiffness * (1.0 + (3.0 * 210e9 * 0.02**2 / 12.0 / (5 / 6 * 81e9) if theory == "timoshenko" else 0.0))
    )
    # it swings about it by the rate of the force over its frequency, 16.7 Hz: 1/(2 pi 16.7) = 1 %
    assert history.evaluate([1.0], "displacement:beam@1") == pytest.approx([static], rel=0.012)
    assert largest(history.energy) < 1e-9


def test_a_torque_over_time_is_one_of_the_rod_at_the_arm() -> None:
    steel = {"shear_modulus": 80e9, "density": 8000.0}
    shaft = il.Shaft(length=0.5, section={"diameter": 0.02}, material=steel, ends={"right": {"torque": "5*t/1e-3"}})
    history = il.run(il.Case(bodies={"shaft": shaft}, solve={"duration": "1 ms", "model": MESH, "step": {"dt": 1e-6}}))
    inertia = 8000.0 * np.pi * 0.02**4 / 32.0 * 0.5
    spin = history.evaluate([1e-3], "momentum:shaft")[0] / inertia
    assert spin == pytest.approx(0.5 * 5.0 * 1e-3 / inertia, rel=1e-9)


def test_integrals_of_samples() -> None:
    """Of 0 before 1, then a line to 4 at 3, then 4: exact at breaks and between."""
    load = SampledLoad((1.0, 3.0), (0.0, 4.0))
    assert load.impulse(np.array([0.5, 1.0, 2.0, 3.0, 5.0])) == pytest.approx([0.0, 0.0, 1.0, 4.0, 12.0])
    assert load.reaches(2.0) == (True, True)
    assert load.reaches(3.5) == (True, False)
    assert SampledLoad((1.0, 3.0), (1.0, 0.0)).reaches(9.0) == (False, True)
    doubled = load.scaled(2.0, 10.0)
    assert doubled.at(np.array([20.0])) == pytest.approx([4.0])
    sine = FunctionLoad(np.sin).scaled(3.0, 2.0)
    assert sine.at(np.array([np.pi])) == pytest.approx([3.0])
    assert sine.largest(2.0 * np.pi) == pytest.approx(3.0)


def test_a_free_frame_carries_the_work_of_a_load() -> None:
    """Of a body that already moves, F V t is no energy at stake: the balance scale is the same at rest and moving."""
    at_rest = il.run(pushed(PULSE))
    moving = il.run(pushed(PULSE).with_("bodies.rod.velocity", 50.0))
    assert moving.energy.at_stake == pytest.approx(at_rest.energy.at_stake, rel=1e-6)
    assert largest(moving.energy) < 1e-9
    assert all(a < b for a, b in pairwise(at_rest.energy.time))


# Exact, event to event. Units: c = Z = L = 1, so a round trip is 2.
RAMP = SampledLoad((0.0, 4.0), (0.0, 3.2))  # 0.8 t
BLOCK = SampledLoad((0.0, 0.5, 1.25, 1.75), (0.0, 0.8, 0.8, 0.0))


def on_rod(load: SampledLoad, right: End, left: End | None = None, duration: float = 4.0) -> AbstractHistory:
    held = replace(left or End("free"), load=load)
    return solve(*scene([rod(left=held, right=right)], [], duration))


def closes(history: AbstractHistory) -> None:
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def test_exact_trapezoid_and_echoes() -> None:
    """v(0, t) = F(t) + 2 sum (+-1)^n F(t - 2 n): + from a free end, - from a clamped one."""
    t = np.linspace(0.0, 12.0, 481)
    for right, sign in ((FREE, 1.0), (CLAMPED, -1.0)):
        history = on_rod(BLOCK, right, duration=12.0)
        exact = BLOCK.at(t) + 2.0 * sum(sign**n * BLOCK.at(t - 2.0 * n) for n in range(1, 7))
        assert history.evaluate(t, "velocity:rod@0") == pytest.approx(exact, abs=1e-12)
        closes(history)
    assert on_rod(BLOCK, FREE).evaluate([4.0], "momentum:rod") == pytest.approx([1.0], rel=1e-13)


@pytest.mark.parametrize("kind", ["mass", "spring", "dashpot"])
def test_exact_ramp_on_an_end_that_is_held(kind: str) -> None:
    """Until the echo the rod is a dashpot Z: m v' + (Z + d) v + k u = 0.8 t."""
    history = on_rod(RAMP, CLAMPED, End(kind, 0.7), duration=1.99)  # type: ignore[arg-type]
    t = np.linspace(0.0, 1.9, 20)
    expected = {
        "mass": 0.8 * (t - 0.7 * (1.0 - np.exp(-t / 0.7))),
        "spring": 0.8 / 0.7 * (1.0 - np.exp(-0.7 * t)),
        "dashpot": 0.8 * t / 1.7,
    }[kind]
    assert history.evaluate(t, "velocity:rod@0") == pytest.approx(expected, abs=1e-13)
    closes(history)


@pytest.mark.parametrize("law", [HARD, Penalty(1e6)], ids=["hard", "stiff spring"])
def test_exact_a_mass_strikes_an_end_under_a_ramp(law: Any) -> None:
    """Contact force Z v - 0.8 t: M v' = -v + 0.8 t, v = 0.8 (t - M) + (1 + 0.8 M) exp(-t/M), until v = 0.8 t."""
    bar, hammer = rod(left=replace(FREE, load=RAMP), right=CLAMPED), Mass("hammer", 2.0, 1.0)
    history = solve(*scene([hammer, bar], [(point(hammer), point(bar, "left"), 0.0, law)], 1.99))
    opens = 2.0 * np.log(2.6 / 1.6)
    t = np.linspace(0.01, 0.99 * opens, 9)
    within = 1e-12 if law is HARD else 3e-6  # the spring lags behind by Z/k, times up to 1.3
    exact = 0.8 * (t - 2.0) + 2.6 * np.exp(-t / 2.0)
    assert history.evaluate(t, "velocity:hammer") == pytest.approx(exact, abs=within)
    assert history.evaluate(t, "force:hammer|rod.left") == pytest.approx(exact - 0.8 * t, abs=within)
    assert history.events[-1].time == pytest.approx(opens, abs=within)
    lost = max(history.energy.largest_gain, history.energy.largest_loss)
    assert lost < (1e-12 if law is HARD else 1e-10), "as without a load: the stiff spring rounds"


def test_exact_a_sine_of_many_lines_and_the_limit() -> None:
    """1500 lines and their echoes, to rounding; more than 2000 and formulas are refused by name."""
    times = np.linspace(0.0, 12.0, 1501)
    history = on_rod(SampledLoad(tuple(times), tuple(np.sin(times))), FREE, duration=12.0)
    t = np.linspace(0.0, 11.99, 997)
    exact = sum((1.0 + (n > 0)) * np.interp(t - 2.0 * n, times, np.sin(times), left=0.0) for n in range(6))
    assert history.evaluate(t, "velocity:rod@0") == pytest.approx(exact, abs=1e-11)
    closes(history)
    model = {"kind": "continuous"}
    many = {"t": np.linspace(0.0, 2 * T, 2002), "f": np.linspace(0.0, 1.0, 2002)}
    with pytest.raises(CaseError, match="has 2001 straight lines within the run"):
        il.run(pushed(many, model=model, dt=None))
    with pytest.raises(CaseError, match="is a formula; the exact solver supports only straight lines"):
        il.run(pushed(SINE, model=model, dt=None))


def test_exact_run_is_the_reference_of_the_mesh() -> None:
    """The mesh tends to it; sweeps and sensitivities of loaded rods are made of runs of their own."""
    exact_case = pushed(PULSE, model={"kind": "continuous"}, dt=None)
    mesh = il.run(pushed(PULSE, "newmark", MESH | {"elements": 400}, 2.5e-7))
    exact = il.run(exact_case)
    assert np.abs(moved(mesh) - moved(exact)).max() < 2e-3 * np.abs(moved(exact)).max()
    channel = il.Sampled("displacement:rod@0", (T,))
    swept = il.sweep(exact_case, {"bodies.rod.area": [1e-4, 2e-4]}, quantities=[channel])
    values = np.ravel(swept[channel.channel].values)
    assert values == pytest.approx([F * 5e-5 / Z, 0.5 * F * 5e-5 / Z], rel=1e-12)


@pytest.mark.parametrize("force", [SINE, "1e4*cos(2*pi*t/2e-4)", PULSE], ids=["sine", "cosine", "pulse"])
@pytest.mark.parametrize("integrator", SCHEMES)
def test_momentum_given_is_momentum_taken(integrator: str, force: Any) -> None:
    """Under every scheme, also where the run ends within a step."""
    for duration in (2.0 * T, 2.0033 * T):
        history = il.run(pushed(force, integrator, duration=duration))
        assert momentum_error(history, history, history.scene) < 1e-13


def test_mirrored_scene_has_the_mirrored_solution() -> None:
    """And other units: powers of 4, so that not even a digit changes."""
    case = pushed(PULSE, "central_difference", right={"mass": 0.1})
    there = run(*mirrored(case.simulation()))
    assert there.evaluate([T], "displacement:rod@0.5") == pytest.approx(-moved(il.run(case))[100], rel=1e-12)
    scaled = run(*in_other_units(case.simulation(), mass=4.0, length=16.0, time=0.25))
    end = scaled.scene.duration
    assert scaled.evaluate([end], "displacement:rod@0")[0] == 16.0 * moved(il.run(case))[-1]


@pytest.mark.parametrize("duration", [1e-3, 1e-2, 1e-1])
def test_the_summary_sees_a_short_pulse_in_a_long_run(duration: float) -> None:
    """1 us of a load to 10 kN, then nothing for up to 0.1 s: the force is F(t - x/c) in a rod without end."""
    pulse = {"t": [0, 5e-7, 1e-6], "f": [0, F, 0]}
    continuous = {"kind": "continuous"}
    case = pushed(pulse, "newmark", continuous, None, duration, right="infinite")
    case = case.with_("probes", [{"body": "rod", "at": 0.3, "quantity": each} for each in ("force", "velocity")])
    history = il.run(case)
    assert extremes(history, "force:rod@0.3") == pytest.approx((0.0, F), abs=1e-6)
    assert extremes(history, "velocity:rod@0.3") == pytest.approx((0.0, F / Z), abs=1e-9)


def test_the_summary_sees_every_record() -> None:
    """A mesh for 20 ms, 300 times the pulse: its largest velocity is that of the record, wherever that was taken."""
    history = il.run(pushed(PULSE, "newmark", MESH, 1e-6, 2e-2, right="infinite", records=20_000))
    times = np.arange(20_001) * 1e-6
    assert extremes(history, "velocity:rod@0")[1] == history.evaluate(times, "velocity:rod@0").max()


@pytest.mark.parametrize("scheme", ["central_difference", "generalised_alpha", "newmark"])
def test_a_pulse_between_two_instants_of_a_scheme_is_not_missed(scheme: str) -> None:
    """Its impulse of 0.1 N s on 1 kg was lost where a scheme takes forces at instants, without a word."""
    pulse = {"t": [0.0, 0.5011, 0.5012, 0.5013], "f": [0.0, 0.0, 1000.0, 0.0]}
    steel_like = {"young": 1.0, "density": 1.0}
    case = il.Case(
        bodies={"rod": il.Rod(length=1.0, area=1.0, material=steel_like, ends={"left": {"force": pulse}})},
        solve=in_steps(3.0, scheme, mesh(8, "lumped"), dt=0.02),
    )
    assert il.run(case).evaluate(3.0, "momentum:rod") == pytest.approx(0.1, rel=1e-9)
