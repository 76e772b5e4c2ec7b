"""Audit of tolerances and references on random scenes.

They are compared with programs that share no code with impactlab.
"""
