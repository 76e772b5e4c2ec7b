"""The text of a case file: read within limits, written, and cut to what is safe to show."""
