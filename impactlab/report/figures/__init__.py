"""Figures of runs and comparisons, as matplotlib draws them, in the house style."""
