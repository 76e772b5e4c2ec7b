"""Loading matplotlib once for all figures of a page."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any


def load_matplotlib() -> None:
    """Load the parts of matplotlib that draw the figures of a page.

    Its classes write tables of their properties into docstrings, which takes two fifths of the time: a command shows no
    docstrings. Where matplotlib is loaded, as in a notebook, nothing changes.
    """
    if "matplotlib.figure" in sys.modules:
        return
    artist: Any = import_module("matplotlib.artist")
    tables, artist.kwdoc = artist.kwdoc, lambda _: ""
    try:
        from matplotlib import figure  # noqa: F401
    finally:
        artist.kwdoc = tables
    from matplotlib.backends import backend_svg  # noqa: F401
