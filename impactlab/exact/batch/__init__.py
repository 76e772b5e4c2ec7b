"""Many runs of the exact solver that differ in numbers alone, in compiled code: one network, one vector per run."""
