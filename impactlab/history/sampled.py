"""A sampled history, as in the file of a run: channels at instants of a page, fields at its frames."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import ImpactlabError, closest
from impactlab.history.arguments import END_ROUNDING, check_one, one_time, places_on, within_run
from impactlab.history.base import (
    FIELD_POINTS,
    AbstractHistory,
    BranchChange,
    ContactSpan,
    Cost,
    Event,
    Field,
    HasCase,
    LinkResult,
    Warned,
    instants_around,
)
from impactlab.history.energy import EnergyBook, EnergyEnds
from impactlab.history.instruments import Measured, measure, measured_signals, probe_of
from impactlab.history.sampling import frame_times, page_times, places_in_file
from impactlab.scene.bodies import ElasticBody
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Probe
from impactlab.types import Array

KEPT = ("displacement", "velocity", "strain", "stress", "force", "bending_moment")  # as far as a body has them


class BodyFields(NamedTuple):
    """The fields of one body at some instants."""

    times: Array  # (n,) s
    x: Array  # (m,) m
    values: dict[str, Array]  # quantity -> (n, m)


class Facts(NamedTuple):
    """Everything of a history except its channels and fields."""

    duration: float  # s
    dt: float | None  # s
    events: tuple[Event, ...]
    contacts: tuple[ContactSpan, ...]
    energy: EnergyBook
    warnings: list[Warned]
    cost: Cost
    integrator_used: bool
    case: HasCase | None
    listed: tuple[str, ...]  # its channels; others may have values beside them
    measured: dict[int, Measured]  # signals of instruments, by number of the probe
    links: tuple[LinkResult, ...]
    changes: tuple[BranchChange, ...]
    link_impulses: Mapping[str, float]  # N s, by name of the contact
    load_impulses: Mapping[str, float]  # N s, of loads over time, by body
    ends: EnergyEnds | None  # of the energies; None: those of the book


@final
class SampledHistory(AbstractHistory):
    """A history at equal instants, linear between them, with the run's events and energies.

    Fields exist at the instants that were kept (`field_times`).
    """

    def __init__(
        self, run: Simulation, facts: Facts, time: Array, values: Mapping[str, Array], fields: Mapping[str, BodyFields]
    ) -> None:
        self.scene, self.method = run
        self.duration, self.dt, self.integrator_used = facts.duration, facts.dt, facts.integrator_used
        self.events, self.contacts = facts.events, facts.contacts
        self.links, self.changes = facts.links, facts.changes
        self.energy, self._energy_ends = facts.energy, facts.ends
        self.warnings, self.cost, self.case = facts.warnings, facts.cost, facts.case
        self.listed, self.signals = facts.listed, facts.measured
        self.link_impulses, self.load_impulses = facts.link_impulses, facts.load_impulses
        self.time, self.values, self.fields = time, dict(values), dict(fields)

    @classmethod
    def of(cls, history: AbstractHistory) -> SampledHistory:
        """Return a history sampled at the instants of a page."""
        time = page_times(history.duration)
        names = channels_of(history)
        values = dict(zip(names, history.evaluate_each(time, names), strict=True))
        return cls(Simulation(history.scene, history.method), facts_of(history), time, values, body_fields(history))

    def channels(self) -> tuple[str, ...]:
        return self.listed

    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        times = within_run(t, self.duration)
        if str(channel) not in self.values:
            check_one(channel)
            raise ImpactlabError(
                f"channel '{channel}' was not kept.{closest(channel, self.values)} Kept: {', '.join(self.values)}",
                remedy="A quantity at another place needs a probe in the case.",
            )
        return np.asarray(np.interp(times, self.time, self.values[channel]))

    def measured(self, probe: Probe | str | int) -> Measured:
        wanted = probe_of(self.scene, probe)
        kept = [signal for number, signal in self.signals.items() if self.scene.probes[number] == wanted]
        return kept[0] if kept else measure(self, wanted)

    def field_times(self, body: str) -> Array | None:
        return self.fields[body].times if body in self.fields else np.zeros(0)

    def field(self, body: str, t: float, quantity: str, x: ArrayLike | None = None) -> Field:
        kept, time = self.fields.get(str(body)), one_time(t, self.duration)
        near = np.zeros(0, int) if kept is None else np.flatnonzero(np.abs(kept.times - time) <= self._slack)
        values = None if kept is None or near.size == 0 else self._read(kept, body, quantity, int(near[0]))
        if kept is None or values is None:
            known = "" if kept is None else f"; kept are {', '.join(kept.values)} at {kept.times.size} instants"
            raise ImpactlabError(
                f"the {quantity} along '{body}' at {time:.6g} s was not kept{known}",
                remedy="Ask for fields in the case, as snapshots: {count: 200}.",
                path="snapshots",
            )
        if x is None:
            return Field(kept.x, values)
        places = places_on(self.scene.bodies[body], x)
        return Field(places, np.interp(places, kept.x, values))

    def impulse_of(self, contact: str) -> float:
        return self.link_impulses[contact] if contact in self.link_impulses else super().impulse_of(contact)

    def recorded_around(self, channel: str, start: float, end: float) -> tuple[float, float]:
        if self.dt is not None and channel.partition(":")[0] in ("energy", "momentum"):  # lines between fewer instants
            start, end = instants_around(self.energy.time, start, end)
        return instants_around(self.time, start, end)

    def energy_ends(self) -> EnergyEnds:
        return super().energy_ends() if self._energy_ends is None else self._energy_ends

    @property
    def _slack(self) -> float:
        return END_ROUNDING * self.duration

    def _read(self, kept: BodyFields, body: str, quantity: str, number: int) -> Array | None:
        """Return a quantity of the kept fields, or None.

        Strain and force of rods may follow from the stress, stress and strain of beams from the bending moment.
        """
        if quantity in kept.values:
            return np.asarray(kept.values[quantity][number])
        elastic = self.scene.bodies[body].elastic
        read, times = self.scene.bodies[body].quantities.get(quantity, ("", 1.0))
        if read != quantity and read in kept.values:
            return np.asarray(times * kept.values[read][number])
        if elastic is None or quantity not in ("strain", "force") or "stress" not in kept.values:
            return None
        pieces = [elastic.segment_at(float(x)) for x in kept.x]
        factor = [1.0 / piece.young if quantity == "strain" else piece.area for piece in pieces]
        return np.asarray(kept.values["stress"][number] * np.array(factor))

    @property
    def record_rate(self) -> float:
        return (len(self.time) - 1) / self.duration

    def jumps(self, channel: str) -> Array:
        return np.zeros(0)


def facts_of(history: AbstractHistory) -> Facts:
    """Return everything of a history except its channels and fields."""
    return Facts(
        duration=history.duration,
        dt=history.dt,
        events=tuple(history.events),
        contacts=tuple(history.contacts),
        energy=history.energy,
        warnings=list(history.warnings),
        cost=history.cost,
        integrator_used=history.integrator_used,
        case=history.case,
        listed=history.channels(),
        measured=measured_signals(history),
        links=tuple(history.links),
        changes=tuple(history.changes),
        link_impulses={name: history.impulse_of(name) for name in history.method.links},
        load_impulses=dict(history.load_impulses),
        ends=history.energy_ends(),
    )


def channels_of(history: AbstractHistory) -> list[str]:
    """Return the channels of a history, with the motion of faces in contact."""
    names = list(history.values if isinstance(history, SampledHistory) else history.channels())
    scene = history.scene
    for body, x in dict.fromkeys((p.body, p.x) for p in scene.faces if scene.bodies[p.body].elastic is not None):
        for quantity in ("displacement", "velocity"):
            name = f"{quantity}:{body}@{x:.6g}"
            with suppress(ImpactlabError):
                history.evaluate(0.0, name)
                names.append(name)
    return list(dict.fromkeys(names))


def body_fields(history: AbstractHistory) -> dict[str, BodyFields]:
    """Return the fields of each body at the frames of a page and at snapshots.

    Of many continuous rods they have fewer places (`places_in_file`).
    """
    fields, elastic = {}, history.scene.elastic
    count = places_in_file(sum(len(kept_quantities(body)) for body in elastic.values()), FIELD_POINTS)
    for name, body in elastic.items():
        times, places = history.field_times(name), None
        if times is None:
            times = np.union1d(
                frame_times(history.duration), [t for t in history.scene.snapshots if t <= history.duration]
            )
            places = np.linspace(0.0, body.length, count) if count < FIELD_POINTS else None
        kept = _fields_of(history, body, times, places)
        if kept is not None:
            fields[name] = kept
    return fields


def _fields_of(history: AbstractHistory, body: ElasticBody, times: Array, places: Array | None) -> BodyFields | None:
    values = {}
    x = np.zeros(0)
    for quantity in kept_quantities(body) if times.size else ():
        try:
            x, values[quantity] = history.fields_at(body.name, times, quantity, places)
        except ImpactlabError:  # a body with a quantity at its contacts and probes only
            continue
    return BodyFields(times, x, values) if values else None


def kept_quantities(body: ElasticBody) -> list[str]:
    """Return the quantities of a body that are kept.

    Stress gives force, and strain in a body that is not viscous.
    """
    names = {read: name for name, (read, _) in reversed(list(body.quantities.items()))}
    viscous = body.damping.stiffness > 0.0 or any(piece.viscosity for piece in body.segments)
    followed = {"force": "stress" in names, "strain": not viscous}
    return [names[read] for read in KEPT if read in names and not followed.get(read, False)]
