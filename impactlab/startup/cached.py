"""Properties that are found once, without a lock.

`functools.cached_property` of Python before 3.12 holds a lock while a value is found, one for all objects of a class.
That takes as long as some ten attributes, and threads wait there for each other. Without it two threads may both find
a value, and either is correct, as in later versions.
"""

from __future__ import annotations

import functools
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or sys.version_info >= (3, 12):
    from functools import cached_property as cached_property
else:

    class cached_property(functools.cached_property):  # noqa: N801 - it stands in for that of the library
        """A property that is found when it is first read, and kept in the object."""

        def __get__(self, instance: Any, owner: Any = None) -> Any:
            """Return the value of an object; of a class the property itself."""
            if instance is None:
                return self
            found = instance.__dict__[self.attrname] = self.func(instance)
            return found
