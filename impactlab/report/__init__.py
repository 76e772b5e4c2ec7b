"""impactlab report."""
