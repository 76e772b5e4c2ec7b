"""The base class of contact laws."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from impactlab.errors import PairingError
from impactlab.types import Branches, Level, Noted, Port, PowerForce, Reply, Restitution, SideFacts, Start


def needs_waves(law: str, left: SideFacts, right: SideFacts) -> None:
    """Raise `PairingError` where a law that needs the waves of a body meets a mechanism."""
    for facts in (left, right):
        if facts.kind == "mechanism":
            raise PairingError(
                f"law {law!r} needs the waves that arrive at a face, and the face of '{facts.body}' belongs to a "
                "mechanism, whose links all move it",
                remedy="Use law hertz, velocity_complementarity or energy_conserving.",
            )


class AbstractContactLaw(ABC):
    """A contact law: the force of one contact in one step.

    To write one, supply `respond`, sources and class facts. `respond` is a plain function of two records, compiled by
    numba unless ``compiled`` is False: floats and ``math`` only. It may be evaluated often in a step. A law is a frozen
    dataclass; its fields, made by `option`, are options of a case file, and the first line of its docstring is shown in
    listings.
    """

    needs: ClassVar[frozenset[Level]]  # compliances that `respond` uses; continuous bodies have none per impulse
    citations: ClassVar[tuple[str, ...]] = ()  # keys of the sources in citations.bib
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)  # options that its contract suite tries, one by one
    compiled: ClassVar[bool] = True  # False: respond stays plain Python
    answers_force: ClassVar[bool] = True  # False: impulses only, no force history
    trial_at_end: ClassVar[bool] = False  # True: its trial force is that of the end of the step, not of where it acts
    fixed_step: ClassVar[bool] = False  # True: no step is cut at an event
    why_fixed: ClassVar[str] = "needs a constant step"  # the reason, as text after the name of the law
    hard: ClassVar[bool] = False  # True: an approximation of the hard unilateral contact, which then is its reference
    moves_faces: ClassVar[bool] = False  # True: the force follows from the motion that it changes; a face must move
    is_the_contact: ClassVar[bool] = False  # True: hard, and on continuous bodies the hard contact itself
    holds_position: ClassVar[bool] = False  # True: a hard position constraint, under which some schemes gain energy
    smooth: ClassVar[bool] = False  # True: the force of closed faces follows from gap and rate at an instant, whatever
    # the step, beside facts of the touch such as its approach speed
    acts_at_start: ClassVar[bool] = False  # True: as smooth, but from memory too; the force has a value at t = 0
    two_sided: ClassVar[bool] = False  # True: a link, joined from t = 0, whose force has either sign
    noted: ClassVar[tuple[Noted, ...]] = ()  # counts in its memory that a run reports as warnings
    why_failed: ClassVar[str] = "the contact law did not return a force"  # text of the StepError after a failed reply
    zero_apart: ClassVar[bool] = False  # True: not evaluated while the faces stay apart: all of its reply is zero then
    shares_losses: ClassVar[bool] = False  # True: the losses of contacts that collide together count as their sum
    gains_energy: ClassVar[float] = 0.0  # declared bound on the energy gain, relative; inf where none is known
    exact_remedy: ClassVar[str] = ""  # the option that makes it linear between changes of branch, without a full stop
    gain_remedy: ClassVar[str] = ""  # remedy of a run that gained too much; "" where a smaller step helps

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        """Return constants, first memory and readings.

        Raise `PairingError` where the law does not support the sides.
        """
        return Start()

    @staticmethod
    @abstractmethod
    def respond(port: Port, reply: Reply) -> None:
        """Write the reply of one step.

        It has a force [N] or an impulse [N s], the signed trial force, the phase, energies and the memory.
        """

    def acting(self, left: SideFacts, right: SideFacts) -> AbstractContactLaw:
        """Return the law to use on these sides: itself, or another one, for example on massless faces.

        Raise `PairingError` where a face is massless, as here.
        """
        if left.flexibility + right.flexibility > 0.0:
            kind = left.kind if left.flexibility > 0.0 else right.kind
            text = f"this law cannot press on a massless face, and the {kind} has one"
            raise PairingError(text, remedy="Use addition_deletion, or a model whose faces have mass.")
        return self

    def needs_second_differences(self) -> bool:
        """Return whether it needs a scheme whose displacements follow from second differences."""
        return False

    def stiffest(self, left: SideFacts, right: SideFacts, dt: float) -> float:
        """Return the stiffness [N/m] that an explicit step must resolve.

        It is 0 where there is none or none is known.
        """
        spring = self.spring(left, right, dt)
        return 0.0 if spring is None else spring[0]

    def closed_gains(self, start: Start) -> tuple[float, float] | None:
        """Return force per overlap [N/m] and push per gap of a law with `Reply.push`.

        Its force is F = S - gap/g (see `closed_limit`).
        """
        return None

    def power_force(self, start: Start) -> PowerForce | None:
        """Return K and n of a law that is K d^n of the overlap d alone, else None.

        With it rows of beads are stepped at low cost. It must be the force of `respond` in a scheme whose forces act
        at the start of the step.
        """
        return None

    def spring(self, left: SideFacts, right: SideFacts, dt: float) -> tuple[float, float] | None:
        """Return stiffness [N/m] and damping [N s/m] of a constant spring and dashpot.

        On continuous rods such a law is solved exactly. None for any other law.
        """
        return None

    def branches(self) -> Branches | None:
        """Return the table of a law that is linear between changes of branch, else None.

        On continuous rods such a law is solved exactly. A law with a table has no `spring`.
        """
        return None

    @property
    def is_spring(self) -> bool:
        """Whether the law is a constant spring and dashpot.

        On continuous rods it is solved from event to event.
        """
        return type(self).spring is not AbstractContactLaw.spring

    def divided(self, pieces: float) -> AbstractContactLaw:
        """Return the law of one of several equal pieces that share its totals.

        Raise `PairingError` where the law cannot be divided.
        """
        text = "this law cannot be shared between pieces"
        raise PairingError(text, remedy="Use a law of totals, such as smith, elastic_plastic or slack.")

    def set_of(self, memory: Sequence[float]) -> float | None:
        """Return the permanent deformation [m] from the memory of a law, or None."""
        return None

    @property
    def pulls(self) -> bool:
        """Whether its force may be negative, as that of most links."""
        return self.two_sided

    @property
    def remembers(self) -> bool:
        """Whether the law keeps a permanent deformation."""
        return type(self).set_of is not AbstractContactLaw.set_of

    def stiffness_at(self, overlap: float, left: SideFacts, right: SideFacts) -> float | None:
        """Return the tangent stiffness [N/m] at an overlap [m].

        It is inf for a hard law, and None where it is not known.
        """
        spring = self.spring(left, right, math.nan)
        return math.inf if self.hard else None if spring is None else spring[0]

    @property
    def force_jumps(self) -> bool:
        """Whether the force jumps when the faces meet with a velocity, as in a dashpot or a hard contact."""
        return self.hard

    def restitutions(self) -> Restitution | None:
        """Return the restitution between rigid bodies for the summary; None where the law has none."""
        return None
