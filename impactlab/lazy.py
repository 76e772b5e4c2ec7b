"""Modules that are imported when they are first used, so that a command loads only the libraries it needs."""

from __future__ import annotations

from importlib import import_module
from typing import Any


class LazyModule:
    """A module of the package that is imported when one of its attributes is first read."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        return getattr(import_module(self._name), attribute)


def lazy(name: str) -> Any:
    """Return a module by its full name, imported on first use; state its type by an import under TYPE_CHECKING."""
    return LazyModule(name)
