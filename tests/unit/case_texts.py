"""The paper's case as a text, a key to a line, for tests of what is read and refused."""

from __future__ import annotations

PAPER = """\
schema_version: 1
title: a test
bodies:
  hammer: {kind: mass, mass: 2.133, velocity: 1.0}
  rod:
    kind: rod
    length: 0.3
    area: 9.0e-4
    material: {young: 2.1e11, density: 7900}
    ends: {left: free, right: clamped}
contacts:
  - between: [hammer, rod.left]
    gap: 0.0
    law: {kind: addition_deletion}
solve:
  duration: {round_trips: 1}
  model: {kind: finite_element, elements: 20}
  integrator: {kind: newmark}
  step: {points_per_period: 10}
"""
