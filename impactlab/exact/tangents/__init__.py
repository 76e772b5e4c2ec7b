"""Tangents of the exact solution: derivatives of waves and event times.

They are with respect to numbers of the scene.
"""
