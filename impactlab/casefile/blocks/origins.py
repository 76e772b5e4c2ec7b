"""Places in the file of blocks that were made from others.

Errors name the block as it is written.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from impactlab.errors import ImpactlabError

_ENTRY = re.compile(r"\b(contacts|probes)\.(\d+)")
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?")


@dataclass(frozen=True, slots=True)
class Origin:
    """The block in the file from which one of n was made."""

    block: str  # its path, as in contacts.1
    index: int  # i, from 1; 0 of a block that is written out in the file
    count: int  # n
    chain: tuple[int, ...] = ()  # of a contact made from a chain: the items of ``chain`` that give its two bodies


@dataclass
class Origins:
    """The origins of all blocks of a case; empty where no block is repeated."""

    bodies: dict[str, Origin] = field(default_factory=dict)  # of those made, by name
    lists: dict[str, list[Origin | None]] = field(default_factory=dict)  # contacts and probes, by number

    def __bool__(self) -> bool:
        return bool(self.bodies or self.lists)

    def of(self, path: str) -> Origin | None:
        """Return the origin of the block that holds a path; None if the file holds it."""
        keys = path.split(".")
        if keys[0] == "bodies" and len(keys) > 1:
            return self.bodies.get(keys[1])
        known = self.lists.get(keys[0], [])
        if len(keys) > 1 and keys[1].isdecimal() and int(keys[1]) < len(known):
            return known[int(keys[1])]
        return None

    def first(self, path: str) -> str:
        """Return a path of the file in the first block made there.

        It is the first of the blocks that were made from the block of the path.
        """
        room, _, rest = path.partition(".")
        name, dot, key = rest.partition(".")
        made = self.bodies if room == "bodies" else {str(n): each for n, each in enumerate(self.lists.get(room, []))}
        block = f"{room}.{name}"
        found = next((each for each, origin in made.items() if origin is not None and origin.block == block), name)
        return f"{room}.{found}{dot}{key}" if rest else path

    def led_back(self, error: ImpactlabError) -> None:
        """Lead an error and those that it holds back to the blocks in the file.

        Faults of blocks made from one that differ in their numbers alone become the first of them, with their count.
        """
        if not self:
            return
        first: dict[tuple[str, str], ImpactlabError] = {}
        also: dict[tuple[str, str], int] = {}
        for each in (error, *error.others):
            key = self._moved(each)
            also[key] = also.get(key, -1) + 1
            first.setdefault(key, each)
        for key, each in first.items():
            if also[key]:
                each.text += f" (and in {also[key]} more made from this block)"
                each.args = (each.text,)
        error.others = tuple(each for each in first.values() if each is not error)

    def _moved(self, error: ImpactlabError) -> tuple[str, str]:
        """Lead an error back to its block in the file.

        Return its path and text, without numbers where these vary.
        """
        if error.led_back:
            return error.path, error.text
        error.led_back = True
        origin = self.of(error.path)
        error.text = _ENTRY.sub(lambda found: self._written(found[0]), error.text)
        plain = error.text
        if origin is not None:
            inside = error.path.split(".")[2:]
            if origin.chain and inside[:1] == ["between"]:
                inside = ["chain", *(str(origin.chain[int(side)]) for side in inside[1:])]
            error.path = ".".join((origin.block, *inside))
            error.text += f" (at i = {origin.index})" if origin.index and origin.count > 1 else ""
            if origin.index and error.text.startswith("a list of") and "a number" in error.text:
                error.remedy = "Give one value to each by {each: [...]}."
            elif origin.index and "has a unit" in error.text and "*" in error.text:
                error.remedy = "Fix the unit; a formula of a repeated block names i, n and pi alone."
            plain = _NUMBER.sub("#", plain) if origin.index else plain
        error.args = (error.text,)
        return error.path, plain

    def _written(self, path: str) -> str:
        origin = self.of(path)
        return path if origin is None else origin.block
