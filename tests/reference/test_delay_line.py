"""The stepped delay line against the exact solution of the same constant spring and dashpot."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any, final

import numpy as np
import pytest

import impactlab as il
from impactlab import metrics
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.penalty import Penalty
from impactlab.errors import CaseError, PairingError
from impactlab.exact.solve import solve
from impactlab.integrators.newmark import Newmark
from impactlab.models.continuous import Continuous
from impactlab.scene import End, Mass, Probe, Rod, Wall
from impactlab.scene.bodies import Table
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import prepare, run
from impactlab.testing.scenes import CLAMPED, FREE, STEEL, in_a_row
from impactlab.types import SideFacts, Start

SPRING = Penalty(stiffness=2e9, damping=5e3)


@final
@dataclasses.dataclass(frozen=True)
class Asked(AbstractContactLaw):
    """A spring and dashpot that does not declare itself as one: it is evaluated step by step."""

    needs = SPRING.needs

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return SPRING.begin(left, right, dt)

    respond = staticmethod(Penalty.respond)


def scene(law: AbstractContactLaw, far: End, points: float, mirrored: bool = False) -> Simulation:
    ends = (far, FREE) if mirrored else (FREE, far)
    bodies = Mass("hammer", STEEL.mass, -1.0 if mirrored else 1.0), Rod("rod", (STEEL,), *ends)
    rule = StepRule(points_per_period=points)
    return in_a_row(bodies[::-1] if mirrored else bodies, Continuous(), law, None, rule)


def exact(case: Simulation) -> Any:
    return solve(*case.but(law=SPRING))


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize(
    "far", [CLAMPED, FREE, End("spring", 1e9), End("dashpot", 2e4), End("mass", 1.0)], ids=lambda e: e.kind
)
def test_it_converges_to_the_exact_solution(far: End, mirrored: bool) -> None:
    errors = []
    for points in (4, 16, 128):
        case = scene(Asked(), far, points, mirrored)
        measured = metrics.errors(run(*case), "exact", exact(case), case.scene)
        errors.append((measured["mass_displacement"], measured["face_displacement"]))
    # A front smears over one step at each reflection, unless the delay is a whole number of steps: first order at
    # least, with a constant that varies from step to step; 32 times finer, so a factor 16 is required.
    for coarse, fine in zip(errors[0], errors[2], strict=True):
        assert fine < coarse / 16
        assert fine < 1e-5


def test_a_hard_contact_beside_a_power_law_converges_to_the_exact_solution() -> None:
    """The wave that wave_identification looks for arrives at the face itself: it needs no messenger there."""
    steel = {"young": 2e11, "density": 8000.0}
    rod = il.Rod(length=0.5, area=1e-3, material=steel)  # a transit of 0.1 ms
    struck = il.Contact("hammer", "rod.left", {"kind": "wave_identification"})
    passed_on = il.Contact("rod.right", "last", {"kind": "hertz", "stiffness": 1e8, "exponent": 1.0})
    case = il.Case(
        bodies={"hammer": il.Mass(1.0, velocity=1.0), "last": il.Mass(1.0), "rod": rod},
        contacts=[struck, passed_on],
        solve={"duration": 6e-4, "model": {"kind": "continuous"}, "step": {"dt": 1e-5}},
    )
    exact = il.run(case.with_("contacts.1.law", {"kind": "penalty", "stiffness": 1e8}))
    wanted = {name: float(exact.evaluate(6e-4, f"velocity:{name}")) for name in ("hammer", "last")}
    errors = []
    for steps in (50, 200, 800):
        history = il.run(case.with_("solve.step", {"dt": 1e-4 / steps}))
        errors.append(
            max(abs(float(history.evaluate(6e-4, f"velocity:{name}")) - value) for name, value in wanted.items())
        )
    assert all(fine < coarse / 3.0 for coarse, fine in itertools.pairwise(errors))
    assert errors[-1] < 2e-4


def test_impulses_are_refused_for_the_mass_they_strike_is_zero() -> None:
    with pytest.raises(PairingError, match="the mass that they would strike at the end of a continuous rod is zero"):
        prepare(*scene(ImpulseMomentum(), CLAMPED, 10))


def test_a_step_longer_than_the_transit_is_refused() -> None:
    case = scene(Asked(), CLAMPED, 10).but(step=StepRule(dt=6e-5))
    with pytest.raises(
        CaseError, match=r"longer than the transit 5.81869e-05 s|beyond the stability limit 5.81869e-05 s"
    ):
        prepare(*case)


BENT = Table((0.0, 0.15, 0.3), (0.0, 2e-6, -1e-6))


@pytest.mark.parametrize("far", [FREE, End("spring", 1e9), End("mass", 1.0)], ids=lambda end: end.kind)
def test_its_two_waves_give_every_place_at_every_time(far: End) -> None:
    """From the motion of its ends, with waves on their way at t = 0; a probe reads the same."""
    probes = tuple(Probe("rod", x, each) for x in (0.0, 0.1) for each in ("stress", "velocity", "displacement"))
    errors = []
    for points in (4, 32):
        case = scene(Asked(), far, points).but(probes=probes)
        bodies = dict(case.scene.bodies)
        bodies["rod"] = dataclasses.replace(bodies["rod"], displacement=BENT, velocity=0.3)
        case = case.but(bodies=bodies)
        history, answer = run(*case), exact(case)
        assert history.field_times("rod") is None
        t = history.dt * np.arange(5, history.cost.steps, max(1, history.cost.steps // 41))  # records
        worst = {}
        for quantity in ("displacement", "velocity", "stress"):
            pairs = [(history.field("rod", at, quantity), answer.field("rod", at, quantity)) for at in t]
            size = max(np.abs(there.values).max() for _, there in pairs)
            # Fronts are smeared over a step: their neighbourhood is small, and so is the mean error.
            worst[quantity] = np.mean([np.abs(ours.values - there.values) for ours, there in pairs]) / size
            along = [history.field("rod", at, quantity, 0.1).values[0] for at in t]
            assert along == pytest.approx(history.evaluate(t, f"{quantity}:rod@0.1"), abs=1e-10 * size)
        face = [history.field("rod", at, "displacement", 0.0).values[0] for at in t]
        assert face == pytest.approx(history.evaluate(t, "displacement:rod@0"), abs=1e-17)
        errors.append(worst)
    for quantity, error in errors[1].items():
        assert error < 0.3 * errors[0][quantity] < 1e-2


def test_waves_of_few_records_are_refused() -> None:
    case = scene(Asked(), CLAMPED, 100).but(probes=(Probe("rod", 0.1, "stress"),), records=4)
    with pytest.raises(CaseError, match=r"records .* s apart do not resolve the waves of 'rod'"):
        run(*case)


def test_an_integrator_is_ignored_with_a_warning() -> None:
    case = scene(Asked(), CLAMPED, 10).but(integrator=Newmark())
    assert "integrator_unused" in {warned.code for warned in run(*case).warnings}


def test_a_moving_rod_meets_a_wall() -> None:
    """With a stiff spring the bar leaves after about 2 L/c with the speed it came with."""
    bodies = Rod("rod", (STEEL,), FREE, FREE, velocity=1.0), Wall("stop")
    step = StepRule(points_per_period=20)
    case = in_a_row(bodies, Continuous(), Asked(), None, step, gaps=1e-5, round_trips=2.0)
    measured = metrics.errors(run(*case), "exact", exact(case), case.scene)
    assert measured["face_displacement"] < 1e-4
    assert measured["impulse"] < 1e-4
    assert measured["events_missed"] == 0


@pytest.mark.parametrize("lengths", [(1.0,), (0.4, 0.6)], ids=["line", "chain"])
def test_a_free_end_has_no_strain_when_a_front_meets_it_at_the_end_of_the_run(lengths: tuple[float, ...]) -> None:
    """Right half stretched by 2e-3 at t = 0: its front meets the left end at L/2c = 100 us, where the run ends."""
    pieces = [{"length": x, "area": 1e-4, "material": {"young": 2e11, "density": 8000.0}} for x in lengths]
    far_away = il.Contact("rod.right", "wall", {"kind": "hertz", "stiffness": 1e9}, gap=0.01)
    case = il.Case(
        bodies={"rod": il.Rod(segments=pieces, displacement={"x": [0, 0.5, 1], "u": [0, 0, -1e-3]}), "wall": il.Wall()},
        contacts=[far_away],
        probes=[{"body": "rod", "at": 0.0, "quantity": each} for each in ("strain", "velocity")],
        snapshots=[1e-4],
        solve={"duration": 1e-4, "model": {"kind": "continuous"}, "step": {"dt": 1e-6}},
    )
    history = il.run(case)
    t = np.linspace(0.0, 1e-4, 401)
    assert np.abs(history.evaluate(t, "strain:rod@0")).max() < 1e-15
    assert history.field("rod", 1e-4, "strain", [0.0]).values == pytest.approx([0.0], abs=1e-15)
    assert np.abs(history.waves("rod", 0.0, "strain", t).total).max() < 1e-15
    assert history.field("rod", 1e-4, "velocity", [0.0]).values == pytest.approx([0.0], abs=1e-11)
