"""Compiled code on disk that is older than what it was made from."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

from numba.core.caching import FunctionCache

from impactlab.pointers import COMPILED, drop_cache

cache: Any = FunctionCache


def drop_stale(entry: Any, *modules: ModuleType) -> bool:
    """Drop the cache of a compiled function where a module that it takes parts or constants from is newer.

    Numba itself looks at the function's own file only. Returns whether anything was dropped.
    """
    if not COMPILED:
        return False
    function = getattr(entry, "py_func", entry)
    newest = max(Path(str(module.__file__)).stat().st_mtime for module in modules)
    folder = Path(cache(function).cache_path)
    kept = folder.glob(f"{Path(function.__code__.co_filename).stem}.*.nb[ic]")
    if all(path.stat().st_mtime >= newest for path in kept):
        return False
    drop_cache(function)
    return True
