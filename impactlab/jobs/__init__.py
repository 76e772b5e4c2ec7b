"""Many runs side by side: a process pool, hashes of the code that results depend on, file locks."""
