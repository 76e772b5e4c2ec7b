"""Cases of tutorials and examples in two tabs: the Python of the script, and the same case as a file.

While sphinx-gallery runs a script, `scraped` leaves the file of every new case in the page as a comment; when the page
is read, `tabbed` puts the Python above that comment and the file side by side.
"""

from __future__ import annotations

import re
from pathlib import Path
from textwrap import indent
from typing import TYPE_CHECKING, Any

from impactlab import Case

if TYPE_CHECKING:
    from sphinx.application import Sphinx

START = ".. GENERATED FROM PYTHON SOURCE LINES"
CODE = re.compile(r"^\.\. code-block:: Python\n\n(?:\n| {4}.*\n)+", re.MULTILINE)
FILE = re.compile(r"^\.\. case file (?P<name>.+)\n\n(?P<text>(?:\n| {4}.*\n)+)", re.MULTILINE)
TAB = ".. tab-item:: {title}\n{options}\n{content}\n"
SHOWN: dict[str, set[str]] = {}  # by script: the files that its page has already


def scraped(_block: object, variables: dict[str, Any], _settings: object) -> str:
    """Return a comment in reStructuredText with the file of each case that a block of a script has made."""
    shown = SHOWN.setdefault(variables["src_file"], set())
    new: dict[str, str] = {}
    for name, case in variables["example_globals"].items():
        if isinstance(case, Case) and file_of(case) not in shown:
            new.setdefault(file_of(case), name)
    shown.update(new)
    return "".join(
        f"\n.. case file {name if len(new) > 1 else ''}:\n\n{indent(text, '    ')}\n" for text, name in new.items()
    )


def file_of(case: Case) -> str:
    """Return the text of the file that a case was read from, or the file that a case made in Python is written as."""
    return Path(case.file).read_text(encoding="utf-8") if case.file else case.to_yaml()


def tabbed(page: str) -> str:
    """Return a page whose blocks of Python with a case are sets of tabs."""
    return START.join(map(_tabbed_part, page.split(START)))


def _tabbed_part(part: str) -> str:
    files = FILE.findall(part)
    code = CODE.search(part)
    if not files or code is None:
        return part
    tabs = [TAB.format(title="Python", options="    :sync: python\n", content=indent(code[0], "    "))]
    for name, text in files:
        block = ".. code-block:: yaml\n\n" + text
        title = f"File of ``{name.rstrip(':')}``" if name != ":" else "File"
        tabs.append(TAB.format(title=title, options="    :sync: file\n" * (name == ":"), content=indent(block, "    ")))
    tab_set = ".. tab-set::\n\n" + indent("".join(tabs), "    ") + "\n"
    return FILE.sub("", part).replace(code[0], tab_set)


def read(_app: Sphinx, name: str, source: list[str]) -> None:
    """Put the cases of a page of the gallery into tabs."""
    if name.startswith("generated/"):
        source[0] = tabbed(source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("source-read", read)
    return {"parallel_read_safe": True}
