"""Scenes integrated with adaptive steps between the events of their contacts."""
