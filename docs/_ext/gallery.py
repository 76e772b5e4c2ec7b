"""Settings of sphinx-gallery: examples and tutorials are scripts that every build runs, in the house style."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl

from impactlab.report.figures.style import house_style

DOCS = Path(__file__).parents[1]


def dress(_settings: dict[str, Any], _file: str) -> None:
    """Set matplotlib up in the house style before each script."""
    mpl.rcParams.update(house_style() | {"savefig.bbox": "tight"})


GALLERY = {
    "examples_dirs": [str(DOCS / "tutorials"), str(DOCS / "examples")],
    "gallery_dirs": [str(DOCS / "generated" / "tutorials"), str(DOCS / "generated" / "examples")],
    "filename_pattern": "",
    "within_subsection_order": "FileNameSortKey",
    "reset_modules": ("matplotlib", "gallery.dress"),
    "image_scrapers": ("both_forms.scraped", "matplotlib"),
    "capture_repr": (),
    "image_srcset": ["2x"],
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
    "download_all_examples": False,
    "remove_config_comments": True,
    "plot_gallery": "True",
    "abort_on_example_error": True,
    "only_warn_on_example_error": False,
}
