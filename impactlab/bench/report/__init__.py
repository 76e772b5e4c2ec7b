"""Figures, tables and pages from the table of a bench alone. Nothing is run here."""
