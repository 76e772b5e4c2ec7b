"""Collisions of a summary in sentences."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from impactlab.metrics.collisions import MIN_GAP
from impactlab.printing import counted

MIN_COUNTED = 4  # collisions without a restitution, from which on one sentence counts them: those of a chain


def in_si(value: float, unit: str) -> str:
    """Return a value with its unit, without a prefix."""
    return f"{value:.6g} {unit}"


def sentence(each: Mapping[str, Any], number: Callable[[float, str], str] = in_si) -> str:
    """Return a collision of a summary in one line; ``number`` writes values with units."""
    ended = each["end"] is not None
    until = f"to {number(each['end'], 's')}" if ended else "on, still in contact at the end of the run"
    parts = [
        f"{each['bodies']}: {counted(each['sub_impacts'], 'sub-impact')}, {number(each['start'], 's')} {until}",
        f"impulse {number(each['impulse'], 'N s')}",
    ]
    if each["restitution"] is not None:
        parts.append(f"apparent restitution {each['restitution']:.4g}")
    elif ended:
        parts.append(f"no restitution: {each['no_restitution']}")
    if each["restitution"] is not None and each["energy_lost"] is not None:
        verb = "loses" if each["energy_lost"] >= 0.0 else "gains"
        parts.append(f"{each['striker']} {verb} {number(abs(each['energy_lost']), 'J')}")
    if (each["largest_gap"] or 0.0) > MIN_GAP:
        parts.append(f"gaps up to {number(each['largest_gap'], 'm')}")
    return ", ".join(parts)


def sentences(
    collisions: Sequence[Mapping[str, Any]], number: Callable[[float, str], str] = in_si
) -> tuple[str, list[str]]:
    """Return a sentence that counts the collisions without a restitution, and one for each other collision.

    The first is empty where these are few: each has a sentence of its own. Collisions that go on are not counted.
    """
    without = [each for each in collisions if each["end"] is not None and each["restitution"] is None]
    if len(without) < MIN_COUNTED:
        return "", [sentence(each, number) for each in collisions]
    first, impulses = without[0], [each["impulse"] for each in without]
    together = (
        f"{len(without)} collisions without a restitution, {number(first['start'], 's')} to "
        f"{number(max(each['end'] for each in without), 's')}, impulses {number(min(impulses), 'N s')} to "
        f"{number(max(impulses), 'N s')}; of the first, {first['bodies']}, as {first['no_restitution']}"
    )
    others = [each for each in collisions if each["end"] is None or each["restitution"] is not None]
    return together, [sentence(each, number) for each in others]
