"""Counts in words."""

from __future__ import annotations


def counted(methods: int) -> str:
    """Return a number of methods in words."""
    return "1 method" if methods == 1 else f"{methods} methods"
