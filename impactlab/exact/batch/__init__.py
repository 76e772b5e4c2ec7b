"""Many exact runs of one network that differ in a vector of numbers alone, compiled."""
