"""Pages of docs/ that a study writes: their folders, and the text between two comments of a page."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS, CASES = ROOT / "docs", ROOT / "cases"
