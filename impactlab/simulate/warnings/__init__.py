"""Warnings of a run: of its plan, before the first step, and of its finished history."""
