"""The start of a process: its environment, imports on first use, wall time by stage."""
