"""The summary of a run, as ``--json`` prints it.

The keys are a contract with the scripts of users: keys may be added, never removed. Numbers are finite or null.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from impactlab.contact.base import AbstractContactLaw
from impactlab.exact.results.history import ContinuousHistory
from impactlab.history.base import AbstractHistory, ContactSpan, Event, LinkResult
from impactlab.history.extremes import extremes
from impactlab.mechanisms.part_mechanism import PartMechanism
from impactlab.metrics import norms as metrics
from impactlab.metrics.collisions import collisions
from impactlab.plugins import kind_of
from impactlab.printing import plain
from impactlab.refine.references import outlook as outlooks
from impactlab.refine.references.outlook import Outlook
from impactlab.refine.references.reference_record import Reference
from impactlab.refine.references.stated_error import measured_error, set_measured_error
from impactlab.scene.bodies import Body, Mechanism, WaveBody
from impactlab.scene.facts import steady_facts
from impactlab.scene.method import laws_of, models_of
from impactlab.scene.problem import Scene
from impactlab.startup.wall_time import REFERENCE, spent_on
from impactlab.types import Relative

SCHEMA_VERSION = 1
COMPLETED, TOLERANCE_NOT_MET = "completed", "tolerance_not_met"  # statuses of runs that came to their end
UNKNOWN_TOL = 0.02  # uncertainty of a metric of the reference, in its own unit, beyond which no error is reported
KNOWN_BY = {
    "peak_force": ("peak_force",),
    "force": ("force",),
    "force_away_from_jumps": ("force_away_from_jumps", "force_graph", "force_oscillation"),
    "event_times": ("event_times", "events_missed", "events_extra", "opening_time"),
}
"""Uncertainties of the reference that bound each error."""
STEPPED = "stepped waves"  # of continuous beams, and of runs that were saved without words for it
NOISE = 1e-12  # of the energy at stake: rounding of a loss
BOOKED = ("contact", "unresolved")  # always named in the energy block, also where nothing was booked


def describe(part: Any) -> dict[str, Any]:
    """Return a part, a frozen dataclass, as its kind and options, ready for JSON."""
    options = {field.name: getattr(part, field.name) for field in dataclasses.fields(part)}
    return {"kind": kind_of(part)} | {name: _option(value) for name, value in options.items()}


def _option(value: Any) -> Any:
    """Return the value of an option as a case file writes it."""
    if isinstance(value, Relative):
        return {"relative": value.relative}
    if dataclasses.is_dataclass(value):
        return describe(value)
    return value


def summarise(
    case_name: str,
    history: AbstractHistory,
    reference: Reference | tuple[str, AbstractHistory] | None = None,
    outlook: Outlook | None = None,
) -> dict[str, Any]:
    """Return the summary of a run, ready for JSON.

    Parameters
    ----------
    case_name : str
        Name of the case, without folder and ending.
    history : AbstractHistory
        Result of the run.
    reference : Reference, or (str, AbstractHistory), optional
        The reference, with its uncertainty, or its name and history; without one ``errors`` is null.
    outlook : Outlook, optional
        Why there is no reference, if there is none; by default that none exists for the scene.
    """
    scene, tolerance, found = history.scene, history.method.tolerance, None
    against = None if reference is None else Reference(*reference)
    if against is not None:
        with spent_on(REFERENCE):
            found = errors(history, against)
        if tolerance is not None:
            set_measured_error(history, measured_error(found, against, tolerance.on))
    summary = {
        "schema_version": SCHEMA_VERSION,
        "case": case_name,
        "status": status_of(history),
        "round_trip": scene.round_trip,
        "method": method(history),
        "events": [_event(event) for event in history.events],
        "contacts": [_contact(span) for span in history.contacts],
        "links": [_link(each, NOISE * history.energy.scale) for each in history.links],
        "collisions": [dict(vars(each)) for each in collisions(history)],
        "final": final(history),
        "energy": energy(history),
        "rotation": rotation(scene),
        "probes": {probe.channel: _ranges(history, probe.channel) for probe in scene.probes},
        "errors": found,
        "reference": (outlook or outlooks.of(against)).document,
        "cost": dataclasses.asdict(history.cost),
        "choice": None if history.choice is None else history.choice.document(method(history)),
        "warnings": [{"code": warned.code, "text": warned.text} for warned in history.warnings],
    }
    return {key: plain(value) for key, value in summary.items()}


def _link(link: LinkResult, noise: float) -> dict[str, Any]:
    """Return a link as a document; a loss [J] that is rounding of the energy is 0."""
    return link._replace(loss=link.loss if abs(link.loss) > noise else 0.0)._asdict()


def status_of(history: AbstractHistory) -> str:
    """Return the status of a run that came to its end: ``completed`` or ``tolerance_not_met``."""
    return COMPLETED if history.choice is None or history.choice.met else TOLERANCE_NOT_MET


def has_numbers(status: str | None) -> bool:
    """Return whether a run of a status came to its end and has numbers."""
    return status in (COMPLETED, TOLERANCE_NOT_MET)


def errors(history: AbstractHistory, reference: Reference) -> dict[str, Any]:
    """Return the errors against a reference, and the uncertainty of that reference.

    A metric whose uncertainty in the reference is above `UNKNOWN_TOL` is None: the force of a converged reference
    may ring where its displacements have long converged.
    """
    same = _is_same(history, reference.history)
    found = metrics.errors(history, reference.name, history if same else reference.history, history.scene)
    for name, of_metrics in KNOWN_BY.items():
        if reference.uncertainties.get(name, 0.0) > UNKNOWN_TOL:
            found |= dict.fromkeys(of_metrics)
    return found | {"reference_uncertainty": reference.uncertainty}


def _is_same(history: AbstractHistory, reference: AbstractHistory) -> bool:
    """Return whether an exact run is its own reference: all of its waves, events and energies are the same bits."""
    return (
        history.dt is None
        and type(history) is type(reference) is ContinuousHistory
        and (history.events, history.contacts) == (reference.events, reference.contacts)
        and history.cost.steps == reference.cost.steps
        and np.array_equal(history.energy.total, reference.energy.total)
        and all(map(np.array_equal, history.energy.bodies.values(), reference.energy.bodies.values()))
    )


def method(history: AbstractHistory) -> dict[str, Any]:
    """Return the models, laws, integrator and step [s] of a history.

    None stands for an integrator or a step that it does not use. ``stepping`` states how a run with a step and without
    an integrator is stepped: by its models.
    """
    used = history.method if history.choice is None else history.choice.method
    found: dict[str, Any] = {
        "models": {name: describe(model) for name, model in models_of(history.scene, used).items()},
        "laws": [_law(law) for law in laws_of(history.scene, used)],
        "integrator": describe(used.integrator) if used.integrator and history.integrator_used else None,
        "dt": history.dt,
    }
    if found["integrator"] is None and history.dt is not None:
        lines = all(isinstance(body, WaveBody) for body in history.scene.elastic.values())
        found["stepping"] = "stepped delay line" if lines else STEPPED
    return found


def _law(law: AbstractContactLaw) -> dict[str, Any]:
    restitutions = law.restitutions()
    return describe(law) | ({} if restitutions is None else {"restitution": restitutions._asdict()})


def _event(event: Event) -> dict[str, Any]:
    entry = {"time": event.time, "contact": event.contact, "kind": event.kind}
    return entry | {"impulse": event.impulse} if event.kind == "impulse" else entry


def _contact(span: ContactSpan) -> dict[str, Any]:
    entry = span._asdict()
    return entry if span.kicks is not None else {k: v for k, v in entry.items() if k not in ("first_impulse", "kicks")}


def final(history: AbstractHistory) -> dict[str, Any]:
    """Return the state of the bodies at the end.

    It is position [m] and velocity of rigid bodies, momentum, and energy [J].
    """
    moving = {name: body for name, body in history.scene.bodies.items() if body.moves}
    keys = {name: ("momentum", "energy") if body.elastic else ("position", "velocity") for name, body in moving.items()}
    single = [name for name, body in moving.items() if not body.changes]
    read = [f"{key}:{name}" for name in single for key in keys[name]]  # at once: a chain has thousands
    values = history.evaluate_each(np.array([history.duration]), read).reshape(-1, 2).tolist()
    ends = {name: dict(zip(keys[name], pair, strict=True)) for name, pair in zip(single, values, strict=True)}
    bodies = {name: ends.get(name) or _mechanism_at_end(history, body) for name, body in moving.items()}
    return {"time": history.duration, "bodies": bodies}


def _mechanism_at_end(history: AbstractHistory, body: Body) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if isinstance(body, Mechanism):
        for key, quantity in (("angles", "angle"), ("rates", "rate")):
            found[key] = {link.name: history.at_end(f"{quantity}:{link.name}") for link in body.links}
    elif isinstance(body, PartMechanism):
        found = {channel: history.at_end(channel) for channel, _, _ in body.recorded}
    return found | {"energy": history.at_end(f"energy:{body.name}")}


def energy(history: AbstractHistory) -> dict[str, Any]:
    """Return the energies of a run at both ends [J].

    They are those of bodies and contacts, the work of loads, the balance, and the losses booked.
    """
    book, ends = history.energy, history.energy_ends()
    return {
        "initial": ends.initial,
        "final": ends.final,
        "work": ends.work,
        "largest_gain": book.largest_gain,
        "largest_loss": book.largest_loss,
        "final_error": book.final_error,
        "booked": dict.fromkeys(BOOKED, 0.0) | ends.booked,
        "booked_by_contact": ends.by_contact,
    }


def rotation(scene: Scene) -> dict[str, Any]:
    """Return the steady state of each body that turns; else empty.

    It states whether the momentum of a body is not checked for that reason.
    """
    free = {name: not body.is_held and body.softening > 0.0 for name, body in scene.bodies.items()}
    return {name: {**facts, "momentum_unchecked": free[name]} for name, facts in steady_facts(scene).items()}


def _ranges(history: AbstractHistory, channel: str) -> dict[str, float]:
    """Return the least, largest and last value of a channel in its SI unit."""
    least, largest = extremes(history, channel)
    return {"min": least, "max": largest, "final": history.at_end(channel)}
