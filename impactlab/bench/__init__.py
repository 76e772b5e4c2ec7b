"""The bench: a grid of methods and settings run over a suite of cases, kept row by row in one table."""
