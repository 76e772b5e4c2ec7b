"""The 1999 paper computed again: its claims and figures.

They are the ledger of its claims, and its figures 2 and 4 to 11.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence

from studies.pages import Study
from studies.paper.figures import FIGURES, captions
from studies.paper.ledger import ROWS, document, page


def command(arguments: Sequence[str]) -> int:
    """Print one row of the ledger with all digits."""
    parser = argparse.ArgumentParser(prog="python -m studies paper", description="Print one row of the ledger.")
    parser.add_argument("--row", choices=[item.name for item in ROWS], required=True)
    name = parser.parse_args(arguments).row
    item = next(item for item in ROWS if item.name == name)
    found = item.test()
    print(f"{item.where}: {item.claim}\nprinted: {item.printed}\nours: {found.ours}\nverdict: {item.verdict}")
    print("\n".join(f"  {key} = {value:.12g}" for key, value in found.values.items()))
    return 0 if found.stands else 1


STUDY = Study(
    {
        "paper/ledger.md": lambda _: page(),
        "paper/ledger.json": lambda _: document(),
        "paper/figures/README.md": captions,
    },
    {f"paper/figures/figure_{item.number:02d}": item.draw for item in FIGURES},
    command=command,
    # Of a hard mass on a slender beam, whose contact chatters: digits beyond the third differ between processors.
    comparable=lambda text: re.sub(r'"(eigenvectors|ritz)": (0\.0*\d{3})\d*', r'"\1": \2', text),
)
