"""The ledger of the 1999 paper: its claims and its figures, computed again."""
