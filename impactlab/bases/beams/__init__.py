"""Analytic modes of uniform beams: roots, shapes, static answers, wave numbers."""
