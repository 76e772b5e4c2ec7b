"""Warnings of a run: of its plan, and of its finished history."""
