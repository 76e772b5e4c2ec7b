"""Random scenes against programs that share no code with impactlab: how far tolerances and references hold."""
