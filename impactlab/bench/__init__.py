"""The bench: methods and settings over a suite of cases, row by row in one table."""
