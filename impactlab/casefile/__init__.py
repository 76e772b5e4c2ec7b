"""impactlab casefile."""
