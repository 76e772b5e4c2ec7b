"""Set-up of a stepped run: a plan as the flat arrays of the step loop."""
