"""The step loop in plain Python: free step, contact laws, correction, dated events, energy book.

It takes the steps of the compiled loop (`impactlab.simulate.stepping`) one by one, on numpy arrays, and agrees with it
to rounding. Read it first, and debug a wrong force with it: laws are called as the Python functions that they are.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_array

from impactlab.errors import CaseError, StepError
from impactlab.numerics.compiling import plain
from impactlab.simulate.checks import SMALLER_STEP
from impactlab.simulate.plan import Plan
from impactlab.simulate.stepping.event_times import TOUCH_TOL, close_time, open_time
from impactlab.simulate.stepping.ports import fill_acting, fill_acting_push, predicted_gap
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.testing.plain_parts import FORCE, IMPULSE, JUMP, PUSH, PlainContact, columns_of, dashpots_of, mean_force
from impactlab.types import Array, Reply

MAX_SWEEPS, AGREED_TOL = 5000, 1e-15  # of the largest impulse of the step: a sweep that changes less is the last
Hook = Callable[["PlainLoop"], None]


class PlainLoop:
    """A run, step by step, in plain Python.

    Steps are of one length (``events: dated``), and bodies keep their coordinates. Two hooks may look at the loop and
    change it: ``before`` the laws are evaluated, when all bodies have moved freely and the ports are filled (columns
    may be rewritten: ports are filled again), and ``after`` the correction, when the replies are there (the state may
    be rewritten: faces are read again).
    """

    def __init__(self, plan: Plan, before: Hook = lambda _: None, after: Hook = lambda _: None) -> None:
        changing = any(built.system.phases is not None for built in plan.built.values())
        if plan.dt is None or plan.integrator is None or plan.method.events == "located" or changing:
            text = "the plain loop takes whole steps of bodies that keep their coordinates"
            raise CaseError(text, remedy="Give an integrator, `events: dated`, another basis.", path="solve")
        self.plan, self.scheme, self.dt, self.before, self.after = plan, plan.integrator, plan.dt, before, after
        self.assembly = Assembly(plan, self.scheme, self.dt, with_beads=False)
        memory = self.assembly.memory
        self.time, self.state = 0.0, memory.state  # of all bodies: displacements, velocities, the rest
        self.events: list[tuple[float, int, str]] = []  # s; contact; close, open or impulse
        self.lost = {"contact": 0.0, "ends": 0.0, "damping": 0.0, "unresolved": 0.0}  # J
        shape = memory.row_start.size - 1, self.state.size
        self.rows = csr_array((memory.row_value, memory.row_index, memory.row_start), shape).toarray()
        shift, steppers = self.assembly.layout.shift, plan.steppers.items()
        # Parts of the state, and parameters, to which kernels may write.
        self.parts = {name: slice(shift[name], shift[name] + each.state.size) for name, each in steppers}
        self.parameters = {name: each.parameters.copy() for name, each in steppers}
        self.dashpots = dashpots_of(plan, self.parts, self.state, self.dt)
        columns, pushed = columns_of(plan, self.parts, self.rows)
        parts = zip(itertools.count(), columns, pushed, strict=False)
        self.contacts = [PlainContact(plan, self.assembly, self.rows, *each) for each in parts]
        self.start_of_step()
        for link in self.contacts:
            overlaps = link.law.answers_force and not link.law.hard and link.port.gap < 0.0
            if link.law.two_sided or overlaps:
                self.join(link)

    def join(self, contact: PlainContact) -> None:
        """Evaluate a contact that is closed at t = 0, with the faces held.

        It may yield and store energy before any step.
        """
        port = contact.port
        port.dt, port.free_gap, port.free_gap_rate = 1.0, port.gap, port.gap_rate
        plain(fill_acting)(port, 0.0)
        contact.respond()
        port.memory = contact.reply.memory
        contact.reply, contact.given = Reply(), np.zeros(JUMP)

    def step(self) -> None:
        """Take one step."""
        self.start_of_step()
        old = self.state.copy()
        for name, stepper in self.plan.steppers.items():
            stepper.free(self.parameters[name], self.state[self.parts[name]])
        self.push_ends()
        for contact in self.contacts:
            contact.reply, contact.given = Reply(), np.zeros(JUMP)
            self.fill(contact, self.state)
        self.before(self)
        self.solve()
        self.state += sum(contact.given @ contact.columns[:JUMP] for contact in self.contacts)
        self.after(self)
        for contact in self.contacts:
            self.date(contact)
        self.book(old)
        self.time += self.dt

    def push_ends(self) -> None:
        """Add the response to each force over time on an end."""
        names = list(self.plan.built)
        for load in self.assembly.loads:
            name, force = names[load.body], mean_force(load, self.assembly.memory, self.time, self.dt)
            self.state[self.parts[name]] += force * self.plan.steppers[name].force_response[load.place]

    def start_of_step(self) -> None:
        """Fill the ports with faces and readings at the start of a step."""
        forces = np.array([contact.reply.force for contact in self.contacts])
        for contact in self.contacts:
            port, left, right = contact.port, contact.port.left, contact.port.right
            port.time, port.dt = self.time, self.dt
            left.displacement, right.displacement = contact.u @ self.state
            left.velocity, right.velocity = contact.v @ self.state
            port.gap = contact.record.initial_gap + right.displacement - left.displacement
            port.gap_rate, port.pushed = right.velocity - left.velocity, float(contact.pushed @ self.state)
            port.readings[: len(contact.read)] = [*(contact.read @ self.state + contact.left_out @ forces)]

    def fill(self, contact: PlainContact, free: Array) -> None:
        """Fill a port at the end of the free step, with the other contacts' effect."""
        port, left, right = contact.port, contact.port.left, contact.port.right
        left.free_displacement, right.free_displacement = contact.u @ free
        left.free_velocity, right.free_velocity = contact.v @ free
        port.free_gap = contact.record.initial_gap + right.free_displacement - left.free_displacement
        port.free_gap_rate = right.free_velocity - left.free_velocity
        port.free_pushed = float(contact.pushed @ free)
        u, v, pushed = (rows @ contact.columns.T for rows in (contact.u, contact.v, contact.pushed))
        left.displacement_per_force, right.displacement_per_force = -u[0, FORCE], u[1, FORCE]
        left.velocity_per_force, right.velocity_per_force = -v[0, FORCE], v[1, FORCE]
        left.velocity_per_impulse, right.velocity_per_impulse = -v[0, JUMP], v[1, JUMP]
        port.gap_per_force, port.gap_per_impulse, port.gap_per_projection, port.gap_per_push, _ = u[1] - u[0]
        port.rate_per_force, port.rate_per_impulse = v[1, FORCE] - v[0, FORCE], v[1, JUMP] - v[0, JUMP]
        port.pushed_per_force, port.pushed_per_push = pushed[FORCE], pushed[PUSH]
        rate = contact.v[1] - contact.v[0]
        jumps = [rate @ other.columns[JUMP] * other.given for other in self.contacts if other is not contact]
        _, port.others_rate, projected, _ = np.sum([np.zeros(JUMP), *jumps], axis=0)
        port.predicted_gap = plain(predicted_gap)(port, projected, self.scheme.projects_first)
        plain(fill_acting)(port, self.scheme.load_point)
        plain(fill_acting_push)(port, self.scheme.load_point)

    def solve(self) -> None:
        """Evaluate each law at the other contacts' last replies, until no reply changes."""
        for _ in range(MAX_SWEEPS):
            change, largest = 0.0, 0.0
            for contact in self.contacts:
                others = [other.given @ other.columns[:JUMP] for other in self.contacts if other is not contact]
                self.fill(contact, np.sum([self.state, *others], axis=0))
                last = contact.given
                contact.respond()
                in_impulses = self.dt, 1.0, 1.0 / self.dt, self.dt * abs(contact.port.pushed_per_push)
                change = max(change, float(np.abs(in_impulses * (contact.given - last)).max()))
                largest = max(largest, float(np.abs(in_impulses * contact.given).max()))
            if len(self.contacts) < 2 or change <= AGREED_TOL * largest:
                return
        raise StepError("contacts do not agree", time=self.time, step=round(self.time / self.dt), remedy=SMALLER_STEP)

    def date(self, contact: PlainContact) -> None:
        """Date closing and opening in the step; carry phase and memory to the next."""
        port, reply, record = contact.port, contact.reply, contact.record
        given, now = reply.force * self.dt + reply.impulse, (self.time, self.dt)
        touched = record.dates and (port.in_contact or reply.in_contact or given > TOUCH_TOL * record.total)
        happened = [(plain(close_time)(record, port, reply, *now), "close")] if touched and not port.in_contact else []
        happened += [(plain(open_time)(record, port, reply, *now), "open")] if touched and not reply.in_contact else []
        happened += [(self.time, "impulse")] if reply.impulse else []
        for time, kind in happened:  # times of one contact never run backwards
            record.last_event = max(time, record.last_event)
            self.events.append((record.last_event, contact.number, kind))
        record.old_gap, record.old_trial, record.total = port.gap + port.offset, reply.trial, record.total + given
        port.in_contact, port.offset, port.memory = reply.in_contact, reply.offset, reply.memory

    def book(self, old: Array) -> None:
        """Book the energy lost in contacts and dashpots [J].

        It follows from the state at the start of the step and now.
        """
        lost = sum(contact.reply.dissipated for contact in self.contacts)
        self.lost["contact"] += 0.0 if lost < 0.0 else lost  # NaN stays
        self.lost["unresolved"] += sum(contact.reply.unresolved for contact in self.contacts)
        jumps = sum((each.given[IMPULSE] * each.columns[JUMP] for each in self.contacts), np.zeros(old.size))
        for dashpot in self.dashpots:
            self.lost[dashpot.account] += dashpot.lost(old, self.state, jumps, self.scheme, self.dt)

    def energy(self, name: str) -> float:
        """Return the energy of a body less the work of its load [J]."""
        out, stepper = np.zeros(4), self.plan.steppers[name]
        stepper.measure(self.parameters[name], self.state[self.parts[name]], out)
        return float(out[0] - out[1])
