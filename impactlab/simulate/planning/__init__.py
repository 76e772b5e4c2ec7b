"""Parts of a plan: bodies, pairing checks, initial forces, step limits."""
