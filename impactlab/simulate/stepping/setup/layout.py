"""Layout of a stepped run: the order of bodies, contacts and record columns."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Literal, NamedTuple, final

from impactlab.errors import CaseError
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.models.continuous.delay_line import DelayLine
from impactlab.numerics.records import FLOATS_PER_LINE, on_lines
from impactlab.scene.sizes import kept_of_rows
from impactlab.simulate.channels import Probed, probed
from impactlab.simulate.plan import Plan
from impactlab.simulate.stepping.arrays import SAMPLED, SAMPLES
from impactlab.simulate.stepping.setup.bead_rows import BeadRows, bead_rows
from impactlab.startup.cached import cached_property
from impactlab.types import Array, Quantity

MOTION: tuple[Quantity, ...] = ("displacement", "velocity")
MIN_SAMPLES, MOST_SAMPLED = 64, 2**17  # energies taken of scenes of many bodies; numbers in all of them
MIN_ALIGNED = 32  # entries of the state of a body
SECOND_ON_LINE = FLOATS_PER_LINE - 1  # where a body starts in a line: chains step eight nodes at a time from the second
PER_CONTACT = 6  # columns of the record: force, gap, displacement and velocity of both faces


def steps_per_sample(steps: int, bodies: int) -> int:
    """Return the number of steps between two samples of the energies.

    Scenes of many bodies have fewer samples.
    """
    return math.ceil(steps / min(SAMPLES, max(MIN_SAMPLES, MOST_SAMPLED // (3 * bodies))))


InstantsOfVelocity = Literal["times", "velocities", "step_means"]


class Source(NamedTuple):
    """Where the values of a channel stand in the records, and their instants."""

    kept: Literal["record", "sample", "bead_gaps", "none"]
    columns: tuple[int, ...]  # of several the sum is read; of bead gaps the rows
    instants: InstantsOfVelocity | Literal["forces"] = "times"
    stepped: bool = False
    sloped: bool = False  # means over steps, read with a slope inside each
    rate: bool = False  # follows from velocities
    pulls: bool = False  # the force of a law that may pull
    cubic: bool = False  # motion or force of beads between records that are several steps apart


@final
class Layout:
    """The order of bodies, contacts and record columns in the loop.

    Beads of rows come first among the bodies, their contacts last. Columns of the record: time; six for each contact
    that is solved; forces of bead contacts; displacements of all beads, then velocities; probes; ends of delay lines;
    waves that chains of delays send.
    """

    def __init__(self, plan: Plan, dt: float, with_beads: bool = True) -> None:
        scene = plan.scene
        self.plan, self.scene, self.dt, self.steps = plan, scene, dt, plan.steps
        self.rows = bead_rows(plan) if with_beads else BeadRows([], {})
        in_rows = set(self.rows.contacts)
        self.solved = [number for number in range(len(scene.contacts)) if number not in in_rows]
        self.numbers = [*self.solved, *self.rows.contacts]  # of the contacts of the loop, in the scene
        self.places = {number: place for place, number in enumerate(self.numbers)}
        self.contacts = [scene.contacts[number] for number in self.solved]
        self.points = [point for contact in self.contacts for point in contact.faces]
        self.pushes = [push._replace(contact=self.places[push.contact]) for push in plan.pushes]
        names = dict.fromkeys((*self.rows.beads, *plan.built))
        self.built = {name: plan.built[name] for name in names}
        self.steppers = {name: plan.steppers[name] for name in names}
        self.body_numbers = {name: number for number, name in enumerate(names)}
        self._place_states()
        self.stride = math.ceil(plan.steps / self._kept_records())
        self.sample_stride = steps_per_sample(plan.steps, len(names))
        self._read_probes()
        self.first_bead_force = 1 + PER_CONTACT * len(self.solved)
        self.n_beads = len(self.rows.beads)
        self.first_bead = self.first_bead_force + len(self.rows.contacts)  # their displacements, then velocities
        self.first_probe = self.first_bead + 2 * self.n_beads
        self.n_columns = self.first_probe + len(self.probes) + len(self.far_ends) + len(self.sent)

    def copied(self) -> Layout:
        """Return a copy that shares all parts."""
        other = object.__new__(Layout)  # `copy.copy` takes several times as long
        other.__dict__.update(self.__dict__)
        return other

    def restepped(self, plan: Plan, dt: float) -> Layout:
        """Return the layout of a plan that has another step [s].

        Its bodies and contacts are the same.
        """
        if self.in_waves or self.rows.rows:  # records may be too far apart for waves
            return Layout(plan, dt)
        other = self.copied()
        other.plan, other.scene, other.dt, other.steps = plan, plan.scene, dt, plan.steps
        other.steppers = {name: plan.steppers[name] for name in self.steppers}
        other._place_states()
        other.stride = math.ceil(plan.steps / plan.scene.records)
        other.sample_stride = steps_per_sample(plan.steps, len(self.built))
        return other

    def _place_states(self) -> None:
        """Set where the state of each body starts."""
        self.shift: dict[str, int] = {}  # in the whole state
        self.n_state = 0  # entries of the whole state, those between bodies included
        for name, stepper in self.steppers.items():
            if stepper.state.size >= MIN_ALIGNED:
                self.n_state += (SECOND_ON_LINE - self.n_state) % FLOATS_PER_LINE
            self.shift[name] = self.n_state
            self.n_state += stepper.state.size

    def _kept_records(self) -> int:
        """Return how many instants are kept at most."""
        columns = len(self.rows.contacts) + 2 * len(self.rows.beads)
        return kept_of_rows(self.scene, self.steps, columns) if columns else self.scene.records

    def _read_probes(self) -> None:
        """Separate probes that are rows over the state from probes of waves.

        The latter are read from the waves of a delay line after the run. For these the displacements of the ends that
        no contact records are recorded, too; of a chain of delays the waves that its nodes send.
        """
        lines = {name: body.model for name, body in self.built.items() if isinstance(body.model, DelayLine)}
        chains = {name: body.model for name, body in self.built.items() if isinstance(body.model, DelayChain)}
        asked = list(probed(self.scene))
        self.in_waves: list[Probed] = []
        self.far_ends: list[Probed] = []
        self.sent: list[tuple[str, Array]] = []
        beads = set(self.rows.beads)
        if not lines and not chains:
            self._record(asked, beads)
            return
        self.in_waves = [
            each
            for each in asked
            if (
                each.body in lines
                and (each.quantity not in MOTION or each.x not in (0.0, self.scene.bodies[each.body].length))
            )
            or (each.body in chains and (each.quantity not in MOTION or chains[each.body].node_at(each.x) is None))
        ]
        waves = set(self.in_waves)
        self._record([each for each in asked if each not in waves], beads)
        self.sent = [(name, row) for name, chain in chains.items() for row in chain.sent()]
        touched = {(point.body, point.x) for point in self.scene.faces}
        ends = [(name, x) for name in lines for x in (0.0, self.scene.bodies[name].length)]
        self.far_ends = [Probed("", name, x, "displacement", 1.0) for name, x in ends if (name, x) not in touched]
        spacing = self.stride * self.dt
        for each in self.in_waves:
            if spacing > 0.5 * (lines | chains)[each.body].transit:
                transit = (lines | chains)[each.body].transit
                raise CaseError(
                    f"records {spacing:.3g} s apart do not resolve the waves of '{each.body}'. Allowed: up to "
                    f"{0.5 * transit:.3g} s, half of a transit",
                    remedy=f"Give records: {math.ceil(2.0 * self.scene.duration / transit) + 1} or more, or a shorter "
                    "duration.",
                    path="solve.records",
                )

    def _record(self, recorded: list[Probed], beads: set[str]) -> None:
        """Keep the probes recorded as rows, and those not on beads."""
        self.recorded = recorded
        self.probes = [each for each in recorded if each.body not in beads]
        self._probe_places = {each: place for place, each in enumerate(self.probes)}

    @cached_property
    def sources(self) -> Mapping[str, Source]:
        """Where the values of each channel stand, by name; without those inside delay lines."""
        found: dict[str, Source] = {}
        for number in range(len(self.scene.contacts)):
            found.update(self._sources_of_contact(number))
        grouped: dict[str, list[Source]] = {}
        for contact in self.scene.contacts:
            if contact.group:
                grouped.setdefault(contact.group, []).append(found[f"force:{contact.name}"]._replace(cubic=False))
        for group, forces in grouped.items():
            columns = tuple(column for each in forces for column in each.columns)
            pulls = any(each.pulls for each in forces)
            found.setdefault(f"force:{group}", forces[0]._replace(columns=columns, pulls=pulls))
        for probe in self.recorded:
            smooth = probe.body in self.smooth_beads and probe.quantity == "displacement"
            source = Source("record", (self.probe_column(probe),), cubic=smooth)
            if probe.quantity == "velocity":
                source = source._replace(instants=self.instants_of_velocity(probe.body, probe.x), rate=True)
            elif probe.quantity == "moment":  # of a drive: that in the middle of a step
                source = source._replace(instants="step_means")
            # A face that a contact presses in beyond its coordinates is known from the contact.
            found.setdefault(probe.channel, source)
        places = {name: SAMPLED + 3 * number for number, name in enumerate(self.built)}
        for name, body in self.scene.bodies.items():
            if not body.changes:  # the momentum of a mechanism is a vector, which nothing sums up
                found[f"momentum:{name}"] = Source("sample", (places[name] + 2,), rate=True)
            found[f"energy:{name}"] = Source("sample", (places[name],), rate=True)
        return found

    def _sources_of_contact(self, number: int) -> Iterator[tuple[str, Source]]:
        """Yield the sources of a contact's force and gap, and its faces' motion.

        Faces are those on bodies that deform.
        """
        contact, column = self.scene.contacts[number], self.column_of(number)
        law = self.plan.acting.laws[contact.name]
        # The force of a hard contact starts and ends with jumps, often within a few steps: it stays as it acted.
        kept: Literal["record", "none"] = "record" if law.answers_force else "none"
        force = Source(kept, (column,), "forces", stepped=True, sloped=not law.hard, pulls=law.pulls)
        if column >= self.first_bead_force:
            smooth = {point.body for point in contact.faces if self.scene.bodies[point.body].moves} <= self.smooth_beads
            yield f"force:{contact.name}", force._replace(cubic=smooth)
            yield f"gap:{contact.name}", Source("bead_gaps", (column - self.first_bead_force,), cubic=smooth)
            return
        yield f"force:{contact.name}", force
        yield f"gap:{contact.name}", Source("record", (column + 1,))
        for side, point in enumerate(contact.faces):
            if self.scene.bodies[point.body].elastic is not None:
                first, place = column + 2 + 2 * side, f"{point.body}@{point.x:.6g}"
                yield f"displacement:{place}", Source("record", (first,))
                moved = self.instants_of_velocity(point.body, point.x)
                yield f"velocity:{place}", Source("record", (first + 1,), moved, rate=True)

    @cached_property
    def smooth_beads(self) -> set[str]:
        """Beads that are read with their velocities between records several steps apart.

        No hard contact makes these jump.
        """
        if self.stride == 1:
            return set()
        hard = [contact for contact in self.contacts if self.plan.acting.laws[contact.name].hard]
        return set(self.rows.beads) - {point.body for contact in hard for point in contact.faces}

    def rates_of(self, columns: Sequence[int]) -> list[int]:
        """Return the columns with the velocities of smooth beads, from those of displacements; -1 for all others."""
        smooth = {self.bead_column(name, "displacement") for name in self.smooth_beads}
        return [column + self.n_beads if column in smooth else -1 for column in columns]

    def instants_of_velocity(self, body: str, x: float) -> InstantsOfVelocity:
        """Return the instants of recorded velocities at x.

        Those of delay lines may be means over a step.
        """
        model = self.built[body].model
        if not isinstance(model, AbstractSelfStepping):
            return "velocities"
        return "step_means" if model.gives_means(x) else "times"

    @cached_property
    def displacement_columns(self) -> Mapping[str, int]:
        """Columns of the recorded displacements by channel.

        They are found once for runs that differ in their step alone.
        """
        found: dict[str, int] = {}
        for number, contact in enumerate(self.scene.contacts):
            for side, point in enumerate(contact.faces):
                if self.scene.bodies[point.body].elastic is not None:
                    found[f"displacement:{point.body}@{point.x:.6g}"] = self.column_of(number) + 2 + 2 * side
        for probe in self.recorded:
            if probe.quantity != "velocity":
                found.setdefault(probe.channel, self.probe_column(probe))
        return found

    def pushed_bodies(self) -> set[str]:
        """Return the bodies that contacts which are solved, pushed rows or loads over time move."""
        loaded = {name for name, body in self.built.items() if body.body.loads}
        return loaded | {point.body for point in self.points} | {push.body for push in self.pushes}

    def state(self) -> Array:
        """Return the whole state at t = 0, shape (n_state,); entries between bodies are zero."""
        whole = on_lines(self.n_state)
        for name, stepper in self.steppers.items():
            whole[self.shift[name] : self.shift[name] + stepper.state.size] = stepper.state
        return whole

    def called(self) -> list[int]:
        """Return the numbers of the bodies whose steppers the loop calls: all but beads and bodies without state."""
        sizes = [stepper.state.size for stepper in self.steppers.values()]
        return [number for number in range(self.n_beads, len(sizes)) if sizes[number] > 0]

    def n_dof(self, body: str) -> int:
        """Return the number of coordinates of a body."""
        return self.built[body].system.load.size

    def state_of(self, body: str, state: Array, velocities: bool = False) -> Array:
        """Return a body's displacements or velocities in whole states (..., n_state), shape (..., n_dof)."""
        n_dof = self.n_dof(body)
        start = self.shift[body] + (n_dof if velocities else 0)
        return state[..., start : start + n_dof]

    def column_of(self, number: int) -> int:
        """Return the column of the record with the force of a contact of the scene."""
        place = self.places[number]
        solved = len(self.solved)
        return 1 + PER_CONTACT * place if place < solved else self.first_bead_force + place - solved

    def probe_column(self, probe: Probed) -> int:
        """Return the column of the record with a probe."""
        if probe not in self._probe_places:
            return self.bead_column(probe.body, probe.quantity)
        return int(self.first_probe + self._probe_places[probe])

    def bead_column(self, body: str, quantity: Quantity) -> int:
        """Return the column of the record with the displacement or velocity of a bead."""
        return self.first_bead + self.body_numbers[body] + (self.n_beads if quantity == "velocity" else 0)
