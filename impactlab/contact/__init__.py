"""impactlab contact."""
