"""A sampled history, as in the file of a run: channels at instants of a page, fields at its frames."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import ImpactlabError, closest
from impactlab.history.arguments import END_ROUNDING, check_one, one_time, within_run
from impactlab.history.base import (
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
from impactlab.history.kept_fields import BodyFields, body_fields
from impactlab.history.sampling import page_times
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Probe
from impactlab.types import Array


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

    saved_summary: dict[str, Any] | None = None  # that the file of the run has

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

    def summary(self, reference: bool = False) -> dict[str, Any]:
        """Return the summary that was saved with the run: the errors between its samples are not those of the run."""
        if self.saved_summary is None or (reference and self.saved_summary["errors"] is None):
            raise ImpactlabError(
                "the file of this run has no errors, which need all its steps",
                remedy="Run its case again: il.run(history.case).summary(reference=True).",
            )
        return self.saved_summary

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
        slack = END_ROUNDING * self.duration
        found = None if kept is None else kept.field(self.scene.bodies[body], time, quantity, x, slack)
        if found is None:
            known = "" if kept is None else f"; kept are {', '.join(kept.values)} at {kept.times.size} instants"
            raise ImpactlabError(
                f"the {quantity} along '{body}' at {time:.6g} s was not kept{known}",
                remedy="Ask for fields in the case, as snapshots: {count: 200}.",
                path="snapshots",
            )
        return found

    def impulse_of(self, contact: str) -> float:
        return self.link_impulses[contact] if contact in self.link_impulses else super().impulse_of(contact)

    def recorded_around(self, channel: str, start: float, end: float) -> tuple[float, float]:
        if self.dt is not None and channel.partition(":")[0] in ("energy", "momentum"):  # lines between fewer instants
            start, end = instants_around(self.energy.time, start, end)
        return instants_around(self.time, start, end)

    def energy_ends(self) -> EnergyEnds:
        return super().energy_ends() if self._energy_ends is None else self._energy_ends

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
