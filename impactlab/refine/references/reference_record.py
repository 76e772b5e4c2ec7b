"""A solution that errors are measured against, with the inputs that it depends on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from impactlab.history.base import AbstractHistory
from impactlab.scene.facts import changes
from impactlab.scene.method import Method, is_relative, laws_of, modelled, models_of, theories
from impactlab.scene.problem import Scene

# Names in summaries: the exact hard contact, the exact spring and dashpot of the case itself, its exact links and
# cushions, linear between changes of branch, and the converged solution.
HARD, SPRING, BRANCHES, CONVERGED = "st_venant", "kelvin_voigt", "branches", "converged"

FULL_BUDGET_S = 7.0  # s of predicted solving that a converged reference may take


class Reference(NamedTuple):
    """A solution that errors are measured against.

    ``uncertainties`` are those of the metrics of the summary, each in the unit of its metric; none of an exact one.
    """

    name: str  # st_venant | kelvin_voigt | branches | converged
    history: AbstractHistory
    uncertainty: float = 0.0  # the largest relative one of displacements and impulse
    uncertainties: Mapping[str, float] = {}
    found: str = "event to event"  # how, in words


def physics_key(scene: Scene, method: Method) -> Any:
    """Return everything that a reference depends on, so that methods on one scene share it."""
    laws = laws_of(scene, method)
    meshed = any(is_relative(law) for law in laws)
    models: Any = tuple(model for _, model in modelled(scene, method)) if meshed else ()
    if changes(scene):  # the shapes of links are given
        models = tuple(models_of(scene, method).items())
    return (
        theories(scene, method),
        tuple(scene.bodies.values()),
        models,
        scene.contacts,
        tuple(None if law.hard else law for law in laws),
        scene.duration,
        scene.gravity,
        scene.probes,
        scene.snapshots,
    )
