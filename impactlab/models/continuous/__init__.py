"""Continuous bodies: the delay line, the characteristics of the Timoshenko beam, the infinite Euler-Bernoulli beam."""

from impactlab.models.continuous.model import Continuous

__all__ = ["Continuous"]
