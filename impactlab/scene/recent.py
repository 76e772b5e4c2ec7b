"""Results of the last few simulations, for cases that are run again.

They are not checked and built again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from impactlab.scene.method import Method
from impactlab.scene.problem import Scene
from impactlab.scene.sizes import memory_limit

MAX_KEPT = 8  # results that are kept
Made = TypeVar("Made")


class KeepsResults(Generic[Made]):
    """A function of scene and method that keeps its last results.

    Scenes and methods are frozen, so the same objects have the same result; they are kept with it, so that no other
    object takes their place in memory.

    Parameters
    ----------
    make : callable
        The function.
    is_kept : callable
        Whether a result is small enough to be kept.
    limited : bool
        Whether a result, or a refusal, depends on the memory limit.
    """

    def __init__(
        self, make: Callable[[Scene, Method], Made], is_kept: Callable[[Made], bool], limited: bool = True
    ) -> None:
        self._make, self._is_kept, self._limited = make, is_kept, limited
        self._known: dict[Any, tuple[Scene, Method, Made]] = {}

    def __call__(self, scene: Scene, method: Method) -> Made:
        """Return the result for a scene and a method, made or kept.

        It raises as the function does.
        """
        key = id(scene), id(method), memory_limit() if self._limited else 0.0
        known = self._known.get(key)
        if known is not None:
            return known[2]
        made = self._make(scene, method)
        if self._is_kept(made):
            self._known = dict([*self._known.items(), (key, (scene, method, made))][-MAX_KEPT:])
        return made
