"""Contact law of impactlab: a power law solved without iteration, by energy quadratisation."""
