"""Warnings of vibrations in modes that a basis gives only approximately.

Shapes of a basis may hold the static response to a contact and still miss vibrations elsewhere, as those of a beam in
pieces with one mode each. A step of inverse iteration on the mesh shows this: eigenvectors stay as they are; where
another shape changes at a probe, the probe is wrong by about as much, and the change of its frequency gives the phase
by which the vibration is ahead at the end of the run.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from impactlab.bases.reduced import ReducedMesh
from impactlab.history.base import Warned
from impactlab.models.modal import Modal
from impactlab.models.modal_body import ModalBody
from impactlab.plugins import kind_of
from impactlab.scene.bodies import ElasticBody
from impactlab.simulate.channels import AbstractRecordedHistory, Channel, Probed, probed
from impactlab.simulate.warnings.probes import of_unit_force
from impactlab.types import Array

APPROXIMATE_WARN = 0.1  # of the root mean square of a probe; errors were 1 to 2 times as large
LARGEST_PHASE = np.pi  # in opposition, the error is twice the amplitude
MAX_INSTANTS = 4000  # of a force; more are added up in groups


class Vibration(NamedTuple):
    """Modes of a body, and their change by a step of inverse iteration."""

    basis: ReducedMesh
    iterated: Array  # (n_mesh_dof, n) shapes after that step
    phases: Array  # (n,) rad, by which they are ahead at the end of the run
    amplitudes: Array  # (n,) of the coordinates

    def error(self, probe: Probed, channel: Channel) -> float:
        """Return the error of a probe over its root mean square."""
        rate = probe.quantity == "velocity"
        row = probe.factor * self.basis.mesh.row(probe.x, "displacement" if rate else probe.quantity)
        amplitudes = self.amplitudes * self.basis.frequencies if rate else self.amplitudes
        missed = row @ (self.basis.shapes - self.iterated) * amplitudes
        ahead = 2.0 * row @ self.basis.shapes * amplitudes * np.sin(0.5 * self.phases)
        size = float(channel.values @ channel.values) / channel.values.size
        return float(np.sqrt(0.5 * (missed @ missed + ahead @ ahead) / size)) if size > 0.0 else 0.0


def warnings(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Give a warning for each body with probes at which approximate modes vibrate."""
    for name, model in history.method.models.items():
        if not isinstance(model, Modal) or (body := history.scene.elastic.get(name)) is None:
            continue
        probes = [each for each in probed(history.scene) if each.body == name and not _is_zero(body, each)]
        vibration = _vibration(history, body) if probes else None
        if vibration is None:
            continue
        errors = {each.channel: vibration.error(each, history.recorded[each.channel]) for each in probes}
        found = {channel: error for channel, error in errors.items() if error > APPROXIMATE_WARN}
        if found:
            worst = max(found, key=lambda channel: found[channel])
            more = f", and {len(found) - 1} more probes of '{name}' are wrong" if len(found) > 1 else ""
            yield Warned(
                "approximate_modes",
                f"{worst}: wrong by about {100 * min(1.0, found[worst]):.0f} %{more}. The modes of basis "
                f"'{kind_of(model.basis)}' that vibrate there differ from those of the mesh in shape and "
                f"frequency; give {model.basis.finer}, or basis eigenvectors",
            )


def _is_zero(body: ElasticBody, probe: Probed) -> bool:
    """Return whether a probe is of an internal force that is 0.

    It is so at some ends, and all of its value is then an error.
    """
    kinds = [end.kind for x, end in body.ends if x == probe.x]
    forces = of_unit_force(body, probe.x, probe.quantity) > 0.0
    return forces and ("free" in kinds or ("pinned" in kinds and probe.quantity == "bending_moment"))


def _vibration(history: AbstractRecordedHistory, body: ElasticBody) -> Vibration | None:
    """Return the vibration of a body's modes in a run.

    None where they are eigenvectors, and of bodies not compared. These are bodies that turn, that have faces without
    mass, or that change their coordinates with a contact.
    """
    built = history.built[body.name]
    basis = built.model.approximate if isinstance(built.model, ModalBody) else None
    if basis is None or body.rotation is not None or basis.mesh.places or built.system.phases:
        return None
    frequencies, system = basis.frequencies, built.system
    elastic = frequencies > 0.0
    # z = v + i w q turns with w; forces f add the integral of f exp(-i w t).
    turning = system.velocity + 1j * frequencies * system.displacement
    for x, times, impulses in _impulses(history, body):
        turning = turning + basis.row(x, "displacement") * (np.exp(-1j * np.outer(frequencies, times)) @ impulses)
    if not np.any(turning[elastic]):
        return None
    iterated, nearer = basis.iterated()
    decay = 0.5 * system.damping[0]
    lasts = history.duration / np.maximum(1.0, decay * history.duration)
    phases = np.minimum((frequencies - nearer) * lasts, LARGEST_PHASE)
    amplitudes = np.abs(turning) / np.where(elastic, frequencies, np.inf)
    return Vibration(basis, iterated, phases, amplitudes)


def _impulses(history: AbstractRecordedHistory, body: ElasticBody) -> Iterator[tuple[float, Array, Array]]:
    """Yield places [m], times [s] and impulses [N s] of pushes on a body.

    Impulses along +x are positive; times and impulses have the shape (n,).
    """
    for _, contact in history.scene.met_by(body.name):
        channel = history.recorded.get(f"force:{contact.name}")
        if channel is None or channel.times.size < 2:
            continue
        times, impulses = 0.5 * (channel.times[1:] + channel.times[:-1]), channel.values[1:] * np.diff(channel.times)
        for point, sign in ((contact.left, -1.0), (contact.right, 1.0)):
            if point.body == body.name:
                yield point.x, *_grouped(times, sign * impulses)
    for x, load in body.loads:
        sampled = load.sampled(history.duration)
        ends = np.linspace(0.0, history.duration, MAX_INSTANTS + 1)
        times = 0.5 * (ends[1:] + ends[:-1])
        yield x, times, sampled.at(times) * np.diff(ends)


def _grouped(times: Array, impulses: Array) -> tuple[Array, Array]:
    """Return the nonzero impulses and times; neighbours added up where too many."""
    given = np.flatnonzero(impulses)
    times, impulses = times[given], impulses[given]
    if times.size <= MAX_INSTANTS:
        return times, impulses
    starts = np.arange(0, times.size, -(-times.size // MAX_INSTANTS))
    counts = np.diff(np.append(starts, times.size))
    return np.add.reduceat(times, starts) / counts, np.add.reduceat(impulses, starts)
