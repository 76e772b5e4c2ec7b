"""impactlab models."""
