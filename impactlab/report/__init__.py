"""Reports: text, tables, figures and pages of runs."""
