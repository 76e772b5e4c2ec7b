"""The last few results of a function: by key, or by scene and method for cases that are run again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from impactlab.scene.method import Method
from impactlab.scene.problem import Scene
from impactlab.scene.sizes import memory_limit

MAX_KEPT = 8  # results that are kept
Key = TypeVar("Key")
Made = TypeVar("Made")
_MISSING: Any = object()


class Recent(dict[Key, Made]):
    """The results that were used last, by key; of ``most`` + 1 results the one not used for longest is dropped."""

    def __init__(self, most: int) -> None:
        super().__init__()
        self._most = most

    def get_or_make(
        self, key: Key, make: Callable[[], Made], is_kept: Callable[[Made], bool] = lambda _made: True
    ) -> Made:
        """Return the result of a key, made if needed, and kept if ``is_kept`` holds for it."""
        made: Made = self.pop(key, _MISSING)  # in one step, as another thread may drop it
        if made is _MISSING:
            made = make()
            if not is_kept(made):
                return made
        self[key] = made
        while len(self) > self._most:
            self.pop(next(iter(self)), None)
        return made


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
        self._recent: Recent[tuple[int, int, float], tuple[Scene, Method, Made]] = Recent(MAX_KEPT)

    def __call__(self, scene: Scene, method: Method) -> Made:
        """Return the result for a scene and a method, made or kept; raise as the function."""
        key = id(scene), id(method), memory_limit() if self._limited else 0.0
        return self._recent.get_or_make(
            key, lambda: (scene, method, self._make(scene, method)), lambda made: self._is_kept(made[2])
        )[2]
