"""Results of a stepped run: its history, from the records of the loop."""
