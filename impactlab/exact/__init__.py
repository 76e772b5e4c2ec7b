"""Exact solution of rods, rigid masses and walls, from event to event."""
