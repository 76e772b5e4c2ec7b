"""Single values of a case: numbers with units, formulas, materials, loads; and their faults."""
