"""Errors of a run from runs of other resolutions: for the automatic choice and for converged references."""
