"""Comparison of methods on two bars: the tables of methods.md.

The bars are periodic and bouncing; orders are measured, too.
"""

from __future__ import annotations

import re

from studies.comparison.bouncing import bouncing
from studies.comparison.orders import orders
from studies.comparison.periodic import periodic, trap
from studies.comparison.pictures import bouncing_bar, periodic_bar
from studies.pages import Study, filled


def without_times(page: str) -> str:
    """Return the page without the last of ten cells.

    It is the time of the first table.
    """
    return re.sub(r"^((?:\| [^|]* ){9})\| [^|]* \|$", r"\1|", page, flags=re.MULTILINE)


STUDY = Study(
    {"methods.md": filled({"periodic": periodic, "trap": trap, "bouncing": bouncing, "orders": orders})},
    {"figures/periodic_bar.png": periodic_bar, "figures/bouncing_bar.png": bouncing_bar},
    comparable=without_times,
)
