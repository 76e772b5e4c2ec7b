"""impactlab exact."""
