"""The solution that errors are measured against: the exact one, else a converged one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from impactlab.errors import StepError
from impactlab.exact import solve as exact
from impactlab.exact.cost import predicted_s
from impactlab.refine.references.reference_record import BRANCHES, FULL_BUDGET_S, HARD, SPRING, Reference
from impactlab.scene.method import Method, laws_of, theories
from impactlab.scene.problem import Scene
from impactlab.startup.lazy import lazy

if TYPE_CHECKING:
    from impactlab.refine.references import converged as converged_reference
else:  # with the step loop, which an exact solution does not need
    converged_reference = lazy("impactlab.refine.references.converged")


def find(scene: Scene, method: Method, budget: float = FULL_BUDGET_S) -> Reference | None:
    """Return the exact solution of a scene, else a converged one, else None.

    Parameters
    ----------
    scene : Scene
        The physics; its contacts have the laws of the method.
    method : Method
        Its laws: one that is hard stands for the hard contact. Its models give the theory, and the elements of a
        relative stiffness, and the shapes of the links of a mechanism; integrator and step are not used.
    budget : float
        Seconds of predicted solving that a converged solution may take (`impactlab.refine.descriptions.cost`): the same
        scene always has the same reference.
    """
    if any(theories(scene, method)):
        return None
    exact_one = find_exact(scene, method, budget)
    return converged_reference.converged(scene, method, budget) if exact_one is None else exact_one


def find_exact(scene: Scene, method: Method, budget: float = FULL_BUDGET_S) -> Reference | None:
    """Return the exact solution of a scene, None where there is none or it does not come to its end.

    Arguments as of `find`.
    """
    if any(theories(scene, method)):
        return None
    laws = laws_of(scene, method)
    if exact.serves(scene, method) is not None:
        return None
    name = HARD if all(law.hard for law in laws) else SPRING
    if any(law.branches() is not None for law in laws):  # each of many links splits every front that passes it
        name = BRANCHES
        if predicted_s(scene, method) > budget:
            return None
    try:
        return Reference(name, exact.solve(scene, method, whole=True))
    except StepError:  # events accumulate, say: the run itself may be fine
        return None
