"""Checks of a finished run: energy, momentum, and warnings from its history."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from impactlab.errors import StepError
from impactlab.history.base import AbstractHistory, Warned
from impactlab.history.energy import MIN_ENERGY
from impactlab.history.frame import frames, in_frame, touched_in
from impactlab.history.no_contact import no_contact
from impactlab.mechanisms.model import MechanismModel
from impactlab.metrics.grazing import grazing_impulse, near_grazing
from impactlab.metrics.linear_theory import overstrained
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.plugins import kind_of
from impactlab.scene.facts import moving_faces, round_trips_of
from impactlab.scene.method import laws_of
from impactlab.scene.momentum import BodyMomentum, balance
from impactlab.scene.precision import LOST_DIGITS, all_finite
from impactlab.scene.problem import Contact
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.simulate.gain_bounds import bound_of, gain_of_forces
from impactlab.simulate.mesh_rounding import NOTHING, rounded
from impactlab.simulate.planning.preparation import FAULT_OF_LAW, law_raised
from impactlab.simulate.slides import REACH_FURTHER, out_of_reach
from impactlab.simulate.stepping import loop
from impactlab.simulate.stepping.results import readout
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.simulate.warnings import (
    approximate_modes,
    beams,
    ends,
    losses,
    mechanisms,
    probe_oscillations,
    probes,
    small_momenta,
    weights,
)
from impactlab.simulate.warnings.closing_times import unplaced
from impactlab.simulate.warnings.laws import closed_within_steps, noted_by_laws, own_laws
from impactlab.simulate.warnings.resolvability import lost_in_bonds, unresolved
from impactlab.types import Array

RETURNED_WARN = 1e-3  # of the reference energy, that dampers gave back: damped meshes were 1 % off with 0.005
GAIN_WARN = 0.02  # of the reference energy: a larger gain is reported, also where the parts declare more
DROPPED_WARN = 0.02  # of the reference energy: a larger share shows in velocities, by about half of it
STIFFER_LINK = "Give a stiffer or shorter link, or several that are clamped to each other."
SMALLER_STEP = "Give a smaller step, an implicit integrator such as midpoint, or another law."
RETURNED = (
    "dampers returned {share:.2g} % of the reference energy: the step is long beside the "
    "decay time of damped modes, and the scheme overshoots their velocities"
)
MAX_GAIN = 1.0  # of the reference energy: a run that more than doubles it is failed, even if its parts declare more
MAX_LOSS = 3.0  # of the reference energy: bodies have at most twice that, from the start and by work of loads
ROUNDING_TOL = 1e-9  # of the energy of all bodies: the rounding of thousands of steps
OVERLAP_WARN = 0.1  # of the travel of the faces, under a law without overlap
OVERLAP_TOL = 1e-13  # of the reference energy, that the mean force does over an overlap: less is rounding
NEGATIVE_LOSS_TOL = 1e-6  # of the reference energy: losses below zero that no rounding leaves
MOMENTUM_TOL = 1e-9  # of the reference momentum: schemes and solvers keep linear sums to rounding
KICKS_WARN = 100  # of an impulse law, from which their number means nothing

Failure = Callable[..., StepError]  # of a text and a remedy; time, step and history are set


def add_warnings(history: AbstractHistory) -> None:
    """Add the warnings of a finished run in coordinates; an exact one has its own."""
    if not isinstance(history, AbstractRecordedHistory):
        return
    scene, laws = history.scene, history.method.laws
    found = [*unresolved(history), *unplaced(history), *beams.warnings(history), *overlapping(history)]
    for span in history.contacts:
        if span.kicks is not None and span.kicks > KICKS_WARN:
            text = (
                f"{span.contact}: {span.kicks} kicks; their number depends on the step, so use the total "
                "impulse, not the first one"
            )
            found.append(Warned("chatter", text, span.contact))
    found += [*noted_by_laws(history), *closed_within_steps(history)]
    found += [*mechanisms.warnings(history), *probes.after(history), *ends.reflecting(scene)]
    found += approximate_modes.warnings(history)
    found += weights.warnings(history)
    meeting = [contact for contact in scene.contacts if not laws[contact.name].two_sided]
    found += never_closed(history, meeting)
    gain = gain_of(history)
    if beyond(history, gain, GAIN_WARN):
        found.append(Warned("energy_gain", f"energy grew by {100 * gain:.2g} % of the reference energy"))
    if beyond(history, returned := returned_by_dampers(history), RETURNED_WARN):
        found.append(Warned("energy_gain", RETURNED.format(share=100 * returned)))
    found += losses.warnings(history, reference_energy(history), partial(beyond, history))
    found += lost_in_bonds(history, reference_energy(history))
    found += small_momenta.warnings(history, {each.contact for each in found if each.code == "soft_contact"})
    found += probe_oscillations.warnings(history, {each.code for each in (*found, *history.warnings)})
    exaggerated = {each.contact for each in found if each.code == "first_force"}
    found += [*dropped_in_maps(history), *overstrained(history, exaggerated)]
    for name, trip in round_trips_of(scene, meeting).items():
        graze = near_grazing if laws[name].answers_force else grazing_impulse
        if (text_or_none := graze(history, name, trip, history.dt or 0.0)) is not None:
            found.append(Warned("near_grazing", text_or_none, name))
    history.warnings.extend(found)


def dropped_in_maps(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Yield a warning where changes of coordinates by contacts dropped a large energy share."""
    energy, changes = history.dropped
    share = energy / reference_energy(history)
    if share > DROPPED_WARN:
        names = ", ".join(f"'{name}'" for name, each in history.built.items() if each.system.phases is not None)
        yield Warned(
            "coordinates_change",
            f"{names}: {changes} changes of coordinates, as the contact closed and opened, lost "
            f"{100 * share:.2g} % of the reference energy, which the motion then lacks",
        )


def never_closed(history: AbstractRecordedHistory, contacts: Sequence[Contact]) -> Iterator[Warned]:
    """Yield a warning for each contact without an event."""
    touched = {event.contact for event in history.events}
    if all(contact.name in touched for contact in contacts):
        return
    gaps = {contact.name: history.recorded[f"gap:{contact.name}"].values for contact in contacts}
    travel = max(map(extent, gaps.values()), default=0.0)
    for contact in contacts:
        if contact.name not in touched:
            yield no_contact(contact.name, contact.gap, gaps[contact.name], travel)


def extent(values: Array) -> float:
    """Return the difference of the largest and the smallest value.

    There must be a value; `np.ptp` takes twice as long.
    """
    return float(np.maximum.reduce(values) - np.minimum.reduce(values))


def overlapping(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Yield a warning for each hard contact with a large overlap of its faces.

    Faces that meet only in the part of the last step beyond the end of the run have not touched.
    """
    touched = touched_in(history)
    scene, channels, found = history.scene, history.recorded, frames(history.scene, touched)

    def travel_of(name: str) -> float:
        return extent(in_frame(found, name, channels[name].times, channels[name].values))

    for contact in scene.contacts:
        if not history.method.laws[contact.name].hard or contact.name not in touched:
            continue
        deepest = min(0.0, contact.gap) - float(channels[f"gap:{contact.name}"].values.min())
        names = [*moving_faces(scene, contact.left, contact.right)]
        if all(deepest > OVERLAP_WARN * travel_of(name) for name in names):  # as a rule the first travels far enough
            if deepest * history.impulse_of(contact.name) <= OVERLAP_TOL * reference_energy(history) * history.duration:
                continue
            share = deepest / max(travel_of(name) for name in names)
            text = f"{contact.name}: the faces overlap by {deepest:.3g} m, {share:.2g} of their travel"
            yield Warned("overlap", text, contact.name)


def check_run(status: int, assembly: Assembly, history: AbstractRecordedHistory) -> None:
    """Raise `StepError` where a stepped run ended early, or broke a balance."""
    clock, laws = assembly.clock, laws_of(assembly.scene, assembly.acting)
    failure: Failure = partial(StepError, time=clock.time, step=clock.step, history=history)
    if status == loop.LAW_FAILED:
        of_laws = zip(assembly.layout.solved, (law.raised for law in assembly.laws), strict=True)
        number, raised = next((each for each in of_laws if each[1] is not None), (0, None))
        failed = [
            f"{assembly.scene.contacts[number].name}: {laws[number].why_failed}" for number in readout.failed(assembly)
        ]
        text = "; ".join(failed) or "the forces of several coupled contacts did not converge"
        remedy, path = SMALLER_STEP, ""
        if raised is not None:
            text, remedy = law_raised(laws[number], assembly.scene.contacts[number].name, raised), FAULT_OF_LAW
            path = f"contacts.{number}.law"
        raise failure(text, remedy=remedy, path=path) from raised
    if (stuck := out_of_reach(history)) is not None:
        step = round(clock.step * stuck.time / clock.time)  # the steps after it are not numbers
        raise failure(stuck.text, remedy=REACH_FURTHER, time=stuck.time, step=step)
    if status == loop.NOT_FINITE:
        text = "the energy is not a finite number: the run diverged"
        own = own_laws(laws)
        advice = f" Or law {own} returns NaN, which `impactlab plugins --check` finds." if own else ""
        raise failure(text, remedy=stiffer_link(history) or f"Give a smaller step, or a softer contact.{advice}")
    if not _finite(assembly.memory.record[: clock.n_records]):
        raise failure("a displacement or force is not a finite number", remedy=LOST_DIGITS)
    for number, record in zip(assembly.layout.solved, assembly.contacts, strict=True):
        contact, law = assembly.scene.contacts[number], laws[number]
        if law.shares_losses:
            continue
        if -record.negative > NEGATIVE_LOSS_TOL * reference_energy(history):  # its book would take it for balanced
            raise failure(
                f"{contact.name}: law '{kind_of(law)}' returned losses of {record.negative:.6g} J, below zero",
                remedy="This is a fault of the law: its 'dissipated' and 'unresolved' may not be negative.",
            )
    if clock.step == assembly.steps and clock.n_samples > 1:
        check_momentum(history, readout.impulses(assembly), readout.load_impulses(assembly), clock.time, failure)
    bound = bound_of(assembly, history)
    if beyond(history, gain_of(history), bound):
        bound += gain_of_forces(assembly, history) / reference_energy(history)
    check_gain(history, bound, lambda: gain_remedy(assembly, history), failure)
    if beyond(history, returned := returned_by_dampers(history), MAX_GAIN):
        raise failure(
            RETURNED.format(share=100 * returned), remedy="Give a smaller step, or integrator midpoint or moreau_jean."
        )
    loss = history.energy.largest_loss * history.energy.scale / reference_energy(history)
    if beyond(history, loss, MAX_LOSS):  # as where a law stores a negative energy
        text = f"energy fell by {loss:.3g} of the reference energy, more than there was"
        raise failure(text, remedy=gain_remedy(assembly, history))


def gain_remedy(assembly: Assembly, history: AbstractRecordedHistory) -> str:
    """Return the remedy of a run that gained more energy than its parts declare."""
    cut = assembly.method.events == "dated" and assembly.integrator.any_dt
    laws = laws_of(assembly.scene, assembly.acting)
    of_laws = " ".join(dict.fromkeys(law.gain_remedy for law in laws if law.gain_remedy))
    if of_laws and cut and any(isinstance(body.model, MechanismModel) for body in assembly.layout.built.values()):
        of_laws = "Give events: located, or a law with a stiffness, such as hertz."  # it takes no other scheme or mesh
    softer = f", or a softer contact{', or events: located' if cut else ''}" if history.contacts else ""
    remedy = of_laws or f"Give a smaller step{softer}."
    if own := own_laws(laws):
        remedy += (
            f" Law {own} must report the energy that it stores as `stored`, and declare the energy "
            "that it may gain as `gains_energy`."
        )
    return pushed_out(history) or stiffer_link(history) or remedy


def stiffer_link(history: AbstractRecordedHistory) -> str | None:
    """Return the remedy for the first link that bends too far, or None."""
    return next((f"{bent}. {STIFFER_LINK}" for bent in mechanisms.too_bent(history)), None)


def pushed_out(history: AbstractRecordedHistory) -> str | None:
    """Return the remedy for the first initial overlap that a law closes.

    It is one under a law that holds positions; None where there is none. Such a law closes the gap within a step: the
    speed that it gives is the overlap over the step.
    """
    for contact in history.scene.contacts:
        gap = history.recorded[f"gap:{contact.name}"].values[0] if contact.overlap_allowed else 0.0
        if gap < 0.0 and history.method.laws[contact.name].holds_position:
            return (
                f"{contact.name} overlaps by {-gap:.3g} m at t = 0, and its law moves the faces apart "
                "within one step: the shorter the step, the faster. Give a gap of 0 or more, a spring "
                "(penalty), or velocity_complementarity, which does not remove the overlap."
            )
    return None


def _finite(values: Array) -> bool:
    """Return whether all values of a run are finite; those of one that diverged may be too large for a sum."""
    with np.errstate(over="ignore"):
        return all_finite(values)


def check_gain(history: AbstractHistory, bound: float, remedy: Callable[[], str], failure: Failure) -> None:
    """Raise `StepError` where energy grew beyond its bound, or its balance is not finite.

    A run that more than doubles the energy of its bodies is not a motion of theirs, even if its parts declare more.
    ``remedy`` is called where it did.
    """
    if not _finite(history.energy.balance):
        text = "the balance of energy is not a finite number: a law returned an energy that is not a finite number"
        raise failure(text, remedy=LOST_DIGITS)
    gain = gain_of(history)
    if beyond(history, gain, min(bound, MAX_GAIN)):
        over = beyond(history, gain, bound)
        declared = f"these parts declare at most {bound:.3g}" if over else "no run may more than double it"
        raise failure(f"energy grew by {gain:.3g} of the reference energy, and {declared}", remedy=remedy())


def beyond(history: AbstractHistory, share: float, allowed: float) -> bool:
    """Return whether a share of the reference energy exceeds limit and rounding.

    Rounding is that of the energies of all bodies, and of meshes that are displaced as a whole.
    """
    if share <= allowed:
        return False
    of_meshes = rounded(history, history.duration).values() if isinstance(history, AbstractRecordedHistory) else ()
    rounding = ROUNDING_TOL * history.energy.rounding
    return share > allowed + rounding + sum(each.energy for each in of_meshes) / reference_energy(history)


def gain_of(history: AbstractHistory) -> float:
    """Return the energy that a run gained, over its reference energy."""
    return history.energy.largest_gain * history.energy.scale / reference_energy(history)


def returned_by_dampers(history: AbstractHistory) -> float:
    """Return the largest fall of the losses booked in dampers, over the reference energy.

    A scheme that overshoots the velocities of damped modes takes energy from the formula of its dampers: their balance
    then holds, and the motion does not.
    """
    returned = history.energy.returned
    return returned / reference_energy(history) if returned > 0.0 else 0.0


def reference_energy(history: AbstractHistory) -> float:
    """Return the reference energy [J]: initial energy or work of loads, else the largest.

    Energy that a diverging run adds does not count. Of free bodies it is the energy in the frame of their centre of
    mass.
    """
    book = history.energy
    found = book.at_stake or float(np.abs(book.total).max())
    return found if found > MIN_ENERGY else 1.0


def check_momentum(
    history: AbstractRecordedHistory,
    impulses: Sequence[float],
    loads: Mapping[str, float],
    time: float,
    failure: Failure,
) -> None:
    """Raise `StepError` where the momentum of a free body does not match its impulses."""
    for name, body in history.scene.bodies.items():
        model = history.built[name].model
        if not body.is_free or (isinstance(model, AbstractSelfStepping) and not model.books_momentum):
            continue
        momentum = history.recorded[f"momentum:{name}"].values
        ends = float(momentum[0]), float(momentum[-1])
        found = balance(history.scene, name, impulses, time, BodyMomentum(*ends, 0.0, 0.0), loads.get(name))
        if found.scale > 0.0 and found.error <= MOMENTUM_TOL:  # of the impulses alone, as in most runs
            continue
        largest = (float(np.abs(each).max()) for each in (momentum, history.recorded[f"energy:{name}"].values))
        found = balance(history.scene, name, impulses, time, BodyMomentum(*ends, *largest), loads.get(name))
        error = abs(found.changed - found.given)
        if found.error > MOMENTUM_TOL and error > rounded(history, time).get(name, NOTHING).momentum:
            text = (
                f"the impulses on '{name}' add up to {found.given:.9g} N s, and its momentum changed by "
                f"{found.changed:.9g} N s"
            )
            raise failure(text, remedy=LOST_DIGITS)
