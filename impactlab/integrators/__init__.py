"""impactlab integrators."""
