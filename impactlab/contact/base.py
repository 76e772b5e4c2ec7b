"""What a contact law is."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from impactlab.types import Level, Noted, Port, Reply, Restitution, SideFacts, Start


class AbstractContactLaw(ABC):
    """A contact law: given what one contact sees in one step, its force.

    To write one, supply:

    1. ``needs``: which compliances ``respond`` divides by; a pair that lacks one is refused before the first step.
    2. ``citations``: keys in citations.bib of the sources.
    3. ``begin``: constants, memory and readings, from the facts of both sides.
    4. ``respond``: the answer of one step, a plain function of two records (`impactlab.types.Port`, `Reply`). It is
       compiled by numba unless ``compiled`` is False, so it uses floats and ``math`` only. It may be called any
       number of times in a step and writes nothing but the reply.

    A law is a frozen dataclass; its fields, made by `impactlab.types.option`, are what a case file may give. The first
    line of its docstring is what a listing shows.
    """

    needs: ClassVar[frozenset[Level]]
    citations: ClassVar[tuple[str, ...]] = ()
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)  # options that its contract suite tries, one by one
    compiled: ClassVar[bool] = True  # False: respond stays plain Python, called back from the loop
    answers_force: ClassVar[bool] = True  # False: impulses only, no force history
    trial_at_end: ClassVar[bool] = False  # True: its trial force belongs to the end of the step, not to where it acts
    fixed_step: ClassVar[bool] = False  # True: it counts on steps of one length, so none can be cut at an event
    hard: ClassVar[bool] = (
        False  # True: it approximates the hard unilateral contact, whose exact answer is its reference
    )
    is_spring: ClassVar[bool] = (
        False  # True: `spring` has constants; the continuous model solves it from event to event
    )
    serves_massless: ClassVar[bool] = False  # True: it answers a massless face by its flexibility (`Port.flexibility`)
    holds_position: ClassVar[bool] = False  # True: a hard position constraint, which makes some schemes gain energy
    closes_by_force: ClassVar[bool] = False  # True: it needs no impulse where `Port.jump_in_force` says so
    smooth: ClassVar[bool] = False  # True: the force follows from gap and rate alone; steps may have any length
    noted: ClassVar[tuple[Noted, ...]] = ()  # what it counts in its memory and the run tells as warnings
    why_failed: ClassVar[str] = "a contact law gave no answer"  # text of the StepError where the reply is failed
    gains_energy: ClassVar[float] = 0.0  # declared bound on the energy gain, relative; inf where there is none
    gain_remedy: ClassVar[str] = ""  # remedy of a run that gained too much; "" where a smaller step or softness helps

    @abstractmethod
    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        """Return constants, first memory and readings; raise `PairingError` where the law cannot serve the sides."""

    @staticmethod
    @abstractmethod
    def respond(port: Port, reply: Reply) -> None:
        """Write the reply of one step: force [N] or impulse [N s], signed trial force, phase, energies, memory."""

    def acting(self, left: SideFacts, right: SideFacts) -> AbstractContactLaw:
        """Return the law that acts on these sides: this one, but for faces on which it comes down to another."""
        return self

    def needs_second_differences(self) -> bool:
        """Return whether its condition on two steps holds only where displacements follow from second differences."""
        return False

    def stiffest(self, left: SideFacts, right: SideFacts, dt: float) -> float:
        """Return the stiffness [N/m] that an explicit step must resolve; 0 where there is none or none is known."""
        spring = self.spring(left, right, dt)
        return 0.0 if spring is None else spring[0]

    def closed_gains(self, start: Start) -> tuple[float, float] | None:
        """Return force per overlap [N/m] and push per gap of a closed contact that also pushes along its readings.

        None where the law does not push, or where its force is not S less a share of the gap (see `closed_limit`).
        """
        return None

    def spring(self, left: SideFacts, right: SideFacts, dt: float) -> tuple[float, float] | None:
        """Return stiffness [N/m] and damping [N s/m] where the law is a constant spring and dashpot, else None.

        The continuous model solves hard contacts and constant springs from event to event, any other law by steps.
        """
        return None

    def stiffness_at(self, overlap: float, left: SideFacts, right: SideFacts) -> float | None:
        """Return how the force rises with an overlap [m] there [N/m]; inf of a hard law, None where it is not known."""
        spring = self.spring(left, right, math.nan)
        return math.inf if self.hard else None if spring is None else spring[0]

    @property
    def force_jumps(self) -> bool:
        """Whether the force jumps when the faces meet at a speed, as that of a dashpot or of a hard contact."""
        return self.hard

    def restitutions(self) -> Restitution | None:
        """Return the restitution between rigid bodies where the law has one; a summary tells it."""
        return None
