"""Lines of values in a case file, or the options that gave them, for errors."""

from __future__ import annotations

from impactlab.casefile.document import Document
from impactlab.casefile.values.faults import CHECK_FILE
from impactlab.errors import ImpactlabError

NEW_KIND = (
    "A new kind begins a new block, without the keys of the old kind: give the kind and its "
    "keys together, as one block."
)


def given_by(document: Document, path: str) -> str:
    """Return the option that gave the value of a path; "" if the file did.

    It may have given a block that holds the path, or a key in it; of a block that the file lacks, a value at any depth.
    """
    keys = tuple(path.split("."))
    lacking = bool(path and document.lines) and keys not in document.lines
    for given, name in document.given.items():
        inside = lacking and given[: len(keys)] == keys
        if inside or keys[: len(given)] == given or (given[:-1] == keys and path):
            return name
    return ""


def placed(error: ImpactlabError, file: str, document: Document) -> ImpactlabError:
    """Fill in the place of an error and those found with it.

    The place is file, line, and the option that gave the value. The error is returned.
    """
    for each in (error, *error.others):
        kind = (*each.path.split(".")[:-1], "kind")
        if each.text.startswith("this key is missing") and kind in document.given and not each.file:
            each.given_by, each.remedy = document.given[kind], f"{each.remedy} {NEW_KIND}".strip()
            each.located(file, None)
            continue
        if not each.file:
            each.given_by = each.given_by or given_by(document, each.path)
        if not file and each.remedy == CHECK_FILE:  # of a case made in Python
            each.remedy = ""
        each.located(file, locate(document, each.path))
    return error


def locate(document: Document, path: str) -> int | None:
    """Return the line of a path, or of the nearest key above it.

    None for a value that is not from the file.
    """
    if not path or given_by(document, path):
        return None
    keys = tuple(path.split("."))
    while keys and keys not in document.lines:
        keys = keys[:-1]
    return document.lines.get(keys)
