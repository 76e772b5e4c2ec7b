"""What is drawn and told from the table of a bench alone: figures, tables, pages. Nothing is run here."""
