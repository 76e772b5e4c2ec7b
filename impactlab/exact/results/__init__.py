"""Results of the exact solver: channels, energies and links of an exact history."""
