"""Analytic modes of uniform beams: frequencies, shapes, statics, waves."""
