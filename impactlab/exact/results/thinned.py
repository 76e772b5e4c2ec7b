"""Exact histories with more waves than fit into memory.

They are sampled window by window at the instants of the records. Of sampled waves only those that the march still needs
are kept: one transit of the longest rod piece.
"""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import CaseError
from impactlab.exact.results.energies import energies_at
from impactlab.exact.results.history import ContinuousHistory
from impactlab.exact.results.link_results import followed, link_results, named
from impactlab.exact.setup.network import Log, NetworkLayout, without
from impactlab.history.arguments import END_ROUNDING, one_time, within_run
from impactlab.history.base import (
    AbstractHistory,
    BranchChange,
    ContactSpan,
    Cost,
    Event,
    Field,
    LinkResult,
    instants_around,
)
from impactlab.history.energy import EnergyBook
from impactlab.history.frame import carried_energy, touched_in
from impactlab.history.kept_fields import BodyFields, fields_of, joined, places_along
from impactlab.history.no_contact import never_closed
from impactlab.history.noise_floor import above_noise
from impactlab.metrics.linear_theory import overstrained
from impactlab.numerics.slopes import slopes
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Probe, Scene
from impactlab.types import Array

MAX_ENERGY_SAMPLES = 1000  # instants of energies, at most


@final
class ThinnedHistory(AbstractHistory):
    """An exact history at equal instants.

    Channels are lines between them, those of energies between fewer; forces have their means. Instants, events, contact
    periods and energies are exact; places without a probe are not kept, fields at snapshots only.
    """

    def __init__(
        self, run: Simulation, duration: float, time: Array, energy_time: Array, values: dict[str, Array]
    ) -> None:
        self.dt = None
        self.duration = duration
        self.scene, self.method = run
        self.time, self.energy_time = time, energy_time  # (n,) s each
        self.values = values  # channel -> (n,); of a force its time integral [N s]
        # Forces of hard contacts are piecewise nearly constant and stay as means; a spring force gets slopes.
        laws = self.method.laws
        self.stairs = {f"force:{name}" for name, law in laws.items() if law.hard}
        self.forces = {f"force:{name}" for name in (*laws, *named(self.scene))}
        self.pulling = self.forces - {f"force:{name}" for name, law in laws.items() if not law.two_sided}
        self.fields: dict[str, BodyFields] = {}
        self.cost = Cost()
        self.events = ()
        self.contacts = ()
        self.warnings = []

    def channels(self) -> tuple[str, ...]:
        return tuple(self.values)

    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        times = within_run(t, self.duration)
        if channel not in self.values:
            raise CaseError(
                f"'{channel}' is not a channel of this history: the run was too long to keep all of its waves",
                remedy=f"Name a probe there, or give a shorter duration. Channels: {', '.join(self.values)}.",
            )
        row = self.values[channel]
        if channel not in self.forces:
            return np.asarray(np.interp(times, self._times_of(channel), row))
        means = np.diff(row) / np.diff(self.time)
        cell = np.clip(np.searchsorted(self.time, times, side="right") - 1, 0, len(means) - 1)
        if channel in self.stairs:
            return np.asarray(means[cell])
        middles = 0.5 * (self.time[1:] + self.time[:-1])
        sloped = means[cell] + slopes(middles, means)[cell] * (times - middles[cell])
        return np.asarray(sloped if channel in self.pulling else np.maximum(0.0, sloped))

    def _times_of(self, channel: str) -> Array:
        return self.energy_time if is_energy(channel) else self.time

    def impulse_of(self, contact: str) -> float:
        channel = f"force:{contact}"
        return float(self.values[channel][-1]) if channel in self.pulling else super().impulse_of(contact)

    def recorded_around(self, channel: str, start: float, end: float) -> tuple[float, float]:
        return instants_around(self._times_of(channel), start, end)

    def impulse_until(self, contact: str, time: float) -> float:
        return float(np.interp(time, self.time, self.values[f"force:{contact}"]))

    def field_times(self, body: str) -> Array | None:
        return self.fields[body].times if body in self.fields else np.zeros(0)

    def field(self, body: str, t: float, quantity: str, x: ArrayLike | None = None) -> Field:
        kept, t = self.fields.get(str(body)), one_time(t, self.duration)
        slack = END_ROUNDING * self.duration
        found = None if kept is None else kept.field(self.scene.bodies[body], t, quantity, x, slack)
        if found is None:
            raise CaseError(
                f"the field '{quantity}' of '{body}' at {t:g} s is not kept: the run was too long to keep all of its "
                "waves",
                remedy="Name that instant in snapshots, or give a shorter duration.",
            )
        return found

    @property
    def record_rate(self) -> float:
        return 1.0 / float(self.time[1] - self.time[0])

    def jumps(self, channel: str) -> Array:
        return np.zeros(0)


def is_energy(channel: str) -> bool:
    """Return whether a channel is the energy of a body."""
    return channel.startswith("energy:")


def oldest(log: Log) -> float:
    """Return the time [s] from which on the march needs its waves."""
    return float(log.reached - log.ends["transit"].max() - 4.0 * log.state["tolerance"])


class Thinner:
    """Samples the windows of a march one after the other."""

    def __init__(self, run: Simulation, layout: NetworkLayout, log: Log) -> None:
        scene = run.scene
        self.run, self.scene, self.layout = run, scene, layout
        self.grid = np.linspace(0.0, scene.duration, scene.records + 1)
        self.every = max(1, scene.records // MAX_ENERGY_SAMPLES)
        self.begun, self.taken, self.rough_taken = 0.0, 0, 0
        # Numbers of the instants at which energies are kept: each is a quadrature over a rod.
        self.rough = np.unique([*range(0, scene.records, self.every), scene.records])
        self.places = {name: places_along(scene, body) for name, body in scene.elastic.items()}
        first = ContinuousHistory(run, layout, log, log.reached)
        for pieces in layout.links.values():
            for link in pieces:
                first.carried_before(link)
        self.values = {
            name: np.zeros(len(self.rough) if is_energy(name) else len(self.grid))
            for name in (*first.channels(), *_faces(scene))
        }
        self.impulses = {contact.name: 0.0 for contact in scene.contacts}
        self.events: list[Event] = []
        self.spans: list[ContactSpan] = []
        self.open: dict[str, ContactSpan] = {}
        self.books: list[EnergyBook] = []
        self.spent: dict[str, float] = {}
        self.fields: dict[str, list[BodyFields]] = {}
        self.changes: list[BranchChange] = []
        self.links: tuple[LinkResult, ...] = ()

    def take(self, log: Log) -> Log:
        """Sample every junction; return the log without the sampled part.

        Sampling ends at the time that all junctions have reached.
        """
        until = log.reached
        self._read(log, until)
        log = without(log, oldest(log), until)
        self.begun = until
        return log

    def finish(self, log: Log, duration: float) -> ThinnedHistory:
        """Read the rest and return the history up to ``duration`` [s]."""
        self._read(log, duration)
        kept, rough = self.taken, self.rough_taken
        values = {name: row[: rough if is_energy(name) else kept] for name, row in self.values.items()}
        history = ThinnedHistory(self.run, duration, self.grid[:kept], self.grid[self.rough[:rough]], values)
        rest = list(self.open.values())
        spans = tuple(sorted((*self.spans, *rest), key=lambda span: (span.start, span.contact)))
        history.events, history.contacts = above_noise(self.scene, self.run.method, tuple(self.events), spans)
        book = _joined(self.books)
        history.energy = replace(book, carried=carried_energy(self.scene, book.time, touched_in(history)))
        history.links, history.changes = self.links, tuple(self.changes)
        history.fields = {name: joined(windows) for name, windows in self.fields.items()}
        history.warnings += [*never_closed(history), *overstrained(history)]
        history.cost.steps = int(log.state["intervals"])
        return history

    def _read(self, log: Log, until: float) -> None:
        window = ContinuousHistory(self.run, self.layout, log, until)
        last = until >= self.scene.duration
        upto = len(self.grid) if last else int(np.searchsorted(self.grid, until))
        t, rough_upto = self.grid[self.taken : upto], int(np.searchsorted(self.rough, upto))
        rough = self.grid[self.rough[self.rough_taken : rough_upto]]
        forces = {f"force:{name}": own for name, own in named(self.scene).items()}
        forces |= {f"force:{contact.name}": [contact.name] for contact in self.scene.contacts}
        for name, row in self.values.items():
            if name in forces:
                row[self.taken : upto] = sum(self._impulse(window, own, t) for own in forces[name])
            elif is_energy(name):
                row[self.rough_taken : rough_upto] = window.evaluate(rough, name)
            else:
                row[self.taken : upto] = window.evaluate(t, name)
        self._contacts(window, until)
        for name in self.impulses:
            self.impulses[name] = float(self._impulse(window, name, np.array([until]))[0])
        self.changes += window.changes
        if window.joined:
            new = link_results(self.scene, self.run.method, window.signals, window.numbers, self.begun, until)
            self.links = followed(self.links, tuple(new))
        self._energies(window, t[-self.taken % self.every :: self.every], until, last)
        self._fields(window, np.array([t for t in self.scene.field_times if self.begun <= t and (t < until or last)]))
        self.taken, self.rough_taken = upto, rough_upto

    def _impulse(self, window: ContinuousHistory, name: str, t: Array) -> Array:
        force = window.force(name)
        return np.asarray(
            self.impulses[name] + force.integral(t, False) - force.integral(np.array([self.begun]), False)
        )

    def _fields(self, window: ContinuousHistory, times: Array) -> None:
        """Keep the fields of the window at these times [s]."""
        for name, body in self.scene.elastic.items():
            kept = fields_of(window, body, times, self.places[name])
            if kept is not None:
                self.fields.setdefault(name, []).append(kept)

    def _contacts(self, window: ContinuousHistory, until: float) -> None:
        """Add the window's events, impulses and peaks to every contact period."""
        dated = window.dated
        self.events += dated
        for name in self.impulses:
            for event in (event for event in dated if event.contact == name):
                if event.kind == "close":
                    self.open[name] = ContactSpan(name, event.time, None, 0.0, 0.0)
                elif name in self.open:
                    span = self._longer(window, self.open.pop(name), event.time)
                    self.spans.append(span._replace(end=event.time))
            if name in self.open:
                self.open[name] = self._longer(window, self.open[name], until)

    def _longer(self, window: ContinuousHistory, span: ContactSpan, until: float) -> ContactSpan:
        begin = max(span.start, self.begun)
        impulse = float(np.diff(window.force(span.contact).integral(np.array([begin, until]), False))[0])
        ((_, peak),) = window.impulses_and_peaks([(span.contact, begin, until)])
        return span._replace(impulse=span.impulse + impulse, peak_force=max(span.peak_force or 0.0, peak))

    def _energies(self, window: ContinuousHistory, t: Array, until: float, last: bool) -> None:
        times = np.unique([self.begun, *t, until])
        book = energies_at(self.scene, self.layout, window.signals, times)
        spent = self.spent
        work = book.work + spent.get("work", 0.0)
        booked = {name: row + spent.get(name, 0.0) for name, row in book.booked.items()}
        own = {name: row + spent.get(f"contact:{name}", 0.0) for name, row in (book.by_contact or {}).items()}
        self.spent = {"work": float(work[-1])} | {name: float(row[-1]) for name, row in booked.items()}
        self.spent |= {f"contact:{name}": float(row[-1]) for name, row in own.items()}
        end = len(times) if last else -1  # the last instant is the first of the next window
        bodies = {name: row[:end] for name, row in book.bodies.items()}
        booked = {name: row[:end] for name, row in booked.items()}
        own = {name: row[:end] for name, row in own.items()}
        self.books.append(EnergyBook(times[:end], bodies, book.stored[:end], booked, work[:end], None, own))


def _faces(scene: Scene) -> list[str]:
    """Return the channels of the faces in contact."""
    rods = [point for point in scene.faces if scene.bodies[point.body].elastic is not None]
    return [Probe(point.body, point.x, kind).channel for point in rods for kind in ("displacement", "velocity")]


def _joined(books: list[EnergyBook]) -> EnergyBook:
    """Return the books of windows that follow one another as one."""
    row = np.concatenate
    return EnergyBook(
        row([book.time for book in books]),
        {name: row([book.bodies[name] for book in books]) for name in books[0].bodies},
        row([book.stored for book in books]),
        {name: row([book.booked[name] for book in books]) for name in books[0].booked},
        row([book.work for book in books]),
        by_contact={name: row([(book.by_contact or {})[name] for book in books]) for name in books[0].by_contact or {}},
    )
