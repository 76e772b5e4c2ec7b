"""Many exact runs of one network that differ in numbers alone, compiled.

Each run is one vector of numbers.
"""
