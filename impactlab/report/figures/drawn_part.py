"""The drawn part of a scene with many contacts.

It has contacts spread over the scene, and their bodies; of many rods it has those at the beginning of the row, so that
waves can be followed from one to the next. Of many probes it has some, too.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from impactlab.history.energy import EnergyBook
from impactlab.scene.problem import Scene
from impactlab.types import Array

MAX_DRAWN = 40  # contacts, and probes, of a page: a figure of more is no longer read
MAX_RODS = 250  # contacts of a row of rods: the waves in shorter rods would be no wider than a line


def drawn_energies(book: EnergyBook) -> Mapping[str, Array]:
    """Return the energy of each body (n,) [J] by name.

    Of more bodies than a figure holds, it is that of all together.
    """
    if len(book.bodies) <= MAX_DRAWN:
        return book.bodies
    return {f"all {len(book.bodies)} bodies": np.asarray(sum(book.bodies.values(), np.zeros_like(book.time)))}


def energy_parts(book: EnergyBook) -> dict[str, Array]:
    """Return the energies of a run that are not zero throughout, (n,) [J] by words.

    They are those of bodies, stored in contacts, and lost by known formulas.
    """
    parts = {name: values for name, values in drawn_energies(book).items() if np.any(values)}
    parts |= {"stored in contact": book.stored} if np.any(book.stored) else {}
    return parts | {f"lost: {name}": values for name, values in book.booked.items() if np.any(values)}


class DrawnPart(NamedTuple):
    """A scene as a page draws it, and the part left out."""

    scene: Scene
    left_out: str  # a sentence for people; empty where all is drawn


def drawn_part(scene: Scene) -> DrawnPart:
    """Return the part of a scene that is drawn.

    It has at most `MAX_DRAWN` contacts, the bodies that they join, those of probes and all rods and beams; where these
    are more than `MAX_DRAWN` themselves, it has the first `MAX_RODS` contacts. It has at most `MAX_DRAWN` probes.
    """
    scene, fewer_probes = _some_probes(scene)
    count, is_row = len(scene.contacts), len(scene.elastic) > MAX_DRAWN
    most = MAX_RODS if is_row else MAX_DRAWN
    if count <= most:
        return DrawnPart(scene, fewer_probes)
    numbers = range(most) if is_row else _spread(count, most)
    contacts = tuple(scene.contacts[number] for number in numbers)
    named = {point.body for contact in contacts for point in contact.faces} | {probe.body for probe in scene.probes}
    named |= set() if is_row else set(scene.elastic)
    bodies = {name: body for name, body in scene.bodies.items() if name in named or body.changes}
    which = "the first of the case" if is_row else "spread over the case"
    words = (
        f"{len(contacts)} of {count} contacts and {len(bodies)} of {len(scene.bodies)} bodies, {which}; "
        "summary.json, contacts.csv and history.npz have all"
    )
    left_out = ". ".join(each for each in (words, fewer_probes) if each)
    return DrawnPart(dataclasses.replace(scene, contacts=contacts, bodies=bodies), left_out)


def _some_probes(scene: Scene) -> DrawnPart:
    """Return a scene with at most `MAX_DRAWN` of its probes, spread over the case."""
    count = len(scene.probes)
    if count <= MAX_DRAWN:
        return DrawnPart(scene, "")
    probes = tuple(scene.probes[number] for number in _spread(count, MAX_DRAWN))
    words = f"{MAX_DRAWN} of {count} probes, spread over the case; probes.csv and history.npz have all"
    return DrawnPart(dataclasses.replace(scene, probes=probes), words)


def _spread(count: int, most: int) -> list[int]:
    """Return at most ``most`` whole numbers, spread evenly from 0 to ``count`` - 1."""
    numbers: list[int] = np.unique(np.linspace(0, count - 1, most).round().astype(int)).tolist()
    return numbers
