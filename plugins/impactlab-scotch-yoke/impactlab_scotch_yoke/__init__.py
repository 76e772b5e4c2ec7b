"""Mechanism of impactlab: a Scotch yoke."""
