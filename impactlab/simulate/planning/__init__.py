"""Parts of a plan: bodies in coordinates, pairs that may not meet, forces at t = 0, limits of the step."""
