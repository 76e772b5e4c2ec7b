"""Tests for authors of parts: contracts, strategies, invariants."""
