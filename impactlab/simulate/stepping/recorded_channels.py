"""The channels of a stepped run, read from the records of the loop."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.models.continuous.delay_line import DelayLine
from impactlab.scene.problem import Scene
from impactlab.simulate.channels import Channel
from impactlab.simulate.stepping import readout
from impactlab.simulate.stepping.arrays import SAMPLED
from impactlab.simulate.stepping.assembly import Assembly
from impactlab.types import Array

Ends = dict[str, tuple[Array, Array]]  # of delay lines: times; displacements of both ends, or waves


class Instants(NamedTuple):
    """The instants to which recorded values belong [s]."""

    times: Array  # ends of steps: displacements and gaps
    velocities: Array
    forces: Array  # ends of the intervals over which they acted
    middles: Array  # of these


def read_channels(assembly: Assembly, integrator: AbstractIntegrator) -> tuple[dict[str, Channel], Ends]:
    """Return the channels of a run by name, without those inside delay lines; and the records of these."""
    scene, layout, channels = assembly.scene, assembly.layout, dict[str, Channel]()
    record = assembly.memory.record[: assembly.clock.n_records]
    at, bead_gaps = instants_of(assembly, integrator, record), readout.bead_gaps(assembly, record)
    for number in range(len(scene.contacts)):
        channels.update(of_contact(assembly, number, record, at, bead_gaps))
    for group, total in sums_of_groups(scene, channels):
        channels.setdefault(group, total)
    for probe in layout.recorded:
        column, on = layout.probe_column(probe), at.times
        if probe.quantity == "velocity":
            on = velocity_times(assembly, probe.body, probe.x, at)
        elif probe.quantity == "moment":  # of a drive: that in the middle of a step
            on = middles_of_steps(assembly, at)
        # A face that a contact presses in beyond its coordinates is known from the contact.
        channels.setdefault(probe.channel, Channel(on, record[:, column], False))
    sample = assembly.memory.sample[: assembly.clock.n_samples]
    places = {name: number for number, name in enumerate(layout.built)}
    for name, body in scene.bodies.items():
        first = SAMPLED + 3 * places[name]
        if not body.changes:  # the momentum of a mechanism is a vector, which nothing sums up
            channels[f"momentum:{name}"] = Channel(sample[:, 0], sample[:, first + 2], False)
        channels[f"energy:{name}"] = Channel(sample[:, 0], sample[:, first], False)
    return channels, ends_of(assembly, record, at.times, channels)


def instants_of(assembly: Assembly, integrator: AbstractIntegrator, record: Array) -> Instants:
    """Return the instants of the records of a run under its scheme."""
    times = record[:, 0].copy()  # side by side: every read of a column takes a line of memory per record
    lengths = times.copy()
    lengths[1:] -= times[:-1]
    last_steps = np.minimum(lengths, assembly.dt)  # a record of several steps ends with the last of them
    of_velocity, of_force, middles = times, times, times - 0.5 * lengths
    if integrator.velocity_point != 1.0:
        early = (1.0 - integrator.velocity_point) * last_steps
        early[:1] = (1.0 - integrator.velocity_point) * assembly.dt  # the velocity at t = 0 belongs to the step before
        of_velocity = times - early
    if integrator.load_point != 0.5:
        late = (integrator.load_point - 0.5) * last_steps
        of_force, middles = np.minimum(times + late, times[-1]), middles + late
    return Instants(times, of_velocity, of_force, middles)


def velocity_times(assembly: Assembly, body: str, x: float, at: Instants) -> Array:
    """Return the instants of recorded velocities at x [s]: those of a chain of delays are means over a step."""
    model = assembly.layout.built[body].model
    if not (isinstance(model, DelayChain) and model.gives_means(x)):
        return at.velocities
    return middles_of_steps(assembly, at)


def middles_of_steps(assembly: Assembly, at: Instants) -> Array:
    """Return the middles of the steps that end at the records [s]; the start of the run for its first record."""
    lengths = np.diff(at.times, prepend=at.times[:1])
    return np.asarray(at.times - 0.5 * np.minimum(lengths, assembly.dt))


def of_contact(
    assembly: Assembly, number: int, record: Array, at: Instants, bead_gaps: Array
) -> Iterator[tuple[str, Channel]]:
    """Give force and gap of a contact, and the motion of its faces on bodies that deform, by name.

    ``bead_gaps`` are those of the contacts of rows of beads [m], (n_bead_contacts, n_records).
    """
    scene, layout = assembly.scene, assembly.layout
    contact, column = scene.contacts[number], layout.column_of(number)
    law = assembly.acting.laws[contact.name]
    force = record[:, column] if law.answers_force else np.full_like(at.times, np.nan)
    # The force of a hard contact starts and ends with jumps, often within a few steps: it stays as it acted.
    yield f"force:{contact.name}", Channel(at.forces, force, True, None if law.hard else at.middles)
    if column >= layout.first_bead_force:
        yield f"gap:{contact.name}", Channel(at.times, bead_gaps[column - layout.first_bead_force], False)
        return
    yield f"gap:{contact.name}", Channel(at.times, record[:, column + 1], False)
    for side, point in enumerate((contact.left, contact.right)):
        if scene.bodies[point.body].elastic is not None:
            first = column + 2 + 2 * side
            place = f"{point.body}@{point.x:.6g}"
            yield f"displacement:{place}", Channel(at.times, record[:, first], False)
            moved = velocity_times(assembly, point.body, point.x, at)
            yield f"velocity:{place}", Channel(moved, record[:, first + 1], False)


def sums_of_groups(scene: Scene, channels: Mapping[str, Channel]) -> Iterator[tuple[str, Channel]]:
    """Give the sums of the forces of contacts of one name."""
    grouped: dict[str, list[Channel]] = {}
    for contact in scene.contacts:
        if contact.group:
            grouped.setdefault(contact.group, []).append(channels[f"force:{contact.name}"])
    for group, forces in grouped.items():
        total = sum((each.values for each in forces[1:]), forces[0].values)
        yield f"force:{group}", forces[0]._replace(values=total)


def ends_of(assembly: Assembly, record: Array, times: Array, channels: Mapping[str, Channel]) -> Ends:
    """Return the records of delay lines, by body."""
    layout, found = assembly.layout, Ends()
    first = layout.first_probe + len(layout.probes)
    far = {(each.body, each.x): record[:, first + number] for number, each in enumerate(layout.far_ends)}
    for name, body in layout.built.items():
        if isinstance(body.model, DelayLine):
            ends = [
                far[name, x] if (name, x) in far else channels[f"displacement:{name}@{x:.6g}"].values
                for x in (0.0, body.body.length)
            ]
            found[name] = times, np.array(ends)
        elif isinstance(body.model, DelayChain):
            own = [number for number, (owner, _) in enumerate(layout.sent) if owner == name]
            found[name] = times, record[:, first + len(layout.far_ends) :][:, own].T
    return found
