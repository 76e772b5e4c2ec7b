"""After the last step: the history of a run, from the records of the loop."""
