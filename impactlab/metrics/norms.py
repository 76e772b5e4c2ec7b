"""Norms of the distance between two histories, and the metrics that are installed.

A metric is ``metric(history, reference, scene)``; it returns a number, or None where its reference is zero or where
the method has no such quantity (an impulse law has no force). Both histories may be computed or exact.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import cast

import numpy as np

from impactlab.errors import PluginError
from impactlab.history.base import AbstractHistory, Warned
from impactlab.history.frame import common_drift, touched_in
from impactlab.plugins import METRICS, Registry, registry
from impactlab.scene.facts import changes
from impactlab.scene.problem import Scene
from impactlab.types import Array

Metric = Callable[[AbstractHistory, AbstractHistory, Scene], float | None]

CELLS = 6000  # equal cells of the midpoint rule
ON_JUMP = 1e-6  # of a cell: a midpoint this near to a jump lies on it, and only rounding puts it on one side
NEAR_JUMP = 0.05  # T around a jump of the exact force that `force_away_from_jumps` leaves out
MIN_AWAY = 1e-9  # of a whole force: a smaller rest away from its jumps is the tail of a decay, no force to compare with


def midpoints(duration: float, cells: int = CELLS) -> Array:
    """Return the middles of equal cells over [0, duration], shape (cells,) [s]."""
    return np.asarray((np.arange(cells) + 0.5) * (duration / cells), dtype=float)


def mass_channels(scene: Scene) -> tuple[str, ...]:
    """Return the displacement channels of the rigid masses in contacts: ``position:hammer``."""
    return _face_channels(scene, elastic=False)


def face_channels(scene: Scene) -> tuple[str, ...]:
    """Return the displacement channels of the rod faces in contacts and of loaded ends: ``displacement:rod@0``."""
    faces = _face_channels(scene, elastic=True)
    return tuple(dict.fromkeys((*faces, *(probe.channel for probe in scene.loaded_ends))))


def force_channels(scene: Scene) -> tuple[str, ...]:
    """Return the channels of the contact forces: ``force:hammer|rod.left``."""
    return tuple(f"force:{contact.name}" for contact in scene.contacts)


def _face_channels(scene: Scene, elastic: bool) -> tuple[str, ...]:
    faces = ((scene.bodies[point.body], point.x) for point in scene.faces)
    moving = (body.face_channel(x) for body, x in faces if body.moves and (body.elastic is not None) == elastic)
    return tuple(dict.fromkeys(moving))


ZERO = 1e-12  # of the values: a reference below it is zero
MIN_DISPLACED = 1e-9  # of the largest displacement of a mass: smaller ones, as ahead of a wave in a chain, are rounding


def relative_l2(values: Array, reference: Array, drift: Array | None = None) -> float | None:
    """Return |values - reference| / |reference| on equal cells, arrays of shape (cells,).

    None where the reference is zero throughout, NaN where values are NaN. With a ``drift``
    (`impactlab.history.frame.common_drift`, same shape) the scale is |reference - drift|: that of the motion within the
    frame of the bodies that interact. Where that is zero, a body only drifts, and the scale is |reference|.
    """
    size, own = float(np.linalg.norm(reference)), float(np.linalg.norm(values))
    # A reference that is so much smaller than the values is zero except for its rounding.
    if size == 0.0 or size <= ZERO * own:
        return None
    within = size if drift is None else float(np.linalg.norm(reference - drift))
    scale = within if within > ZERO * max(size, own) else size
    return float(np.linalg.norm(values - reference)) / scale


def largest(values: Iterable[float | None]) -> float | None:
    """Return the largest value; None without any, or where one is NaN."""
    known = [value for value in values if value is not None]
    return None if not known or not np.all(np.isfinite(known)) else max(known)


def displacement_error(
    history: AbstractHistory, reference: AbstractHistory, scene: Scene, name: str, t: Array, touched: frozenset[str]
) -> float | None:
    """Return the relative L2 error of a displacement over cells t (cells,) [s].

    ``touched`` are the contacts that were closed in the reference (`touched_in`).

    The scale is the displacement of the reference in the frame of the bodies that interact in it, so the error is the
    same however fast they all fly along together. Where a wall or a held body interacts, or no contact was closed, it
    is the displacement itself.
    """
    moved = common_drift(scene, name, t, touched) if touched else None
    start = float(reference.evaluate(0.0, name)) if changes(scene) else 0.0  # faces of a mechanism have positions
    one, other = _both(history, reference, name, t)
    return relative_l2(one - start, other - start, moved)


def _both(history: AbstractHistory, reference: AbstractHistory, name: str, t: Array) -> tuple[Array, Array]:
    """Return a channel of two histories at times t (n,) [s]; read once where they are the same."""
    values = history.evaluate(t, name)
    return values, values if history is reference else reference.evaluate(t, name)


def mass_displacement(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> float | None:
    """Return the relative L2 error of the displacement of the masses in contacts, the largest.

    Of free bodies the scale is that in their frame; see `displacement_error`. Masses that move by less than
    `MIN_DISPLACED` of the farthest are left out.
    """
    t = midpoints(scene.duration)
    moved = {name: _displacement(reference, scene, name, t) for name in mass_channels(scene)}
    return _largest_displacement_error(history, reference, scene, displaced(moved))


def _displacement(history: AbstractHistory, scene: Scene, name: str, t: Array) -> float:
    """Return the norm of a displacement over cells t (cells,) [m]."""
    start = float(history.evaluate(0.0, name)) if changes(scene) else 0.0
    return float(np.linalg.norm(history.evaluate(t, name) - start))


def displaced(moved: Mapping[str, float]) -> list[str]:
    """Return the names of masses that move, from the norms of their displacements [m]."""
    least = MIN_DISPLACED * max(moved.values(), default=0.0)
    return [name for name, size in moved.items() if not size < least]


def face_displacement(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> float | None:
    """Return the largest relative L2 error of displacements of faces and loaded ends.

    Of free bodies the scale is that in their frame; see `displacement_error`.
    """
    return _largest_displacement_error(history, reference, scene, face_channels(scene))


def _largest_displacement_error(
    history: AbstractHistory, reference: AbstractHistory, scene: Scene, names: Iterable[str]
) -> float | None:
    t, touched = midpoints(scene.duration), touched_in(reference)
    return largest(displacement_error(history, reference, scene, name, t, touched) for name in names)


def force(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> float | None:
    """Return the largest relative L2 error of the contact forces.

    Jumps keep it above about N^-1/2.
    """
    t = midpoints(scene.duration)
    return largest(_force_error(history, reference, name, t, scene.duration) for name in force_channels(scene))


def _force_error(
    history: AbstractHistory, reference: AbstractHistory, name: str, t: Array, duration: float
) -> float | None:
    """Return the relative L2 error of a force over cells t (cells,) [s].

    Where a jump lies on t, half of each side counts. Steps are often such a share of the duration that jumps of the
    force fall on middles of cells.
    """
    jumps = np.concatenate((history.jumps(name), reference.jumps(name)))
    near = ON_JUMP * duration / CELLS
    met = distances(t, jumps) <= near
    if not met.any():
        return relative_l2(*_both(history, reference, name, t))
    points = np.concatenate((t[~met], t[met] - 2.0 * near, t[met] + 2.0 * near))
    root = np.sqrt(np.where(np.arange(points.size) < t.size - met.sum(), 1.0, 0.5))  # of weights
    return relative_l2(*(root * values for values in _both(history, reference, name, points)))


def force_away_from_jumps(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> float | None:
    """Return `force` without 0.05 T on either side of each jump of the exact force.

    None in a scene without a rod, which has no T. A contact whose exact force lies next to its jumps only is left out.
    """
    if not np.isfinite(scene.round_trip):
        return None
    errors = []
    for name in force_channels(scene):
        t = midpoints(scene.duration)
        exact = reference.evaluate(t, name)
        away = distances(t, reference.jumps(name)) > NEAR_JUMP * scene.round_trip
        if float(np.linalg.norm(exact[away])) > MIN_AWAY * float(np.linalg.norm(exact)):
            errors.append(_force_error(history, reference, name, t[away], scene.duration))
    return largest(errors)


def distances(t: Array, instants: Array) -> Array:
    """Return the distance (n,) [s] of each time from the nearest instant; infinite without one."""
    if not len(instants):
        return np.full(len(t), np.inf)
    ordered = np.sort(instants, kind="stable")  # quick: mostly one or two sorted runs
    after = np.searchsorted(ordered, t)
    before, next_ = ordered[np.maximum(after - 1, 0)], ordered[np.minimum(after, len(ordered) - 1)]
    return np.asarray(np.minimum(np.abs(t - before), np.abs(t - next_)))


def impulse(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> float | None:
    """Return the largest relative error of the total impulse of contacts and links.

    That of a link is taken over the integral of |F|: pushes and pulls may leave a sum near zero.
    """
    errors: list[float | None] = []
    for contact in scene.contacts:
        given, exact = history.impulse_of(contact.name), reference.impulse_of(contact.name)
        size = abs(exact)
        if history.method.laws[contact.name].two_sided:
            forces = reference.evaluate(midpoints(scene.duration), f"force:{contact.name}")
            size = max(size, scene.duration * float(np.mean(np.abs(forces))))
        errors.append(None if size == 0.0 else abs(given - exact) / size)
    return largest(errors)


ORDER = (
    "mass_displacement",
    "face_displacement",
    "force",
    "force_away_from_jumps",
    "force_graph",
    "impulse",
    "peak_force",
    "event_times",
    "events_missed",
    "events_extra",
    "exit_velocity",
    "opening_time",
    "force_oscillation",
    "momentum_error",
)
"""The order in which a summary names the metrics; those of plugins follow by name."""


def installed(requested: Iterable[str] = ()) -> dict[str, Metric]:
    """Return impactlab's metrics and the requested ones of plugins, by name.

    A plugin's metric that is not requested is not imported.

    Raises
    ------
    PluginError
        If a requested metric is not installed, or cannot be used.
    """
    known = registry()
    own = Registry(entry for entry in known.entries if entry.group == METRICS.name and is_own(entry.value))
    if not own.entries:
        raise PluginError(
            "no metric is registered, not even those of impactlab: its installation is older than they are",
            remedy="Install impactlab again (pip install .).",
        )
    names = {entry.name for entry in own.entries} | set(requested)
    ordered = (*(name for name in ORDER if name in names), *sorted(names.difference(ORDER)))
    # Of a name that a plugin registered, too, impactlab's own is meant.
    return {name: cast(Metric, (own if name in own.names(METRICS) else known).load(METRICS, name)) for name in ordered}


def is_own(module: str) -> bool:
    """Return whether a module, or the value of an entry point, belongs to impactlab itself."""
    return module.partition(":")[0].strip().partition(".")[0] == "impactlab"


def errors(
    history: AbstractHistory,
    reference_name: str,
    reference: AbstractHistory,
    scene: Scene,
    metrics: Mapping[str, Metric] | None = None,
) -> dict[str, str | float | None]:
    """Return the ``errors`` block of a summary: reference and metrics.

    Parameters
    ----------
    history, reference : AbstractHistory
        The run and its reference, both over [0, duration] of the scene.
    reference_name : str
        Name under which the reference is reported, e.g. ``st_venant``.
    scene : Scene
        The scene of ``history``; gives contacts, duration and T.
    metrics : mapping, optional
        Name to metric; if not given impactlab's own and those that the scene names. A plugin's metric that raises,
        tries to leave or returns no number leaves a warning ``metric_failed`` on ``history`` and None here.
    """
    found: dict[str, str | float | None] = {"reference": reference_name}
    for name, metric in (installed(scene.metrics) if metrics is None else metrics).items():
        found[name] = _measured(name, metric, history, reference, scene)
    return found


def _measured(
    name: str, metric: Metric, history: AbstractHistory, reference: AbstractHistory, scene: Scene
) -> float | None:
    if is_own(metric.__module__):
        return metric(history, reference, scene)
    try:
        with contextlib.redirect_stdout(sys.stderr):  # its output would break a JSON document
            value = metric(history, reference, scene)
            return value if value is None or isinstance(value, int) else float(value)
    except (Exception, SystemExit) as error:  # noqa: BLE001 - the run goes on without a number from it
        home = metric.__module__.partition(".")[0]
        text = f"metric {name} of {home}: {type(error).__name__}: {str(error)[:200]}"
        history.warnings.append(Warned("metric_failed", text))
        return None
