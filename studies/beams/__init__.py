"""Beams: bases, dispersive waves, the first force of an impact."""
