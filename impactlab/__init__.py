"""impactlab ."""
