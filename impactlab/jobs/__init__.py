"""Many runs side by side: a process pool, hashes of code, file locks.

Results depend on the hashed code.
"""
