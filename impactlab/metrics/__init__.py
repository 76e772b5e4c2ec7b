"""Distances between two histories, and the velocities, impulses and collisions of one."""

from impactlab.metrics.events import Matches, event_times, events_extra, events_missed, match_events
from impactlab.metrics.force_graphs import force_graph, graph
from impactlab.metrics.norms import (
    Metric,
    displacement_error,
    errors,
    face_channels,
    face_displacement,
    force,
    force_away_from_jumps,
    force_channels,
    impulse,
    installed,
    mass_channels,
    mass_displacement,
    midpoints,
    relative_l2,
)

__all__ = [
    "Matches",
    "Metric",
    "displacement_error",
    "errors",
    "event_times",
    "events_extra",
    "events_missed",
    "face_channels",
    "face_displacement",
    "force",
    "force_away_from_jumps",
    "force_channels",
    "force_graph",
    "graph",
    "impulse",
    "installed",
    "mass_channels",
    "mass_displacement",
    "match_events",
    "midpoints",
    "relative_l2",
]
