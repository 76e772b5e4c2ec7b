"""Warnings of contacts that the time resolution of a method cannot resolve."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from impactlab.contact.bonded import Bonded
from impactlab.exact.setup.contact_kinds import massless
from impactlab.history.base import Warned
from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.continuous.model import Continuous
from impactlab.models.modal_body import ModalBody
from impactlab.scene.method import stiffness_at
from impactlab.scene.problem import Contact
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.simulate.planning.contact_facts import ContactFacts
from impactlab.simulate.warnings.peaks import oscillating
from impactlab.simulate.warnings.smoothed_peaks import smoothed
from impactlab.types import Level

COARSE_WARN = 0.25  # of a contact's time: the error of a position is then about a quarter of its change in it
COMPLIANCE_WARN = 0.05  # of the bodies' own compliance, for a spring in place of a hard contact
# Flexibility that the modes kept leave out at a contact, of that of the contact, with which it stands in series. Peak
# forces on beams are wrong by 0.4 to 0.7 of this share, on rods by 0.1 to 0.3.
LEFT_OUT_WARN, LEFT_OUT_WANTED = 0.03, 0.003
MAX_MODES_ADVISED = 10_000  # more are no remedy
# First force of a dashpot on a mesh over that of the waves, and transits of an element after a touch in which it is the
# peak: the end nodes of mass m give way as the rods of impedance Z do after m/Z, half of such a transit.
FIRST_FORCE_WARN, FIRST_FORCE_TIME = 1.1, 4.0
FINER, SMALLER_STEP = "more elements or modes, and a smaller step", "a smaller step"  # remedies in the texts
BOND_LOSS_WARN = 0.01  # of the reference energy, that a bond on a mesh loses in the first step
MIN_STORED = 0.01  # of the energy, in an initial overlap: less (a tenth of the speeds) need not be resolved


def in_a_choice(warned: Warned) -> Warned:
    """Return a warning of a run that a tolerance has chosen: its mesh and step are no settings of the case."""
    text = warned.text
    for remedy in (FINER, SMALLER_STEP):
        text = text.replace(f"; give {remedy}", "; give a smaller tolerance")
    return warned._replace(text=text)


def unresolved(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Yield the warnings of closed contacts that the method cannot resolve."""
    touched = {event.contact for event in history.events}
    for contact in history.scene.contacts:
        if contact.name in touched:
            facts = history.facts_of(contact)
            stiffness = _stiffness(history, contact, facts)
            of_peak = [
                *_too_coarse(history, contact, facts, stiffness),
                *_first_force(history, contact, facts.dashpot),
            ]
            of_peak = of_peak or list(oscillating(history, contact, facts))
            yield from of_peak or smoothed(
                history, contact, facts, finer_by(history, [point.body for point in contact.faces])
            )
            yield from _too_compliant(history, contact, facts)
            yield from _few_modes(history, contact, facts, stiffness)


def _too_coarse(
    history: AbstractRecordedHistory, contact: Contact, facts: ContactFacts, stiffness: float | None
) -> Iterator[Warned]:
    """Yield a warning of a contact shorter than a few time resolutions.

    Speeds change within this time; ``stiffness`` is that of the contact [N/m].
    """
    if not stiffness:
        return
    scene, impedance, mass, dashpot = history.scene, facts.impedance, facts.striker, facts.dashpot
    # A mass m on a rod of impedance Z loses its speed in m/Z; a spring k between them lets both swing with sqrt(m/k),
    # and a dashpot c beside the spring, if it is stiffer, stops them in m/c.
    swing = min(math.sqrt(mass / stiffness), mass / dashpot if dashpot > 0.0 else math.inf)
    time = max(mass / impedance, swing) if mass < math.inf else math.inf
    words = "the speed of the striking body changes"
    if 0.0 < stiffness < math.inf and float(history.recorded[f"gap:{contact.name}"].values[0]) < 0.0:
        at_start = float(history.energy.stored[0])
        if at_start > MIN_STORED * float(history.energy.total[0]):
            # An initial overlap relaxes as fast as the spring lets it.
            time = min(impedance / stiffness, math.sqrt(mass / stiffness))
            words = "the overlap at the start changes"
    if scene.duration < time:
        time, words = scene.duration, "the run ends"
    shortest = facts.resolution
    if shortest > COARSE_WARN * time > 0.0:
        finer = finer_by(history, [point.body for point in contact.faces])
        text = (
            f"{contact.name}: {words} within {time:.3g} s, and this method resolves times of {shortest:.3g} s or more; "
            f"give {finer}"
        )
        yield Warned("coarse_contact", text, contact.name)


def lost_in_bonds(history: AbstractRecordedHistory, reference: float) -> Iterator[Warned]:
    """Yield a warning for each bond that loses energy in the mass of a node; ``reference`` is the energy [J].

    Faces of different velocities have one after the first step. A face of a rod without mass takes that velocity at
    once, and nothing is lost; the loss of a mesh falls with the length of its elements.
    """
    lost = {link.name: link.loss for link in history.links}
    for contact in history.scene.contacts:
        law = history.method.laws[contact.name]
        if not isinstance(law, Bonded) or not any(massless(history.scene, point) for point in contact.faces):
            continue
        share = lost.get(contact.shared_name, 0.0) / reference
        if share > BOND_LOSS_WARN:
            text = (
                f"{contact.name}: the faces start with different velocities, and the bond takes {100 * share:.2g} % of "
                "the reference energy from the mass of their nodes, booked as loss of the contact. Rods without a mesh "
                f"lose nothing; give {finer_by(history, [point.body for point in contact.faces])}, or model "
                "continuous"
            )
            yield Warned("coarse_contact", text, contact.name)


def finer_by(history: AbstractRecordedHistory, bodies: Iterable[str]) -> str:
    """Return what resolves shorter times: rigid bodies and delay lines have no elements and no modes."""
    elastic = [body for name in bodies if (body := history.scene.bodies[name].elastic) is not None]
    models = history.method.models
    coarse = any(body.bends or not isinstance(models.get(body.name), Continuous) for body in elastic)
    return FINER if coarse else SMALLER_STEP


def _stiffness(history: AbstractRecordedHistory, contact: Contact, facts: ContactFacts) -> float | None:
    """Return the stiffness of a contact [N/m].

    Of a law that stiffens, it is that at its deepest overlap in the run.
    """
    if facts.stiffness is not None:
        return facts.stiffness
    return stiffness_at(history.scene, history.method, contact, max(0.0, -contact.gap, -history.smallest_gap(contact)))


def _too_compliant(history: AbstractRecordedHistory, contact: Contact, facts: ContactFacts) -> Iterator[Warned]:
    """Warn of a spring for a hard contact that is as compliant as a body.

    Its stiffness was taken from a mesh.
    """
    if not facts.is_relative or (stiffness := facts.stiffness) is None:
        return
    compliance = sum(history.scene.bodies[point.body].static_compliance for point in contact.faces)
    if compliance > 0.0 and 1.0 / stiffness > COMPLIANCE_WARN * compliance * (1.0 + 1e-9):
        text = (
            f"{contact.name}: the compliance of the spring of {stiffness:.3g} N/m is "
            f"{100.0 / (stiffness * compliance):.2g} % of that of the rods; give a larger relative stiffness, or more "
            "elements"
        )
        yield Warned("soft_contact", text, contact.name)


def _first_force(history: AbstractRecordedHistory, contact: Contact, dashpot: float) -> Iterator[Warned]:
    """Yield a warning of a first force that an explicit mesh exaggerates.

    Only a first force that is the peak of the run counts. A rod of impedance Z struck at v gives a dashpot c the force
    c v/(1 + c/Z) at once. The end node of a mesh with the mass m does so after m/Z; in the first step of dt it gives c
    v/(1 + c dt/(2 m)). Both are equal where the waves cross an element in a step, and where an end carries a mass that
    is no part of the mesh. A hard contact that closes with an impulse stops the end nodes in a step by the force m
    v/dt, and the waves by Z v.
    """
    scheme, dt = history.method.integrator, history.dt
    jumps = Level.CLOSING in history.method.laws[contact.name].needs
    if (
        not (dashpot > 0.0 or jumps)
        or dt is None
        or not isinstance(scheme, AbstractIntegrator)
        or not scheme.needs_diagonal_mass
    ):
        return
    of_waves, of_nodes = 0.0, 0.0  # mobilities, m/(N s)
    for point in contact.faces:
        body, built = history.scene.bodies[point.body], history.built[point.body]
        heavy = any(end.kind == "mass" and end.value > 0.0 for x, end in body.ends if x == point.x)
        if body.waves is None or heavy:
            continue
        row = built.model.row(point.x, "displacement")
        mobility = (1.0 if jumps else 0.5) * dt * float(np.sum(row * row / built.system.mass[0]))
        own = 1.0 / body.impedance_at(point.x)
        of_waves, of_nodes = of_waves + own, of_nodes + min(own, mobility)
    if not of_nodes:
        return
    ratio = of_waves / of_nodes if jumps else (1.0 + dashpot * of_waves) / (1.0 + dashpot * of_nodes)
    if ratio < FIRST_FORCE_WARN:
        return
    force = history.recorded[f"force:{contact.name}"]
    peak = float(force.times[int(np.argmax(force.values))])
    transit = dt * of_waves / of_nodes
    touches = (event.time for event in history.events if event.contact == contact.name and event.kind == "close")
    if any(-dt <= peak - time <= FIRST_FORCE_TIME * transit for time in touches):
        acts = "the dashpot acts on the mass of the end nodes before waves can transmit its force"
        advice = "courant: 1, with elements of a transit time of one step"
        if jumps:
            acts = (
                "the mass of the end nodes is stopped within one step, and the transit time of their "
                "elements is more than two"
            )
            advice = "both bodies elements of a transit time of at most two steps"
        yield Warned(
            "first_force",
            f"{contact.name}: the peak of the force is that at a touch, where {acts}. It is too large by up to "
            f"{100.0 * (ratio - 1.0):.0f} %, for any number of elements; impulses and displacements converge. Give "
            f"{advice}, or model: {{kind: continuous}}",
            contact.name,
        )


def _few_modes(
    history: AbstractRecordedHistory, contact: Contact, facts: ContactFacts, stiffness: float | None
) -> Iterator[Warned]:
    """Yield a warning of a contact stiffer than the modes left out.

    Those of a body would give more than the contact does. A hard contact has no flexibility to compare with, nor has
    the spring in its place that is taken from a mesh.
    """
    if not stiffness or stiffness == math.inf or facts.is_relative:
        return
    for point in contact.faces:
        body, built = history.scene.bodies[point.body], history.built[point.body]
        if not isinstance(built.model, ModalBody) or built.system.phases is not None:
            continue
        share = abs(built.model.left_out(point.x, "displacement", point.x)) * stiffness
        if share > LEFT_OUT_WARN:
            kept = built.system.load.size
            falls_as = 3.0 if body.bends else 1.0  # with n modes as 1/n, by bending alone as 1/n^3
            enough = math.ceil(kept * (share / LEFT_OUT_WANTED) ** (1.0 / falls_as))
            sheared = body.bends and not body.unbounded_first_force
            advice = f"give many more modes than {kept}" if sheared else f"give about {enough} modes"
            wrong = "and the force is wrong by up to as much"
            if enough > MAX_MODES_ADVISED:
                wrong, advice = (
                    "so that its force is that of a hard contact with these modes",
                    "give a law of hard contact",
                )
            yield Warned(
                "few_modes",
                f"{contact.name}: the modes left out of '{point.body}' have {100 * share:.2g} % of the "
                f"compliance of the contact, {wrong}; {advice}, or a basis with a static shape there",
                contact.name,
            )
