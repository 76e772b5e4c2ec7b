"""Matrices and compiled code: bands, slopes, decorators, addresses of functions, the disk cache of kernels."""
