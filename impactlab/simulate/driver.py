"""A run of a scene under a method, exact or in steps, by code that is loaded where used."""

from __future__ import annotations

from typing import TYPE_CHECKING

from impactlab.exact.cost import StartedMarch
from impactlab.history.base import AbstractHistory
from impactlab.scene.method import Method, Simulation, is_exact
from impactlab.scene.problem import Scene
from impactlab.simulate import exact_run
from impactlab.startup.lazy import lazy
from impactlab.types import Progress

if TYPE_CHECKING:
    from impactlab.simulate import stepped_run
else:
    stepped_run = lazy("impactlab.simulate.stepped_run")


def run(
    scene: Scene,
    method: Method,
    progress: Progress | None = None,
    with_warnings: bool = True,
    begun: StartedMarch | None = None,
    like: Simulation | None = None,
) -> AbstractHistory:
    """Run a scene under a method and return its history.

    Parameters
    ----------
    scene, method : Scene, Method
        The physics, and models, laws, integrator and step; a method with a tolerance has none to run yet (see
        `impactlab.refine.choice`).
    progress : callable, optional
        Called with the fraction done, from 0 to 1, about ten times a second.
    with_warnings : bool
        Whether the finished run is examined for warnings (`impactlab.simulate.checks.add_warnings`).
    begun : Begun, optional
        A march of the exact solver over the first intervals of the same scene, which goes on.
    like : Simulation, optional
        Of one of the last runs: where it differs in its step alone, its bodies and arrays serve this one, too. The run
        itself keeps its arrays so for the next ones.

    Raises
    ------
    CaseError, PairingError
        Before the first step.
    StepError
        When a law fails, a number is not finite, or energy grows beyond the declared bound; carries the history so far.
    """
    if is_exact(scene, method):
        return exact_run.run(scene, method, progress, begun)
    return stepped_run.run(scene, method, progress, with_warnings, like)
