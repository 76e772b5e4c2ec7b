"""References: one for each scene, shared by the workers of one bench."""

from __future__ import annotations

import contextlib
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

from impactlab import api
from impactlab.bench.keys import reference_key
from impactlab.jobs.files import whole
from impactlab.refine.references.reference_record import Reference
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene
from impactlab.scene.recent import Recent

LOST = ".lost"  # ends the name of the file with the reason why a search for a reference had no end
MAX_KEPT = 4  # references that a worker keeps in memory: cells come scene by scene


class References:
    """The references of one bench.

    They are kept in a folder that lives as long as the bench and to which only its workers write, so it is safe to
    unpickle their contents.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self._known: Recent[str, Reference | None] = Recent(MAX_KEPT)

    def of(self, scene: Scene, method: Method) -> Reference | None:
        """Return the reference of a scene, or None."""
        key = reference_key(scene, method)
        return self._known.get_or_make(key, lambda: self._shared(key, lambda: api.reference_of(scene, method)))

    def lost(self, scene: Scene, method: Method) -> str:
        """Return the reason why the search for the reference of a scene did not end.

        The text is empty where it had one.
        """
        path = None if self.folder is None else self.folder / f"{reference_key(scene, method)}{LOST}"
        return path.read_text(encoding="utf-8") if path is not None and path.is_file() else ""

    def _shared(self, key: str, make: Callable[[], Reference | None]) -> Reference | None:
        if self.folder is None:
            return make()
        if (self.folder / f"{key}{LOST}").is_file():
            return None
        path = self.folder / f"{key}.reference"
        if path.is_file():
            read: Reference | None = pickle.loads(path.read_bytes())  # noqa: S301 - of this bench's own workers
            return read
        made = make()
        with contextlib.suppress(pickle.PicklingError, TypeError, AttributeError):  # then each worker makes its own
            packed = pickle.dumps(made)
            with whole(path) as draft:
                draft.write_bytes(packed)
        return made


def lose(folder: Path, key: str, reason: str) -> None:
    """Record that the search for a reference did not end, so that workers do not repeat it."""
    (folder / f"{key}{LOST}").write_text(reason, encoding="utf-8")


def described(reference: Reference | None, lost: str = "") -> dict[str, Any]:
    """Return the reference as in a row.

    It has name, uncertainty (0 for an exact one), and how it was found. ``lost`` is the reason why the search for it
    had no end; such a row is run again by the next bench.
    """
    if lost:
        return {"name": "none", "uncertainty": None, "found": f"the search for it {lost}", "lost": True}
    if reference is None:
        return {"name": "none", "uncertainty": None, "found": "no exact solution of this scene, and none converged"}
    return {"name": reference.name, "uncertainty": reference.uncertainty, "found": reference.found}
