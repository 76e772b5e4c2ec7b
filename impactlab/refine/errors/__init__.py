"""Estimated errors of a run from its differences to runs of other resolutions."""
