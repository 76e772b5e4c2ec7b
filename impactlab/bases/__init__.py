"""Coordinate bases of the modal model."""
