"""What a finished run is checked for: its energy, its momentum, and the warnings that only it can tell."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from impactlab.errors import StepError
from impactlab.history.base import AbstractHistory, Warned
from impactlab.metrics.grazing import grazing_kick, near_grazing
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.plugins import kind_of
from impactlab.scene.facts import moving_faces
from impactlab.scene.frame import drift, touched_in
from impactlab.scene.method import laws_of
from impactlab.scene.momentum import Seen, balance
from impactlab.scene.precision import LOST_DIGITS
from impactlab.simulate import beam_warnings
from impactlab.simulate.pairing import energy_bound
from impactlab.simulate.resolvability import unresolved
from impactlab.simulate.stepping import loop
from impactlab.simulate.stepping.arrays import SAMPLED
from impactlab.simulate.stepping.assembly import Assembly
from impactlab.simulate.stepping.preparation import BuiltBody, self_stepping
from impactlab.simulate.touch_times import unplaced
from impactlab.types import Port

NOTED_LOSS = 0.1  # of the energy, that nothing booked: schemes that damp lose some, but this much is not the mesh's
NOTED_GAIN = 0.02  # of the energy: from here on a gain is told, also where the parts declare more
MAX_GAIN = 1.0  # of the energy: a run that more than doubles it is failed, also where its parts declare no bound
ROUNDING = 1e-9  # of the energy of all bodies: what thousands of steps round off; in a drift more of that in play
NOTED_OVERLAP = 0.1  # of the travel of the faces, where a law says that they do not overlap
NEGATIVE_LOSS = 1e-6  # of the energy in play: losses below zero that no rounding leaves
KEPT_MOMENTUM = 1e-9  # of the momentum in play: schemes keep linear sums to rounding
MANY_KICKS = 100  # of an impulse law, from which the count says nothing any more


def warn(history: AbstractHistory, ports: Sequence[Port], built: Mapping[str, BuiltBody], dt: float = 0.0) -> None:
    """Add the warnings that only a finished run can give; ``dt`` is 0 where steps are chosen by an error estimate."""
    scene, laws = history.scene, history.method.laws
    history.warnings.extend(unresolved(history, built, dt))
    history.warnings.extend(unplaced(history, built, dt))
    history.warnings.extend(beam_warnings.warnings(history, built, dt))
    history.warnings.extend(overlapping(history))
    for span in history.contacts:
        if span.kicks is not None and span.kicks > MANY_KICKS:
            text = f"{span.contact}: {span.kicks} kicks; the count follows the step, so read the total, not the first"
            history.warnings.append(Warned("chatter", text))
    for contact, port in zip(scene.contacts, ports, strict=True):
        for noted in laws[contact.name].noted:
            if count := int(port.memory[noted.slot]):
                text = f"{contact.name}: {noted.text.format(count=count)}"
                history.warnings.append(Warned(noted.code, text))
    touched = {event.contact for event in history.events}
    for contact in scene.contacts:
        if contact.name not in touched:
            smallest = float(history.evaluate(np.linspace(0.0, history.duration, 500), f"gap:{contact.name}").min())
            text = f"{contact.name}: the faces never met; the smallest gap was {smallest:.6g} m"
            history.warnings.append(Warned("no_contact", text))
    gain = gain_of(history)
    if gain > NOTED_GAIN:
        history.warnings.append(Warned("energy_gain", f"energy grew by {100 * gain:.2g} % of the energy in play"))
    loss = history.energy.largest_loss * history.energy.scale / energy_at_stake(history)
    if loss > NOTED_LOSS:
        text = f"{100 * loss:.2g} % of the energy in play was lost without a formula: to the scheme, or to the law"
        history.warnings.append(Warned("energy_loss", text))
    if scene.round_trip > 0.0:
        for contact in scene.contacts:
            graze = near_grazing if laws[contact.name].answers_force else grazing_kick
            if (text_or_none := graze(history, contact.name, scene.round_trip, dt)) is not None:
                history.warnings.append(Warned("near_grazing", text_or_none))


def overlapping(history: AbstractHistory) -> Iterator[Warned]:
    """Give a warning for each hard contact whose faces overlap by a tenth of what they travel, or more."""
    scene, t, touched = history.scene, np.linspace(0.0, history.duration, 2001), touched_in(history)
    for contact in scene.contacts:
        if not history.method.laws[contact.name].hard:
            continue
        deepest = -float(np.min(history.evaluate(t, f"gap:{contact.name}"))) + min(0.0, contact.gap)
        moving = moving_faces(scene, contact.left, contact.right)
        travel = max(float(np.ptp(history.evaluate(t, name) - drift(scene, name, t, touched))) for name in moving)
        if deepest > NOTED_OVERLAP * travel:
            share = deepest / travel
            text = f"{contact.name}: the faces overlap by {deepest:.3g} m, {share:.2g} of their travel"
            yield Warned("overlap", text)


def raise_failure(status: int, assembly: Assembly, history: AbstractHistory) -> None:
    """Raise `StepError` where the run ended early or its energy grew beyond what the pairing declares."""
    time, step, laws = assembly.clock.time, assembly.clock.step, laws_of(assembly.scene, assembly.acting)
    if status == loop.LAW_FAILED:
        raised = next((law.raised for law in assembly.laws if law.raised is not None), None)
        failed = [
            f"{contact.name}: {law.why_failed}"
            for contact, law, reply in zip(assembly.scene.contacts, laws, assembly.replies, strict=True)
            if reply.failed
        ]
        text = (
            "; ".join(failed) or "the coupled answers of several contacts do not agree"
            if raised is None
            else f"a contact law raised {type(raised).__name__}: {raised}"
        )
        raise StepError(text, time=time, step=step, history=history) from raised
    if status == loop.NOT_FINITE:
        raise StepError(
            "the energy is not a finite number: the run diverged",
            time=time,
            step=step,
            history=history,
            remedy="Give a smaller step, or a softer contact.",
        )
    if not np.all(np.isfinite(assembly.memory.record[: assembly.clock.n_records])):
        raise StepError(
            "a displacement or force is not a finite number",
            time=time,
            step=step,
            history=history,
            remedy=LOST_DIGITS,
        )
    check_losses(assembly, history)
    check_momentum(assembly, history)
    bound = energy_bound(assembly.scene, assembly.acting, assembly.integrator, self_stepping(assembly.built))
    cut = assembly.method.events == "dated" and assembly.integrator.any_dt
    own = dict.fromkeys(law.gain_remedy for law in laws if law.gain_remedy)
    remedy = " ".join(own) or f"Give a smaller step, or a softer contact{', or events: located' if cut else ''}."
    check_gain(history, bound, time, step, remedy)


def check_losses(assembly: Assembly, history: AbstractHistory) -> None:
    """Raise `StepError` where a law replied losses below zero: energy from nowhere that its book takes for balanced."""
    laws = laws_of(assembly.scene, assembly.acting)
    for contact, law, record in zip(assembly.scene.contacts, laws, assembly.contacts, strict=True):
        if -record.negative > NEGATIVE_LOSS * energy_at_stake(history):
            raise StepError(
                f"{contact.name}: law '{kind_of(law)}' replied losses of {record.negative:.6g} J, below zero",
                time=assembly.clock.time,
                step=assembly.clock.step,
                history=history,
                remedy="This is a fault of the law: its 'dissipated' and 'unresolved' may not be negative.",
            )


def check_gain(history: AbstractHistory, bound: float, time: float, step: int, remedy: str) -> None:
    """Raise `StepError` where the energy grew beyond what the parts declare, or its balance is not a number.

    A run that more than doubles the energy of its bodies is no motion of theirs, whatever its parts declare.
    """
    if not np.all(np.isfinite(history.energy.balance)):
        raise StepError(
            "the balance of energy is not a finite number: a law stored or lost what is none",
            time=time,
            step=step,
            history=history,
            remedy=LOST_DIGITS,
        )
    gain = gain_of(history)
    allowed = bound + ROUNDING * history.energy.rounding
    if gain > min(allowed, MAX_GAIN):
        declared = f"these parts declare at most {bound:.3g}" if gain > allowed else "no run may more than double it"
        raise StepError(
            f"energy grew by {gain:.3g} of the energy in play, and {declared}",
            time=time,
            step=step,
            history=history,
            remedy=remedy,
        )


def gain_of(history: AbstractHistory) -> float:
    """Return the energy that a run gained, over the energy at stake."""
    return history.energy.largest_gain * history.energy.scale / energy_at_stake(history)


def energy_at_stake(history: AbstractHistory) -> float:
    """Return the energy that the run dealt with [J]: what it began with, or the work of loads; else the largest seen.

    What a diverging run adds is not at stake: a gain is measured against what was there without it. Of free bodies it
    is the energy in the frame of their centre of mass.
    """
    book = history.energy
    return book.at_stake or float(np.abs(book.total).max()) or 1.0


def check_momentum(assembly: Assembly, history: AbstractHistory) -> None:
    """Raise `StepError` where a body that nothing holds did not gain the impulses of its contacts and loads."""
    scene, reached = assembly.scene, assembly.clock.time
    samples = assembly.memory.sample[: assembly.clock.n_samples]
    if len(samples) < 2 or assembly.clock.step < assembly.steps:
        return
    impulses = [contact.total for contact in assembly.contacts]
    for number, (name, body) in enumerate(scene.bodies.items()):
        if not body.is_free or isinstance(assembly.built[name].model, AbstractSelfStepping):
            continue
        momentum, energies = samples[:, SAMPLED + 2 + 3 * number], np.abs(samples[:, SAMPLED + 3 * number])
        seen = Seen(momentum[0], momentum[-1], np.abs(momentum).max(), energies.max())
        found = balance(scene, name, impulses, reached, seen)
        if found.error > KEPT_MOMENTUM:
            raise StepError(
                f"'{name}' was given {found.given:.9g} N s and its momentum changed by {found.changed:.9g} N s",
                time=reached,
                step=assembly.clock.step,
                history=history,
                remedy=LOST_DIGITS,
            )
