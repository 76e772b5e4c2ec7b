"""After the march: channels, energies and links of an exact history."""
