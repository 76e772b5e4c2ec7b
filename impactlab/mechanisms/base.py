"""Base class of mechanisms: bodies whose mass matrix and forces follow from their position."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

from impactlab.errors import CaseError
from impactlab.types import Array, Quantity


class Reading(NamedTuple):
    """A number that `terms` gives beside the equations of motion.

    It is recorded in every run with its rate. A position [m] is a face that contacts name, ``press.slider``; an angle
    [rad] is recorded only.
    """

    name: str
    is_angle: bool = False


class Drive(NamedTuple):
    """A coordinate whose rate is given: constant, or reached smoothly within a time.

    Within it the rate is rate (t/T - sin(2 pi t/T)/(2 pi)), which starts and ends without a jump of the acceleration
    (Kane, Ryan and Banerjee 1987).
    """

    coordinate: int
    rate: float  # rad/s or m/s
    within: float = 0.0  # s; 0: from the start


class Motion(NamedTuple):
    """A mechanism in numbers, at t = 0."""

    parameters: Array  # whatever `terms` reads; it may keep intermediate numbers there, too
    position: Array  # (n,) of the coordinates p
    velocity: Array  # (n,)
    stiffness: Array  # (n, n) N/m, constant: of the elastic forces -K p among those of `terms`; zero if nothing deforms
    rate: float  # rad/s, bound on the rates of turning: (rate dt)^2 scales the declared error of the energy
    frequency: float = 0.0  # rad/s, the highest of all deformations
    drives: tuple[Drive, ...] = ()


class AbstractMechanism(ABC):
    """A mechanism, as a case file chooses it: a frozen dataclass of options.

    M(p) p'' = force(t, p, v) + rows^T F with the coordinates p, their rates v and the contact forces F.
    """

    citations: ClassVar[tuple[str, ...]] = ()
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)  # options that its contract suite tries, one by one

    @property
    @abstractmethod
    def readings(self) -> tuple[Reading, ...]:
        """Readings in the order in which `terms` writes them; one at least is a position."""

    @property
    @abstractmethod
    def mass(self) -> float:
        """Mass of all that moves [kg], by which warnings scale an impulse."""

    @abstractmethod
    def motion(self, gravity: tuple[float, float]) -> Motion:
        """Return the mechanism in numbers.

        ``gravity`` is (x, y) [m/s2]. Raise `CaseError` where it cannot be built.
        """

    def internal_row(self, gauge: int, quantity: Quantity) -> Array:
        """Return the row (n,) of a bending moment or shear force over the coordinates p; ``gauge`` is its number."""
        raise CaseError(f"a mechanism of this kind has no {quantity}", remedy="Remove the probe.", path="probes")

    @staticmethod
    @abstractmethod
    def terms(
        parameters: Array, t: float, p: Array, v: Array, mass: Array, force: Array, rows: Array, values: Array,
        rates: Array, /,
    ) -> None:  # fmt: skip
        """Write the equations of motion at one state.

        It is compiled by numba: use loops, floats and `math` only. Written are the mass matrix (n n,), the force (n,)
        and, of r readings, rows (r n,), values (r + 1,) and rates (r,). The last of the values is the work of loads
        that follow from the position, such as gravity [J]. Where ``mass`` is empty only the readings are needed.
        Everything is written, nothing added.
        """
