"""Parts of the plain step loop: contacts, responses of bodies to them, dashpots, forces over time on ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from impactlab.errors import StepError
from impactlab.integrators.base import AbstractIntegrator
from impactlab.simulate.checks import SMALLER_STEP
from impactlab.simulate.plan import Plan
from impactlab.simulate.stepping.arrays import StepArrays
from impactlab.simulate.stepping.end_loads import ON_GRID
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.simulate.stepping.setup.flat_arrays import dashpots
from impactlab.stepper import Stepper
from impactlab.types import Array, Reply

# Columns of a contact: change of the state at the end of the step per unit of each; the last one at once, per impulse.
FORCE, IMPULSE, PROJECTION, PUSH, JUMP = range(5)


class PlainContact:
    """One contact: its law, its records, its rows and columns over the whole state."""

    def __init__(self, plan: Plan, assembly: Assembly, rows: Array, number: int, columns: Array, pushed: Array) -> None:
        contacts, starts, first = plan.scene.contacts, plan.starts, 2 * number
        self.number, self.law, self.columns = number, plan.acting.laws[contacts[number].name], columns
        self.record, self.port, self.reply = assembly.contacts[number], assembly.ports[number], Reply()
        self.given = np.zeros(JUMP)
        self.u, self.v = rows[first : first + 2], rows[first + 2 * len(contacts) :][:2]  # left, right face
        before = sum(len(start.readings) for start in starts[:number])
        read = slice(before, before + len(starts[number].readings))
        self.read, self.left_out = rows[4 * len(contacts) :][read], assembly.memory.left_out[read]
        self.pushed = pushed  # row along which the law may push

    def respond(self) -> None:
        """Evaluate the law."""
        self.reply = reply = Reply(memory=self.port.memory)
        type(self.law).respond(self.port, reply)
        self.given = np.array([reply.force, reply.impulse, reply.projection, reply.push])  # N, N s, kg m
        if self.reply.failed:
            text, time = self.law.why_failed, self.port.time
            raise StepError(text, time=time, step=round(time / self.port.dt), remedy=SMALLER_STEP)


def columns_of(plan: Plan, parts: Mapping[str, slice], rows: Array) -> tuple[Array, Array]:
    """Return the columns of the contacts over the whole state, and the rows along which laws push.

    ``parts`` of the state belong to the bodies; the last ``rows`` are those of the pushes. Shapes (contacts, 5,
    entries) and (contacts, entries).
    """
    columns = np.zeros((len(plan.scene.contacts), 5, rows.shape[1]))
    pushed = np.zeros((len(columns), rows.shape[1]))
    taken = dict.fromkeys(plan.built, 0)  # responses of a body: its faces in the order of contacts, then its pushes
    for own, contact in zip(columns, plan.scene.contacts, strict=True):
        for name, sign in ((contact.left.body, -1.0), (contact.right.body, 1.0)):
            stepper, number, part = plan.steppers[name], taken[name], parts[name]
            n_dof = stepper.jump.shape[1]
            responses = stepper.force_response, stepper.impulse_response, stepper.projection_response
            own[:PUSH, part] += sign * np.array([response[number] for response in responses])
            own[JUMP, part][n_dof : 2 * n_dof] += sign * stepper.jump[number]
            taken[name] += 1
    for push, row in zip(plan.pushes, rows[len(rows) - len(plan.pushes) :], strict=True):
        response = plan.steppers[push.body].force_response[taken[push.body]]
        columns[push.contact, PUSH, parts[push.body]] += push.weight * response
        pushed[push.contact] += push.weight * row
        taken[push.body] += 1
    return columns, pushed


@dataclass
class PlainDashpot:
    """One dashpot of a body."""

    row: Array  # of its length over the whole state
    damping: float  # N s/m
    account: str  # of its losses: damping or ends
    stepper: Stepper  # of its body
    stretched: float  # m, change of its length in the last step
    filtered: float = 0.0  # m/s, z of `impactlab.integrators.base.Losses`

    def lost(self, old: Array, new: Array, jumps: Array, scheme: AbstractIntegrator, dt: float) -> float:
        """Return the energy lost in a step from the states at its ends and the change by impulses at once [J]."""
        stretched, losses = float(self.row @ (new - old)), self.stepper.losses
        if losses is None:
            # Where velocities belong to the middle of a step, dashpots feel the mean of this step and the last.
            felt = 0.5 * (stretched + self.stretched) if scheme.velocity_point < 1.0 else stretched
            self.stretched = stretched
            return self.damping * felt**2 / dt
        rates, accelerations = (np.roll(self.row, n * self.stepper.jump.shape[1]) for n in (1, 2))
        before, now = float(rates @ old), float(rates @ new)
        kept = now * float(accelerations @ new) - before * float(accelerations @ old)
        before += float(rates @ jumps)
        z, self.filtered = self.filtered, (now - before - losses.am * self.filtered) / (1.0 - losses.am)
        felt = (1.0 - losses.gamma) * before + losses.gamma * now + losses.lag * (self.filtered - z)
        return self.damping * (felt * stretched - losses.kappa * kept)


def dashpots_of(plan: Plan, parts: Mapping[str, slice], state: Array, dt: float) -> list[PlainDashpot]:
    """Return the dashpots of all bodies; ``parts`` of the state belong to these."""
    found, units = [], np.eye(state.size)
    for name, stepper in plan.steppers.items():
        first = parts[name].start
        for group in dashpots(plan.built[name].system):
            for number, damping in enumerate(group.damping):
                other = group.other >= 0
                row = units[first + group.first + number] - other * units[first + group.other + number]
                stretched = dt * float(np.roll(row, stepper.jump.shape[1]) @ state)
                account = "damping" if group.inside else "ends"
                found.append(PlainDashpot(row, float(damping), account, stepper, stretched))
    return found


def mean_force(load: Any, memory: StepArrays, time: float, dt: float) -> float:
    """Return a force over time on an end in a step [N].

    It is its mean over the step, or over as long about the end of it where the scheme takes forces; where the only
    sample lies there, it is the value of that sample.
    """
    times = memory.load_times[load.table_start : load.table_end]
    forces = memory.load_forces[load.table_start : load.table_end]
    begin = time + (load.point - 0.5) * dt
    end = begin + dt
    breaks = np.array([begin, *times[(times > begin) & (times < end)], end])
    at = np.interp(breaks, times, forces)  # straight lines between
    instant = time + load.point * dt
    if load.point != 0.5 and breaks.size == 3 and abs(breaks[1] - instant) <= ON_GRID * dt:
        return float(at[1])
    return float(np.sum(0.5 * (at[1:] + at[:-1]) * np.diff(breaks)) / (end - begin))
