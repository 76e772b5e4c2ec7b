"""Exact solution of rods, rigid masses and walls in contact: waves followed from event to event."""
