"""Matrices and compiled code: bands, elimination, slopes, decorators, addresses, records, the disk cache."""
