"""The site: ``python -m sphinx -W docs out/site``. Nothing is fetched while it is built, and nothing by its pages."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.util.fileutil import copy_asset

import impactlab

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]

from gallery import GALLERY

project, author = "impactlab", "The impactlab developers"
copyright = author  # noqa: A001
version = release = impactlab.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "sphinxcontrib.bibtex",
    "both_forms",
    "fields",
    "links",
    "made",
]
exclude_patterns = ["README.md", "_ext", "examples", "tutorials", "generated/**/*.ipynb", "generated/**/*.py"]
exclude_patterns += ["generated/**/sg_execution_times.rst", "sg_execution_times.rst"]
suppress_warnings = ["config.cache"]  # functions among the settings of the gallery

myst_enable_extensions = ["amsmath", "attrs_inline", "colon_fence", "deflist", "dollarmath", "smartquotes"]
myst_heading_anchors = 4
smartquotes_action = "qe"  # no dashes: two hyphens begin an option
bibtex_bibfiles = ["../impactlab/citations.bib"]
bibtex_default_style = "unsrt"
bibtex_reference_style = "author_year"
sphinx_gallery_conf = GALLERY

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
napoleon_numpy_docstring, napoleon_google_docstring = True, False
napoleon_use_ivar = True  # fields of records as one list

html_theme = "furo"
html_title = "impactlab"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = html_copy_source = html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": True}
copybutton_exclude = ".linenos, .gp, .go"
pygments_style, pygments_dark_style = "a11y-light", "github-dark"

MATHJAX = Path(importlib.util.find_spec("sphinx-mathjax-offline").origin).parent / "static" / "mathjax"  # type: ignore[union-attr, arg-type]
mathjax_path = "mathjax/tex-chtml.js"


def copy_mathjax(app: Sphinx, error: Exception | None) -> None:
    """Copy the one script and the fonts that formulas need, a twentieth of the whole package."""
    if error is None and app.builder.format == "html":
        static = Path(app.outdir) / "_static" / "mathjax"
        copy_asset(MATHJAX / "tex-chtml.js", static)
        copy_asset(
            MATHJAX / "output" / "chtml" / "fonts" / "woff-v2", static / "output" / "chtml" / "fonts" / "woff-v2"
        )


def name_levels(_app: Sphinx, _page: str, _template: str, context: dict[str, Any], _tree: object) -> None:
    """Give the captions of the navigation, which are headings, their level: screen readers need it."""
    tree = str(context.get("furo_navigation_tree", ""))
    context["furo_navigation_tree"] = tree.replace('role="heading"', 'role="heading" aria-level="2"')


def setup(app: Sphinx) -> None:
    """Register what this file does beside its settings."""
    app.connect("build-finished", copy_mathjax)
    app.connect("html-page-context", name_levels, priority=900)
