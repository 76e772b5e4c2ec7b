"""Solutions that errors are measured against: exact ones, and converged ones with their predicted cost."""
