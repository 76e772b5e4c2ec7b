"""impactlab itself: the exact description and three that step.

Like the others, it runs at the best setting of a scan.

The time is ``solve_s`` of `impactlab.run`: steps or marching, records and dated events, without set-up (case,
modes, factors, memory) and without the checks of a finished run. The exact solution has no settings.
``automatic`` (`impactlab.refine.choice`) chooses during set-up; the time to choose stands beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from benchmarks.peers.cases import SHORTEST_FLIGHT, Case, Outcome
from benchmarks.peers.run import Found, Run, Setting, version_of
from impactlab import api
from impactlab.bases.craig_bampton import CraigBampton
from impactlab.history import AbstractHistory
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene.method import Simulation, StepRule, Tolerance, is_exact
from impactlab.simulate.plan import prepare
from impactlab.simulate.stepped_run import walk
from impactlab.simulate.stepping.results.history import RecordedHistory
from impactlab.simulate.stepping.setup.assembly import Assembly

NAME = "impactlab"
LIBRARY = "impactlab"
version = partial(version_of, "impactlab")


def settings(case: Case) -> list[dict[str, Any]]:
    """Return meshes and steps: h/c, or points in the shortest period for located Craig-Bampton steps."""
    found: list[dict[str, Any]] = [{"model": "exact"}]
    meshes = (20, 30, 40, 60, 80, 120, 160, 240, 320, 480)
    for n, courant in product(meshes, (0.7, 0.9, 1.0)):
        found.append({"model": "central_difference", "coordinates": n, "courant": courant})
    for n, points in product((6, 8, 10, 12, 16, 24, 32, 48, 64), (1.0, 2.0, 4.0, 8.0)):
        found.append({"model": "craig_bampton", "coordinates": n, "points_per_period": points})
    for n, courant in product(meshes[2:-2], (0.5, 1.0)):
        found.append({"model": "newmark", "coordinates": n, "courant": courant})
    return found


def scene(case: Case, setting: Setting) -> Simulation:
    """Return the scene of a setting; hard contact by addition-deletion throughout."""
    kind, n = setting["model"], setting.get("coordinates", 0)
    if kind == "exact":
        return case.scene(Continuous())
    if kind == "automatic":
        return case.scene(Continuous()).but(tolerance=Tolerance(setting["tolerance"]))
    if kind == "craig_bampton":
        model = Modal(elements=12 * n, modes=n, basis=CraigBampton())
        rule = StepRule(points_per_period=setting["points_per_period"])
        return case.scene(model, ExactModal(), rule, events="located")
    integrator = CentralDifference() if kind == "central_difference" else Newmark()
    return case.scene(FiniteElement(n, "lumped"), integrator, StepRule(courant=setting["courant"]))


def chosen(given: Simulation) -> tuple[Simulation, str, float]:
    """Return the automatic choice for a scene, its words, and its time [s].

    The scene has a tolerance.
    """
    choices: list[Any] = [api.solve(*given).choice for _ in range(3)]  # type: ignore[attr-defined]
    least = min(choices, key=lambda choice: choice.choosing_s)  # the first may compile
    return Simulation(given.scene, least.method), least.chosen, least.choosing_s


def build(case: Case, setting: Setting, record: bool) -> Run[Outcome]:
    """Return a run; it records as always."""
    given = scene(case, setting)
    if setting["model"] == "automatic":
        given = chosen(given)[0]
    if is_exact(*given):
        return _exact(case, given)
    return stepped(given, lambda history: outcome_of(history, case))


def stepped(given: Simulation, outcome: Callable[[AbstractHistory], Found]) -> Run[Found]:
    """Return a run that steps."""
    from impactlab.numerics.addresses import entered
    from impactlab.simulate.stepped_run import advance_of
    from impactlab.simulate.stepping import loop

    plan = prepare(*given)
    assert plan.dt is not None
    assert plan.integrator is not None
    assembly = Assembly(plan, plan.integrator, plan.dt)
    history = RecordedHistory(assembly, plan.integrator)
    entered(loop.start, assembly.memory, assembly.dt)
    entered(advance_of(assembly), assembly.memory, assembly.dt, 0, assembly.stride, assembly.sample_stride)

    def solve() -> None:
        walk(assembly, history, None)
        history.finish()

    return Run(solve, lambda: outcome(history))


def _exact(case: Case, given: Simulation) -> Run[Outcome]:
    """Return a run of the exact description, with the march timed.

    The package reports the same time.
    """
    from impactlab.exact import march
    from impactlab.exact.arrays import DONE
    from impactlab.exact.results.history import ContinuousHistory
    from impactlab.exact.setup.build import build as network
    from impactlab.exact.setup.network import grown

    layout, log = network(*given)
    logs, histories = [march.prepared(log)], []

    def solve() -> None:
        while (status := march.march(logs[-1])) != DONE:
            logs.append(grown(logs[-1], status))
        histories.append(ContinuousHistory(given, layout, logs[-1], given.scene.duration))

    return Run(solve, lambda: outcome_of(histories[-1], case))


def outcome_of(history: AbstractHistory, case: Case) -> Outcome:
    """Return a history as the other programs' outcomes; the opening from its own dated events."""
    times = np.linspace(0.0, case.duration, 6001)
    events = [event for event in history.events if event.kind in ("open", "close")]
    opening = float("inf")
    for event, after in zip(events, [*events[1:], None], strict=True):
        until = case.duration if after is None else after.time
        if event.kind == "open" and until - event.time > SHORTEST_FLIGHT * case.round_trip:
            opening = event.time
            break
    velocity = float(history.evaluate(np.array([case.duration]), "velocity:hammer")[0])
    mass, face = (history.evaluate(times, name) for name in ("position:hammer", "displacement:rod@0"))
    return Outcome(times, mass, face, velocity, opening=opening)
