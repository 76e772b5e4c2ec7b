"""What happens before a run: checks of the environment, imports on first use, values found once, wall time by stage."""
