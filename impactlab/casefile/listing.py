"""The list of registered parts, with the reason for each that cannot be used."""

from __future__ import annotations

from typing import NamedTuple

from impactlab.casefile.parts import check_fields
from impactlab.errors import PluginError
from impactlab.plugins import GROUPS, Entry, Group, Registry, citations_of, describe


class Listed(NamedTuple):
    """One line of a listing: a part, or the reason why it cannot be used."""

    group: str
    name: str
    distribution: str
    description: str
    citations: tuple[str, ...]
    fault: str  # empty for a part that works


def listing(registry: Registry) -> tuple[Listed, ...]:
    """Return every registered part in order of group and name, broken ones with their reason."""
    entries = [
        (group, entry)
        for group in GROUPS
        for entry in sorted(entry for entry in registry.entries if entry.group == group.name)
    ]
    return tuple(_line(registry, group, entry) for group, entry in entries)


def _line(registry: Registry, group: Group, entry: Entry) -> Listed:
    try:
        part = registry.load(group, entry.name)
        if not group.arguments:  # a class, to which a case gives options
            check_fields(part)
    except PluginError as error:
        return Listed(group.name, entry.name, entry.distribution, "", (), error.text)
    except Exception as error:  # noqa: BLE001 - types that cannot be resolved, or any other fault of a plugin
        fault = f"its fields cannot be read: {type(error).__name__}: {str(error)[:200]}"
        return Listed(group.name, entry.name, entry.distribution, "", (), fault)
    return Listed(group.name, entry.name, entry.distribution, describe(part), citations_of(part), "")
