"""Tangents of the exact solution: derivatives of waves and event times by numbers of the scene."""
