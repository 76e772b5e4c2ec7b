"""Single values of a case: numbers with units, formulas, materials, loads; and the errors of wrong ones."""
