"""The stepped run: a scene as flat arrays, and the compiled step loop."""
