"""Laws that are linear between changes of branch, as tables that the exact solver runs without knowing the law."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple


class Until(NamedTuple):
    """What ends a branch: a quantity that passes a value, and the branch that follows.

    ``of`` is the approach of the faces a (the gap with its sign turned) [m], its rate v [m/s], the static force
    f0 + k a of the branch [N], or the force f0 + k a + d v, that of the branch also where it does not act. Of the
    static force a line may be given: the value is then ``value + slope a``.

    What the law remembers may move a value: with ``remembered`` 1 the set [m] is added to that of an approach, and the
    largest static force at an end of a branch so far [N] to that of a static force; with -1 it is taken from it.

    The static force of the next branch begins at the value that was passed, or where it is if another quantity ended
    the branch: f0 follows, and with it sets and deepest points.
    """

    of: Literal["static", "force", "approach", "rate"]
    rises: bool  # passes the value from below; else from above
    next: int  # number of the branch that follows
    value: float = 0.0  # N, m or m/s
    slope: float = 0.0  # N/m
    remembered: float = 0.0


class Branch(NamedTuple):
    """A branch of a law: force = f0 + k a + d v, in compression positive. The first end to be met ends it."""

    name: str  # as histories report it
    stiffness: float  # N/m; inf of faces that move as one
    damping: float = 0.0  # N s/m
    ends: tuple[Until, ...] = ()
    acts: bool = True  # False: the faces feel no force

    @property
    def rigid(self) -> bool:
        """Whether the faces move as one."""
        return math.isinf(self.stiffness)


class Branches(NamedTuple):
    """A law that is linear between changes of branch.

    The elastic part gives back f^2/(2 k) and, with kinematic hardening, H s^2/2; all else is loss. The set
    s = a - f/k is that of its slider, which an elastic branch holds.
    """

    branches: tuple[Branch, ...]
    elastic: float  # N/m, k of the elastic part; branches of this stiffness hold the set
    first: int = 0  # branch at t = 0
    set: float = 0.0  # m, at t = 0
    largest: float = 0.0  # N, static force remembered at t = 0
    kept: float = 0.0  # N/m, H of kinematic hardening, which gives its energy back

    @property
    def rigid(self) -> bool:
        """Whether the faces move as one."""
        return math.isinf(self.elastic)


def yielding(
    stiffness: float, yield_force: float, tangent: float = 0.0, damping: float = 0.0, at: float = 0.0
) -> Branches:
    """Return a spring that yields in both directions and hardens kinematically, with a dashpot that acts always.

    Both yield lines of slope ``tangent`` stay where they are, at +-F (1 - k_t/k) + k_t a [N]; ``at`` is the set at
    t = 0 [m].

    References
    ----------
    Prager1956; Smith1960 (the soil spring, without hardening).
    """
    line = yield_force * (1.0 - tangent / stiffness)
    ends = (
        Until("static", True, 1, line, tangent),
        Until("static", False, 2, -line, tangent),
    )
    return Branches(
        (
            Branch("elastic", stiffness, damping, ends),
            Branch("yields", tangent, damping, (Until("rate", False, 0),)),
            Branch("yields in tension", tangent, damping, (Until("rate", True, 0),)),
        ),
        stiffness,
        set=at,
        kept=tangent / (1.0 - tangent / stiffness),
    )


def yielding_both(stiffness: float, yield_force: float, tangent: float) -> Branches:
    """Return a spring that yields in both directions at the largest force so far, so that it hardens the same in both.

    References
    ----------
    Kolsky1949 (the specimen between two bars, in compression).
    """
    ends = (
        Until("static", True, 1, remembered=1.0),
        Until("static", False, 2, remembered=-1.0),
    )
    return Branches(
        (
            Branch("elastic", stiffness, 0.0, ends),
            Branch("yields", tangent, 0.0, (Until("rate", False, 0),)),
            Branch("yields in tension", tangent, 0.0, (Until("rate", True, 0),)),
        ),
        stiffness,
        largest=yield_force,
    )


def one_sided(
    stiffness: float, yield_force: float, tangent: float = 0.0, damping: float = 0.0, at: float = 0.0
) -> Branches:
    """Return a spring that yields in compression and never pulls, with a dashpot while the faces touch.

    Where the total of spring and dashpot would pull, the faces follow each other without a force (``let go``) until the
    spring is unloaded; then they part, and the hole stays.

    References
    ----------
    Smith1960 (the toe of a pile).
    """
    line = yield_force * (1.0 - tangent / stiffness)
    off = Until("force", False, 3) if damping > 0.0 else Until("static", False, 2)
    return Branches(
        (
            Branch("elastic", stiffness, damping, (off, Until("static", True, 1, line, tangent))),
            Branch("yields", tangent, damping, (Until("rate", False, 0),)),
            Branch("open", 0.0, 0.0, (Until("approach", True, 0, remembered=1.0),), acts=False),
            Branch(
                "let go", stiffness, damping,
                (Until("approach", False, 2, remembered=1.0), Until("force", True, 0)), acts=False,
            ),
        ),
        stiffness,
        first=2,
        set=at,
    )  # fmt: skip


def cushion(stiffness: float, unloading: float) -> Branches:
    """Return a spring that loads along one line through zero, unloads and reloads along a steeper one, and never pulls.

    The steeper line passes through the deepest point so far: it begins there, where the rate of approach falls through
    zero.

    References
    ----------
    Smith1960 (cushions); HustrulidFairhurst1971 (bit and rock).
    """
    if unloading == stiffness:
        ends = (Until("static", False, 1),)
        branches = (
            Branch("loads", stiffness, 0.0, ends),
            Branch("open", 0.0, 0.0, (Until("approach", True, 0),), acts=False),
        )
        return Branches(branches, stiffness, first=1)
    branches = (
        Branch("open", 0.0, 0.0, (Until("approach", True, 1),), acts=False),
        Branch("loads", stiffness, 0.0, (Until("rate", False, 2),)),
        Branch(
            "unloads", unloading, 0.0, (Until("static", False, 3), Until("static", True, 1, 0.0, stiffness))
        ),
        Branch("open", 0.0, 0.0, (Until("approach", True, 2, remembered=1.0),), acts=False),
    )  # fmt: skip
    return Branches(branches, unloading)


def joint(stiffness: float, play: float) -> Branches:
    """Return a spring that presses at once and pulls after its play."""
    if play == 0.0:
        return Branches((Branch("elastic", stiffness),), stiffness)
    return Branches(
        (
            Branch("presses", stiffness, 0.0, (Until("static", False, 1),)),
            Branch("has play", 0.0, 0.0, (Until("approach", True, 0), Until("approach", False, 2, -play)), acts=False),
            Branch("pulls", stiffness, 0.0, (Until("static", True, 1),)),
        ),
        stiffness,
        first=1,
    )


BOND = Branches((Branch("holds", math.inf),), math.inf)
"""Two faces that move as one."""
