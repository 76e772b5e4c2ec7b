"""impactlab testing."""
