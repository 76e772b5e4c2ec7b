"""Blocks of bodies: their keys, the bodies that they describe, and blocks that are repeated."""
