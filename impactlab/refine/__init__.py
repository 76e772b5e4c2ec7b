"""Error estimates from several runs, for the automatic choice and converged references."""
