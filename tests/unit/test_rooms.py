"""Laws, schemes and descriptions of rods do not know each other: none is named in the files of another kind."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import impactlab
from impactlab.plugins import INTEGRATORS, LAWS, Group, registry

ROOT = Path(impactlab.__file__).parent
OURS = registry().only("impactlab")


def names_of(group: Group) -> set[str]:
    """Return the registered names of a group and the names of their classes."""
    registered = OURS.names(group)
    return set(registered) | {OURS.load(group, name).__name__ for name in registered}


def mentions(text: str, group: Group) -> list[str]:
    """Return each mention of a part of the group, however written: moreau_jean, Moreau-Jean, MoreauJean.

    The key of a source is none: its year follows.
    """
    spellings = "|".join(name.replace("_", "[-_ ]?") for name in sorted(names_of(group)))
    return re.findall(rf"(?<![a-z0-9_])(?:{spellings})(?![a-z0-9_])", text, re.IGNORECASE)


@pytest.mark.parametrize(
    ("room", "group"),
    [
        ("integrators", LAWS),
        ("models", LAWS),
        ("bases", LAWS),
        ("contact", INTEGRATORS),
        ("models", INTEGRATORS),
        ("bases", INTEGRATORS),
    ],
    ids=lambda value: value if isinstance(value, str) else value.name.rpartition(".")[2],
)
def test_no_part_is_named_in_the_files_of_another_kind(room: str, group: Group) -> None:
    files = sorted((ROOT / room).rglob("*.py"))
    assert len(files) > 5
    found = {path.name: mentions(path.read_text(encoding="utf-8"), group) for path in files}
    assert {name: said for name, said in found.items() if said} == {}


@pytest.mark.parametrize("room", ["integrators", "contact", "models", "bases", "simulate/adaptive", "exact"])
def test_rooms_import_no_parts_of_another_kind(room: str) -> None:
    forbidden = {"integrators": "contact", "contact": "integrators|models|bases", "models": "contact|integrators"}
    others = forbidden.get(room, "contact|integrators")
    # The bases, abstract, are where rooms meet.
    pattern = rf"^\s*(?:from|import) impactlab\.(?:{others})\.(?!base\b)\w+"
    for path in sorted((ROOT / room).rglob("*.py")):
        assert re.findall(pattern, path.read_text(encoding="utf-8"), re.MULTILINE) == [], path.name


def test_a_mention_is_found_in_every_spelling_and_a_source_is_not() -> None:
    assert mentions("as Moreau-Jean, moreau_jean and MoreauJean do", INTEGRATORS) == [
        "Moreau-Jean",
        "moreau_jean",
        "MoreauJean",
    ]
    assert mentions("KhuliefShabana1986; Newmark1959", LAWS) == []
