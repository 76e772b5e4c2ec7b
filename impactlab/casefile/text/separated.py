"""Tables as text: cells between commas, semicolons or tabs, with decimal points or, where free, commas."""

from __future__ import annotations

import csv
import io
import math


class SeparatedRows:
    """The rows of a table, read with the separator of its first line.

    Parameters
    ----------
    text : str
        The table. A first line with a tab, or else a semicolon, has it between its cells; any other has commas.

    Raises
    ------
    csv.Error
        If a quoted cell has no end.
    """

    def __init__(self, text: str) -> None:
        first = next((line for line in text.splitlines() if line.strip()), "")
        self.separator = next((mark for mark in "\t;" if mark in first), ",")
        reader = csv.reader(io.StringIO(text), delimiter=self.separator)
        self.rows = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
        """Number of the line, and its cells; lines without any are left out."""

    def number(self, cell: str) -> float:
        """Return the number in a cell.

        Raises
        ------
        ValueError
            If it is empty, no number, or not finite.
        """
        found = float(cell if self.separator == "," else cell.replace(",", "."))
        if not math.isfinite(found):
            raise ValueError
        return found
