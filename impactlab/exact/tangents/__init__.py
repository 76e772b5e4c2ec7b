"""Tangents of the exact solution: derivatives of its waves and event times with respect to numbers of the scene."""
