"""Contract suite of links: laws that act in both directions and may remember."""

from __future__ import annotations

import math

import numpy as np

from impactlab.numerics.addresses import COMPILED
from impactlab.numerics.compiling import plain
from impactlab.numerics.law_address import LawAddress
from impactlab.simulate.stepping.ports import fill_acting
from impactlab.testing.contracts.common import PORTS, at_most
from impactlab.testing.contracts.laws import LawContract

WALKS = 40  # random motions of a link, each with an amplitude of its own
STEPS = 60  # of a motion
SMALL, LARGE = 1e-8, 1e-1  # m, amplitudes: from elastic to far beyond any yield
ROUNDING = 1e-11  # of the largest energy that takes part in a motion


class LinkContract(LawContract):
    """Properties of every link: passive in any motion, energy balanced with work."""

    def walked(self, random: np.random.Generator) -> tuple[list[float], list[float], list[float], float]:
        """Return work, stored energy and loss of each step of a random motion.

        The force is a mean over steps. The first stored energy is that at the start. The last number is the largest
        energy that took part. The law is called as runs call it, compiled where it is.
        """
        law = LawAddress(type(self.part).respond, True) if COMPILED and self.part.compiled else None
        address = None if law is None else law.value
        port = self.port(random)
        port.gap = port.free_gap = port.gap_rate = port.free_gap_rate = port.in_contact = 0.0
        plain(fill_acting)(port, 0.0)
        rate_per_force, port.acting_rate_per_force = port.rate_per_force, 0.0
        port.gap_per_force = port.rate_per_force = 0.0
        stored, work, loss, largest = [self.reply_to(port, address).stored], list[float](), list[float](), 1e-300
        port.rate_per_force, port.gap_per_force = rate_per_force, 0.5 * self.dt * rate_per_force  # midpoint rule
        size = SMALL * (LARGE / SMALL) ** random.random()
        for _ in range(STEPS):
            port.free_gap = port.gap + size * random.normal()
            port.free_gap_rate = 2.0 * (port.free_gap - port.gap) / self.dt - port.gap_rate
            plain(fill_acting)(port, 0.5)
            reply = self.reply_to(port, address)
            end = port.free_gap + port.gap_per_force * reply.force
            work.append(-reply.force * (end - port.gap))
            stored.append(reply.stored)
            largest = max(largest, reply.stored, abs(reply.force) * max(abs(end), abs(port.gap), abs(port.free_gap)))
            loss.append(reply.dissipated)
            port.gap_rate = port.free_gap_rate + port.rate_per_force * reply.force
            port.gap, port.in_contact = end, reply.in_contact
            port.memory[:] = [*reply.memory]
        return work, stored, loss, largest

    def test_it_is_joined_from_the_start_and_books_no_negative_loss(self) -> None:
        random = np.random.default_rng(2)
        for _ in range(PORTS):
            reply = self.reply_to(self.port(random))
            assert reply.failed == 0.0
            assert reply.impulse == reply.projection == 0.0, "a link replies by a force alone"
            assert reply.unresolved >= 0.0, f"unresolved is {reply.unresolved:.4g} J, and may not be negative"
            assert reply.dissipated >= 0.0, f"dissipated is {reply.dissipated:.4g} J, and may not be negative"
            assert math.isfinite(reply.force + reply.trial + reply.stored)

    def test_it_gives_no_energy_in_any_motion(self) -> None:
        """The energy given back was taken before, or held at the start."""
        random = np.random.default_rng(5)
        for _ in range(WALKS):
            work, stored, _, largest = self.walked(random)
            given = stored[0] + np.cumsum(work)
            at_most(-float(given.min()), ROUNDING * largest, "the energy that it gives [J]")

    def test_work_is_the_change_of_stored_energy_and_the_loss(self) -> None:
        random = np.random.default_rng(6)
        for _ in range(WALKS):
            work, stored, loss, largest = self.walked(random)
            balance = np.diff(stored) + loss - work
            at_most(float(np.abs(balance).max()), ROUNDING * largest, "the error of the balance of a step [J]")
            assert min(loss) >= 0.0, f"the loss of a step is {min(loss):.4g} J, and may not be negative"
            assert min(stored) >= 0.0, f"it stores {min(stored):.4g} J, and may not store less than 0"

    def test_it_shares_its_totals_between_pieces(self) -> None:
        """Several pieces in one place reply as the whole law.

        A law without totals raises an error.
        """
        from_whole = self.part
        try:
            piece = from_whole.divided(4)
        except Exception as error:  # noqa: BLE001 - its error is examined
            assert "cannot be shared" in str(error)  # noqa: PT017 - plain asserts, outside of pytest
            return
        random = np.random.default_rng(7)
        for _ in range(PORTS):
            port = self.port(random)
            plain(fill_acting)(port, 0.0)
            port.acting_rate_per_force = 0.0  # the motion is given
            whole = self.reply_to(port).force
            start = piece.begin(*self.sides(), self.dt)
            port.parameters[: len(start.parameters)] = [*start.parameters]
            part = self.reply_to(port).force
            limit = 1e-12 * max(abs(whole), 1e-300)
            at_most(abs(4.0 * part - whole), limit, "the force [N] of four pieces less that of the whole")
