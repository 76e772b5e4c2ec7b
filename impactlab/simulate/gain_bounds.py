"""Bounds on the energy that the parts of a stepped run may add, known after the run."""

from __future__ import annotations

import numpy as np

from impactlab.mechanisms.model import LargestTurn, MechanismModel
from impactlab.numerics.banded import multiply
from impactlab.scene.method import laws_of
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.types import Level


def bound_of(assembly: Assembly, history: AbstractRecordedHistory) -> float:
    """Return the largest declared energy gain of a run over its initial energy."""
    bound = assembly.layout.plan.energy_bound
    models = [body.model for body in assembly.layout.built.values() if isinstance(body.model, MechanismModel)]
    if models:
        laws = laws_of(assembly.scene, assembly.acting)
        impulses = any(Level.IMPULSE in law.needs or Level.CLOSING in law.needs for law in laws)
        bound += sum(model.gains_energy(assembly.dt, impulses, fastest(history, model)) for model in models)
    return bound


def gain_of_forces(assembly: Assembly, history: AbstractRecordedHistory) -> float:
    """Return the bound on the energy [J] that a scheme may add where forces act beside its accelerations.

    It is ``force_gain`` of the integrator times the sum of dt^2 F r M^-1 r F over steps and bodies, and ``start_gain``
    times dt^2 a M a at t = 0. A body with n faces takes n times the sum over them, which no phases of their forces
    exceed.
    """
    scheme, dt, scene = assembly.integrator, assembly.dt, assembly.scene
    if scheme.force_gain == 0.0:
        return 0.0
    squares = {contact.name: _square_of_contact(history, contact.name) for contact in scene.contacts}
    bound = 0.0
    for name, stepper in assembly.layout.plan.steppers.items():
        n_dof = stepper.jump.shape[1]
        if n_dof == 0 or history.built[name].system.phases is not None:
            continue
        mobility = np.einsum("ij,ij->i", stepper.face_rows, stepper.jump)
        loads, summed = scene.bodies[name].loads, np.zeros(len(mobility))
        for contact, places in zip(scene.contacts, scene.places, strict=True):
            for point, place in zip(contact.faces, places, strict=True):
                if point.body == name:
                    summed[place] += squares[contact.name]
        for place, (_, load) in enumerate(loads, len(mobility) - len(loads)):
            times, forces = load.table(assembly.steps * dt, assembly.steps)  # straight lines, whose squares add up to:
            first, last = forces[:-1], forces[1:]
            summed[place] += float(np.diff(times) @ (first**2 + first * last + last**2)) / 3.0
        bound += scheme.force_gain * dt * np.count_nonzero(summed) * float(mobility @ summed)
        if stepper.state.size >= 3 * n_dof:
            a = stepper.state[2 * n_dof : 3 * n_dof]
            bound += scheme.start_gain * dt**2 * float(a @ multiply(history.built[name].system.mass, a))
    return bound


def _square_of_contact(history: AbstractRecordedHistory, name: str) -> float:
    """Return a bound on the integral of the squared force of a contact [N^2 s].

    It is that of the force over time times the largest force.
    """
    force = history.recorded[f"force:{name}"]
    sizes = np.abs(force.values[1:])
    largest = max([float(sizes.max(initial=0.0)), *(span.peak_force or 0.0 for span in history.spans(name))])
    return largest * float(np.diff(force.times) @ sizes)


def fastest(history: AbstractRecordedHistory, model: MechanismModel) -> LargestTurn:
    """Return the largest rate and angular acceleration of a mechanism in a run."""
    names = [f"rate:{each.name}" for each in model.part.readings if each.is_angle]
    rates = [history.recorded[name] for name in names if name in history.recorded]
    changes = [np.abs(np.diff(each.values)) / np.diff(each.times) for each in rates]
    return LargestTurn(
        max((float(np.max(np.abs(each.values))) for each in rates), default=0.0),
        max((float(np.max(each, initial=0.0)) for each in changes), default=0.0),
    )
