"""A run by the exact solver: its refusals, and its warnings before it starts."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator

from impactlab.exact.cost import StartedMarch
from impactlab.exact.setup.contact_kinds import bonds_of
from impactlab.exact.solve import solve
from impactlab.history.base import AbstractHistory, Warned
from impactlab.models.continuous.model import Continuous
from impactlab.plugins import kind_of
from impactlab.scene.method import Method
from impactlab.scene.precision import in_precision, quietly
from impactlab.scene.problem import Scene
from impactlab.scene.recent import KeepsResults
from impactlab.scene.sizes import check_records
from impactlab.simulate.warnings import weights
from impactlab.startup.wall_time import spent_on
from impactlab.types import Progress

UNUSED = Warned("integrator_unused", "the continuous model needs no integrator; solve.integrator is ignored")


def check(scene: Scene, method: Method) -> tuple[Warned, ...]:
    """Return the warnings of an exact run.

    Raises `CaseError` where the exact solver cannot take it on.
    """
    check_records(scene, scene.records)
    with quietly(), in_precision("the contacts of the scene", "contacts"):
        bonds_of(scene, method)
    unused = () if method.integrator is None else (UNUSED,)
    return (*unused, *_not_stepped(method), *_exactly_hard(method), *_not_counted(method))


checked = KeepsResults(check, lambda _: True)


def run(scene: Scene, method: Method, progress: Progress | None, begun: StartedMarch | None) -> AbstractHistory:
    """Return the history of the exact solver; arguments and errors as of `impactlab.simulate.driver.run`."""
    began = clock.perf_counter()
    with spent_on("set-up"):
        warnings = checked(scene, method)
    planned = clock.perf_counter()
    history = solve(scene, method, progress=progress, begun=begun)
    history.integrator_used = False
    solved = clock.perf_counter()
    with spent_on("checks"):
        history.warnings.extend(warnings)
        history.warnings.extend(weights.warnings(history))
    history.cost.setup_s += planned - began
    history.cost.checks_s += clock.perf_counter() - solved
    return history


def _not_stepped(method: Method) -> Iterator[Warned]:
    """Yield a warning for each key of steps in an exact run.

    points_per_period is not among them, as methods of the run may use it.
    """
    step = method.step
    if step.dt is not None:
        yield Warned("step_unused", f"the exact solver takes no steps, and ignores the dt of {step.dt:.6g} s")
    if step.courant is not None:
        yield Warned("step_unused", f"the exact solver takes no steps, and ignores courant: {step.courant:g}")
    if method.events == "located":
        text = "the exact solver takes no steps: it computes the time of every event, with or without events: located"
        yield Warned("step_unused", text)


def _exactly_hard(method: Method) -> Iterator[Warned]:
    """Yield a warning for each law in place of a hard contact, which is solved exactly."""
    for name, law in method.laws.items():
        if law.hard and not law.is_the_contact:
            text = f"{name}: the exact solver solves the hard contact itself, and does not use law '{kind_of(law)}'"
            yield Warned("law_unused", text, name)


def _not_counted(method: Method) -> Iterator[Warned]:
    """Yield a warning for each model whose modes or elements a run without steps ignores."""
    for name, model in method.models.items():
        if isinstance(model, Continuous) and (model.modes is not None or model.elements is not None):
            text = f"'{name}': the exact solver takes no steps, and ignores modes and elements"
            yield Warned("modes_unused", text)
