"""The sources of a case as BibTeX entries: its origin and the parts it uses."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

from impactlab.casefile import Case
from impactlab.plugins import citations_of, parts_inside

OWN = "own"  # key of a part that its author has not published


class Citations(NamedTuple):
    """Sources to cite: sorted keys, and the BibTeX text."""

    keys: tuple[str, ...]
    bibtex: str


def cite(case: Case) -> Citations:
    """Return the sources of the parts that a case uses and of the case itself.

    The source of a case counts if it is a key of citations.bib, or names the authors and the year of one entry. A part
    may cite by a key of our citations.bib or of one in its own package, or bring its BibTeX entry, a text that begins
    with ``@``, or be an unpublished one (`OWN`).
    """
    method = case.simulation().method
    parts: list[object] = [*method.models.values(), *method.laws.values(), method.integrator]
    wanted: list[str] = []
    known = dict(entries())
    for part in [one for whole in parts if whole is not None for one in (whole, *parts_inside(whole))]:
        wanted += citations_of(part)
        known |= entries_for(type(part))
    own = source_key(case.source)
    keys = [*wanted, own] if own else wanted
    remarks = [f"% Source of the case: {' '.join(case.source.split())}"] if case.source and not own else []
    return bibtex(keys, remarks, known)


def bibtex(keys: Iterable[str], remarks: Iterable[str] = (), known: Mapping[str, str] | None = None) -> Citations:
    """Return the entries of keys, in order; a key without an entry gives a remark."""
    known = entries() if known is None else known
    found: dict[str, str] = {}
    lines = list(remarks)
    for key in sorted(set(keys)):
        if key.startswith("@"):
            found[_key_of(key)] = key.strip()
        elif key in known:
            found[key] = known[key]
        elif key == OWN:
            lines.append("% own: a part by the author of the case, unpublished")
        else:
            lines.append(f"% {key}: no entry in citations.bib; ask the authors of the part")
    return Citations(tuple(sorted(found)), "\n\n".join([*lines, *(found[key] for key in sorted(found))]))


def source_key(source: str) -> str | None:
    """Return the key of the entry that the source of a case names, or None."""
    known = entries()
    if source.strip() in known:
        return source.strip()
    text = _plain(source)
    for key, entry in known.items():
        year, authors = _field(entry, "year"), _field(entry, "author")
        surnames = [_plain(author.partition(",")[0]) for author in authors.split(" and ")]
        if year and year in text and all(name in text for name in surnames):
            return key
    return None


def entries() -> dict[str, str]:
    """Return the entries of citations.bib by key."""
    return _entries_of("impactlab")


def entries_for(part: type[Any]) -> dict[str, str]:
    """Return the entries that a part may cite: ours and those of its own package."""
    return entries() | _entries_of(part.__module__.partition(".")[0])


@cache
def _entries_of(package: str) -> dict[str, str]:
    """Return the entries of a package's citations.bib by key; empty without such a file."""
    try:
        text = files(package).joinpath("citations.bib").read_text(encoding="utf-8")
    except (ImportError, TypeError, AttributeError, OSError):  # a script, a lone module, a package without sources
        return {}
    found = re.findall(r"^@\w+\{.*?^\}", text, flags=re.MULTILINE | re.DOTALL)
    return {_key_of(entry): entry for entry in found}


def _key_of(entry: str) -> str:
    match = re.match(r"@\w+\{\s*([^,\s]+)\s*,", entry)
    return match.group(1) if match else entry[:40]


def _field(entry: str, name: str) -> str:
    match = re.search(rf"^\s*{name}\s*=\s*\{{(.*)\}},?$", entry, flags=re.MULTILINE)
    return match.group(1) if match else ""


def _plain(text: str) -> str:
    bare = re.sub(r"\\.|[{}]", "", text)
    return unicodedata.normalize("NFKD", bare).encode("ascii", "ignore").decode().lower().strip()
