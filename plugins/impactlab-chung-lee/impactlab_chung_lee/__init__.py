"""Integrator of impactlab: the explicit dissipative scheme of Chung and Lee."""
