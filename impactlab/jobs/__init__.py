"""Many runs side by side: a process pool, hashes of the code that their results depend on, locks of files."""
