"""Modules imported on first use: a command loads only the libraries it needs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from types import ModuleType
from typing import Any

from impactlab.startup.wall_time import LOADING, spent_on


class LazyModule:
    """A module that is imported when one of its attributes is first read."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._module: ModuleType | None = None

    def __getattr__(self, attribute: str) -> Any:
        if self._module is None:
            with spent_on(LOADING):
                self._module = import_module(self._name)
        return getattr(self._module, attribute)


def lazy(name: str) -> Any:
    """Return a module by its full name, imported on first use.

    State its type by an import under TYPE_CHECKING.
    """
    return LazyModule(name)


def above(module: str) -> Any:
    """Return a module above the caller by its name in the package, such as figures.

    It is imported at its first use, as plotting backends are; modules below must not depend on it otherwise.
    """
    return import_module(f"impactlab.{module}")


def public_names(names: Iterable[str]) -> Callable[[], list[str]]:
    """Return a package's public names, imported or not, for completion and `help`."""
    listed = sorted(names)
    return lambda: list(listed)


def lazy_names(
    package: str, names: Mapping[str, str], first: Callable[[], None] | None = None, modules: str = ""
) -> Callable[[str], Any]:
    """Return a package's `__getattr__` that imports public names on first use.

    Parameters
    ----------
    package : str
        Full name of the package.
    names : mapping
        Full name of a module to the public names that it defines, with spaces between.
    first : callable, optional
        Called before a name is imported; it may raise.
    modules : str
        Names of public modules of the package, with spaces between.
    """
    homes = {name: module for module, defined in names.items() for name in defined.split()}

    def attribute(name: str) -> Any:
        if name in modules.split():
            return import_module(f"{package}.{name}")
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}", name=name, obj=sys.modules[package])
        if first is not None:
            first()
        found = getattr(import_module(homes[name]), name)
        setattr(sys.modules[package], name, found)  # the next reading takes no call
        return found

    return attribute
