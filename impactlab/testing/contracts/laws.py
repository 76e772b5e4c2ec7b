"""Contract suites of all laws, and of those of contacts."""

from __future__ import annotations

import ctypes
import dataclasses
import math
from typing import ClassVar

import numpy as np

from impactlab.contact.base import AbstractContactLaw
from impactlab.numerics.addresses import COMPILED
from impactlab.numerics.compiling import plain
from impactlab.numerics.law_address import LawAddress
from impactlab.simulate.adaptive.law import InstantContact
from impactlab.simulate.planning.preparation import fault_of_start
from impactlab.simulate.stepping.ports import fill_acting, fill_acting_push
from impactlab.testing.contracts.common import PIECE, PORTS, at_most, described
from impactlab.testing.followed import Follower
from impactlab.types import Arriving, Level, Port, Reply, SideFacts

MOTIONS = 20  # random ones of a law with branches


class LawContract:
    """Properties of every law, of contacts and of links.

    Override ``sides`` where the law supports other bodies.
    """

    part: ClassVar[AbstractContactLaw]
    dt: ClassVar[float] = 1e-7

    def sides(self) -> tuple[SideFacts, SideFacts]:
        """Return a mass on the left of a steel rod."""
        nothing, mass = math.nan, PIECE.mass
        hammer = SideFacts("mass", nothing, nothing, nothing, nothing, nothing, mass, 0.0, self.dt / mass)
        stiffness, z, c = PIECE.young * PIECE.area / (0.01 * PIECE.length), PIECE.impedance, PIECE.wave_speed
        rod = SideFacts("rod", z, c, PIECE.area, stiffness, PIECE.length, mass, 0.0, 0.4 / z)
        return hammer, rod._replace(left_out=0.5 / stiffness)

    def port(self, random: np.random.Generator, opened: bool = False, apart: bool = False) -> Port:
        """Return a port with random motions of the faces.

        They are far away if ``opened``, and just apart at both ends of the step if ``apart``. The force of its scheme
        acts at the start, in the middle or at the end of the step.
        """
        left, right = self.sides()
        start = type(self.part).begin(self.part, left, right, self.dt)
        fault = fault_of_start(start)
        assert not fault, fault
        port = Port()
        port.time, port.dt = 0.0, self.dt
        load_point = float(random.choice([0.0, 0.5, 1.0]))
        port.jump_in_force = 1.0 if load_point == 0.0 else float(random.integers(0, 2))
        port.in_contact = 0.0 if opened or apart else float(random.integers(0, 2))
        for side, facts in ((port.left, left), (port.right, right)):
            side.displacement, side.velocity = random.normal(0.0, 1e-7), random.normal(0.0, 1.0)
            side.velocity_per_force = facts.velocity_per_force
            side.displacement_per_force = 0.5 * self.dt * facts.velocity_per_force
            side.velocity_per_impulse = facts.velocity_per_force / self.dt
            side.free_velocity = side.velocity + random.normal(0.0, 0.1)
            side.free_displacement = side.displacement + 0.5 * self.dt * (side.velocity + side.free_velocity)
        away = 1e-3 if opened else 0.0
        port.gap = away + port.right.displacement - port.left.displacement
        port.free_gap = away + port.right.free_displacement - port.left.free_displacement
        if apart:
            away = max(0.0, -port.gap, -port.free_gap) + 10.0 ** random.uniform(-15.0, -6.0)
            port.gap, port.free_gap = port.gap + away, port.free_gap + away
        port.gap_rate = port.right.velocity - port.left.velocity
        port.free_gap_rate = port.right.free_velocity - port.left.free_velocity
        port.gap_per_force = port.left.displacement_per_force + port.right.displacement_per_force
        port.rate_per_force = port.left.velocity_per_force + port.right.velocity_per_force
        port.rate_per_impulse = port.left.velocity_per_impulse + port.right.velocity_per_impulse
        port.gap_per_impulse = self.dt * port.rate_per_impulse
        port.gap_per_projection = port.rate_per_impulse
        port.predicted_gap = math.inf
        # The compliance over gap and pushed row is symmetric and positive, as that of a body is.
        port.pushed_per_push = 0.5 * right.element_stiffness
        port.pushed_per_force = port.gap_per_push = 0.3 * math.sqrt(port.gap_per_force * port.pushed_per_push)
        if not opened:
            port.pushed, port.free_pushed = random.normal(0.0, 4e4, 2)
        plain(fill_acting)(port, load_point)
        plain(fill_acting_push)(port, load_point)
        port.parameters[: len(start.parameters)] = [*start.parameters]
        port.memory[: len(start.memory)] = [*start.memory]
        for number, reading in enumerate(start.readings):
            scale = {"velocity": 1.0, "stress": 4e7, "force": 4e4, "strain": 2e-4, "displacement": 1e-7}
            port.readings[number] = random.normal(
                0.0, 1.0 if isinstance(reading, Arriving) else scale[reading.quantity]
            )
        return port

    def reply_to(self, port: Port, address: int | None = None) -> Reply:
        """Return the reply of the law, called as plain Python or by C address."""
        reply = Reply()
        reply.memory[:] = [*port.memory]
        if address is None:
            type(self.part).respond(port, reply)
        else:
            kind = ctypes.CFUNCTYPE(None, ctypes.POINTER(Port), ctypes.POINTER(Reply))
            kind(address)(ctypes.byref(port), ctypes.byref(reply))
        return reply

    def test_it_has_a_description_and_a_source(self) -> None:
        described(self.part)

    def test_its_facts_have_the_right_types(self) -> None:
        kind = type(self.part)
        assert isinstance(kind.needs, frozenset)
        assert all(isinstance(level, Level) for level in kind.needs)
        for fact in (
            kind.compiled,
            kind.answers_force,
            kind.trial_at_end,
            kind.fixed_step,
            kind.hard,
            kind.smooth,
            kind.holds_position,
            kind.two_sided,
            kind.moves_faces,
            kind.zero_apart,
            kind.acts_at_start,
        ):
            assert isinstance(fact, bool)
        assert kind.gains_energy >= 0.0
        fields = ", ".join(field.name for field in dataclasses.fields(self.part) if field.init)  # type: ignore[arg-type] # dataclasses
        used = not fields or kind.begin is not AbstractContactLaw.begin
        assert used, f"it has options ({fields}) and no `begin` that returns them as Start(parameters=(...))"

    def test_its_branches_answer_as_it_does(self) -> None:
        """Compare the force with that of its branches in random motions.

        It is for laws that are linear between changes of branch, for which the exact solver uses these branches.
        """
        table = self.part.branches()
        if table is None or table.rigid:
            return
        random = np.random.default_rng(9)
        for _ in range(MOTIONS):
            port, follower = self.port(random), Follower(table)
            port.gap_per_force = port.rate_per_force = 0.0  # the motion is given
            plain(fill_acting)(port, 0.0)
            size, last = 10.0 ** random.uniform(-7.0, -2.0), 0.0
            for _ in range(PORTS):
                approach = last + size * float(random.normal())
                rate = (approach - last) / self.dt * 10.0 ** random.uniform(-6.0, 0.0)
                port.gap = port.free_gap = -approach
                port.acting_rate = -rate
                reply = self.reply_to(port)
                follower.move(last, approach, rate)
                scale = table.elastic * (abs(approach) + abs(last) + abs(follower.set))
                expected = follower.force(approach, rate)
                damped = max(branch.damping for branch in table.branches) * abs(rate)
                text = f"the force [N] less that of its branch '{follower.branch.name}'"
                at_most(abs(reply.force - expected), 1e-10 * (scale + damped), text)
                if (at := self.part.set_of([*reply.memory])) is not None:
                    slack = 1e-10 * (abs(approach) + abs(last) + abs(at))
                    at_most(abs(at - follower.set_at(approach)), slack, "its set [m] less that of its branch")
                port.memory[:], last = [*reply.memory], approach

    def test_its_power_force_is_its_reply(self) -> None:
        """Compare the reply with K d^n for a force at the step's start.

        It is for laws that rows of beads use in this form.
        """
        start = type(self.part).begin(self.part, *self.sides(), self.dt)
        power = self.part.power_force(start)
        if power is None:
            return
        random = np.random.default_rng(11)
        assert power.stiffness > 0.0
        assert power.exponent >= 1.0
        assert power.coarse <= power.most
        for _ in range(PORTS):
            port = self.port(random)
            # So little compliance that no step is too long for the law.
            port.jump_in_force, port.in_contact = 1.0, 0.0
            overlap = float(random.uniform(-1.0, 1.0)) * 1e-7
            port.gap, port.free_gap = -overlap, -overlap + self.dt * port.gap_rate
            port.gap_per_force = port.rate_per_force = 0.0
            plain(fill_acting)(port, 0.0)
            expected = power.stiffness * max(0.0, overlap) ** power.exponent
            reply = self.reply_to(port)
            assert reply.failed == 0.0
            at_most(abs(reply.force - expected), 1e-12 * expected, "the force [N] less K d^n")
            assert reply.impulse == reply.projection == reply.push == 0.0
            assert reply.dissipated == 0.0

    def test_its_spring_is_its_reply(self) -> None:
        """Compare the signed force of closed faces at one instant with k d + c d', which the exact solver uses."""
        sides, kind = self.sides(), type(self.part)
        spring = self.part.spring(*sides, self.dt)
        if spring is None:
            return
        stiffness, damping = spring
        contact = InstantContact(self.part, "a|b", kind.begin(self.part, *sides, self.dt), self.dt)
        random = np.random.default_rng(14)
        contact.close(0.0, -1.0, 1e-12)
        for _ in range(PORTS):
            overlap, rate = float(random.uniform(0.0, 1e-5)), float(random.normal())
            found = contact.evaluate(-overlap, -rate).trial
            size = stiffness * overlap + damping * abs(rate)
            text = f"the trial force [N] less that of its `spring`, {stiffness:.4g} N/m and {damping:.4g} N s/m,"
            at_most(abs(found - stiffness * overlap - damping * rate), 1e-12 * size, text)

    def test_a_smooth_force_is_that_of_an_instant_if_declared(self) -> None:
        """Check that the force of closed faces depends on no step length and on no earlier evaluation.

        Adaptive solvers evaluate it at any instant, often, and keep its memory at the ends of steps.
        """
        if not self.part.smooth:
            return
        start, random = type(self.part).begin(self.part, *self.sides(), self.dt), np.random.default_rng(15)
        one, other = (InstantContact(self.part, "a|b", start, dt) for dt in (self.dt, 3.7 * self.dt))
        for contact in (one, other):
            contact.close(0.0, -1.0, 1e-12)
        for _ in range(PORTS):
            gap, rate = -float(random.uniform(0.0, 1e-5)), float(random.normal())
            first = one.evaluate(gap, rate).trial
            one.carry(gap, rate)
            for name, again in (("again", one), ("with another dt", other)):
                change = abs(again.evaluate(gap, rate).trial - first)
                at_most(change, 1e-12 * abs(first), f"smooth: the change of its force [N] where it is evaluated {name}")

    def test_apart_its_reply_is_zero_if_declared(self) -> None:
        """Check that the reply is zero in steps that begin and end apart.

        Two such steps follow any contact; a run does not evaluate the law in further ones. The first may book the
        stored energy of the contact.
        """
        if not self.part.zero_apart:
            return
        random = np.random.default_rng(12)
        for _ in range(PORTS):
            memory = [*self.port(random).memory]
            for apart in (0, 0, 1, 2):
                port, before = self.port(random, apart=apart > 0), memory
                port.memory[:] = memory
                reply = self.reply_to(port)
                memory = [*reply.memory]
                if apart == 0:
                    continue
                acting = (reply.force, reply.impulse, reply.projection, reply.push, reply.offset)
                assert acting == (0.0, 0.0, 0.0, 0.0, 0.0), "zero_apart: it acts on faces that are apart"
                assert reply.stored == 0.0, f"zero_apart: apart it stores {reply.stored:.4g} J"
                assert reply.in_contact == reply.failed == 0.0
                if apart == 2:
                    booked = reply.dissipated + reply.unresolved
                    assert booked == 0.0, f"zero_apart: it loses {booked:.4g} J in a second step apart"
                    assert memory == before, "zero_apart: its memory changes in a second step apart"

    def test_same_port_same_reply_and_the_port_is_left_alone(self) -> None:
        random = np.random.default_rng(1)
        for _ in range(PORTS):
            port = self.port(random)
            before = bytes(port)
            one, other = self.reply_to(port), self.reply_to(port)
            assert bytes(port) == before, "respond writes into its port"
            assert bytes(one) == bytes(other), "respond remembers something outside its memory"

    def test_plain_compiled_and_called_back_its_replies_agree(self) -> None:
        if not COMPILED:
            return  # there is only plain Python to compare with
        kind, random = type(self.part), np.random.default_rng(4)
        addresses = [LawAddress(kind.respond, as_compiled) for as_compiled in {False, kind.compiled}]
        for _ in range(PORTS):
            port = self.port(random)
            plain = self.reply_to(port)
            for address in addresses:
                reply = self.reply_to(port, address.value)
                assert address.raised is None
                for name in ("force", "impulse", "trial", "stored", "dissipated", "unresolved", "in_contact"):
                    one, other = float(getattr(plain, name)), float(getattr(reply, name))
                    # A compiler may contract a product and a sum: a few roundings of the terms, which may cancel.
                    size = {"stored": 1e-3, "dissipated": 1e-3, "unresolved": 1e-3}.get(name, 1e4)
                    at_most(abs(one - other), 1e-12 * max(abs(one), size), f"the difference of its {name}")


class ContactLawContract(LawContract):
    """Properties of every law of a contact between faces that may part."""

    def test_it_never_pulls_and_never_books_a_negative_loss(self) -> None:
        random = np.random.default_rng(2)
        for _ in range(PORTS):
            port = self.port(random)
            reply = self.reply_to(port)
            assert reply.failed == 0.0
            assert reply.force >= 0.0, f"it pulls: its force is {reply.force:.4g} N, and compression is positive"
            assert reply.impulse >= 0.0, f"it pulls: its impulse is {reply.impulse:.4g} N s"
            # A law that pushes along a reading holds part of that body's own strain energy, of either sign.
            assert reply.stored >= 0.0 or reply.push != 0.0, f"it stores {reply.stored:.4g} J"
            assert reply.unresolved >= 0.0, f"unresolved is {reply.unresolved:.4g} J, and may not be negative"
            # Of contacts that collide together, one that was parting may have a negative share of a loss of all.
            shared = self.part.shares_losses and port.gap_rate > 0.0
            assert reply.dissipated >= 0.0 or shared, f"dissipated is {reply.dissipated:.4g} J, and may not be negative"
            assert reply.in_contact in (0.0, 1.0), f"in_contact is {reply.in_contact:.4g}, neither 0 nor 1"
            assert math.isfinite(reply.force + reply.impulse + reply.trial)

    def test_it_reports_the_contact_of_faces_that_it_presses(self) -> None:
        """Check that faces that overlap at both ends of a step are in contact.

        Otherwise each step counts as a contact.
        """
        random = np.random.default_rng(13)
        for _ in range(PORTS):
            port = self.port(random)
            reply = self.reply_to(port)
            end = port.free_gap + port.gap_per_force * reply.force + port.gap_per_push * reply.push
            if reply.force > 0.0 and port.gap < 0.0 and end < 0.0:
                text = f"it presses with {reply.force:.4g} N on faces that overlap, but in_contact is not 1"
                assert reply.in_contact == 1.0, text

    def test_far_apart_its_reply_is_zero(self) -> None:
        random = np.random.default_rng(3)
        for _ in range(PORTS):
            reply = self.reply_to(self.port(random, opened=True))
            for name in ("force", "impulse", "stored", "dissipated", "in_contact"):
                value = getattr(reply, name)
                assert value == 0.0, f"of faces that are 1 mm apart its {name} is {value:.4g}"
