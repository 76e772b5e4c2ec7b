"""Measured signals: dispersion of bars, and signals moved from a gauge to another place."""
