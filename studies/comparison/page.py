"""Writes the tables and figures of methods.md: ``python -m studies.comparison.page [--out DIR]``.

Each table stands between two comments in the page; the text around it is kept. The figures go into figures/ beside it.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from pathlib import Path

from studies.comparison.bouncing import bouncing
from studies.comparison.orders import orders
from studies.comparison.periodic import periodic, trap
from studies.comparison.pictures import FIGURES, write
from studies.pages import DOCS

PAGE = DOCS / "methods.md"
TABLES: dict[str, Callable[[], str]] = {"periodic": periodic, "trap": trap, "bouncing": bouncing, "orders": orders}


def filled(page: str) -> str:
    """Return the page with its tables written anew."""
    for name, table in TABLES.items():
        pattern = re.compile(rf"(<!-- table: {name} -->\n).*?(\n<!-- end of table -->)", re.DOTALL)
        if not pattern.search(page):
            raise SystemExit(f"{PAGE.name} has no place for table '{name}'")
        text = table()
        page = pattern.sub(lambda match, text=text: f"{match.group(1)}{text}{match.group(2)}", page)  # type: ignore[misc]
    return page


def main() -> None:
    """Write page and figures."""
    parser = argparse.ArgumentParser(description="Write the tables and figures of methods.md.")
    parser.add_argument("--out", type=Path, default=DOCS, help="folder of what is written")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    (out / PAGE.name).write_text(filled(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    write(out / "figures")
    print(f"{len(TABLES)} tables, {len(FIGURES)} figures: {out / PAGE.name}")


if __name__ == "__main__":
    main()
