"""Links between pages that are read in the repository and on the site: those that lead out of docs/ are made right.

A line ``<!-- text of ../FILE -->`` of a page stands for the text of that file, and ``<!-- text of ../FILE: NAME -->``
for the part of it between ``<!-- NAME -->`` and ``<!-- end of NAME -->``.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

from sphinx.application import Sphinx

PAGES = {  # files of the repository that are no pages of the site, and the pages that hold the same
    "../README.md": "index.md",
    "../CHANGELOG.md": "changes.md",
    "../CONTRIBUTING.md": "contributing.md",
    "../cases": "cases.md",
    "../cases/hard": "hard-cases.md",
    "../plugins/README.md": "plugins.md",
    "README.md": "index.md",
}
LINK = re.compile(r"(?P<mark>!?)\[(?P<text>[^\]]*)\]\((?P<target>[^)#:\s]+)(?P<place>#[^)]*)?\)")
WHOLE = re.compile(r"^<!-- text of (?P<file>\S+?)(?:: (?P<part>[^>]+?))? -->$", re.MULTILINE)


def text_of(page: Path, file: str, part: str | None) -> str:
    """Return the text of another file of the repository, or a part of it, with its links seen from the page."""
    path = page.parent / file
    text = path.read_text(encoding="utf-8")
    if part is not None:
        text = text.partition(f"<!-- {part} -->\n")[2].partition(f"<!-- end of {part} -->")[0]
        if not text:
            raise LookupError(f"{file} has no part '{part}'")
    folder = posixpath.dirname(file)

    def seen(found: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(folder, found["target"])).replace("../docs/", "")
        return f"{found['mark']}[{found['text']}]({target}{found['place'] or ''})"

    return LINK.sub(seen, text)


def link(found: re.Match[str]) -> str:
    """Return a link made right for the site; one to a text that the site does not hold is left out, its words kept."""
    target = PAGES.get(found["target"].rstrip("/"), found["target"])
    if target.startswith("../") and target.endswith(".md"):
        return found["text"]
    return f"{found['mark']}[{found['text']}]({target}{found['place'] or ''})"


def read(app: Sphinx, name: str, source: list[str]) -> None:
    """Fill in the texts of other files, then make links right."""
    page = Path(app.env.doc2path(name))
    if page.suffix == ".md":
        source[0] = WHOLE.sub(lambda found: text_of(page, found["file"], found["part"]), source[0])
        if page.parent == Path(app.srcdir):
            source[0] = LINK.sub(link, source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("source-read", read)
    return {"parallel_read_safe": True}
