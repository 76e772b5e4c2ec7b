"""Tables of laws that are linear between changes of branch, for the exact solver."""

from __future__ import annotations

import math

from impactlab.types import Branch, Branches, Until


def yielding(
    stiffness: float, yield_force: float, tangent: float = 0.0, damping: float = 0.0, at: float = 0.0
) -> Branches:
    """Return a spring that yields in both directions with kinematic hardening, and a dashpot.

    Both yield lines of slope ``tangent`` stay where they are, at +-F (1 - k_t/k) + k_t a [N]; ``at`` is the set at
    t = 0 [m].

    References
    ----------
    Prager1956; Smith1960 (the soil spring, without hardening).
    """
    line = yield_force * (1.0 - tangent / stiffness)
    ends = (Until("static", True, 1, line, tangent), Until("static", False, 2, -line, tangent))
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
    """Return a spring that yields in both directions, with isotropic hardening.

    It yields at the largest force so far, in either direction.

    References
    ----------
    Kolsky1949 (the specimen between two bars, in compression).
    """
    ends = (Until("static", True, 1, remembered=1.0), Until("static", False, 2, remembered=-1.0))
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
    """Return a spring that yields in compression and never pulls, with a dashpot.

    The dashpot acts while the faces touch. Where the total of spring and dashpot would pull, the faces follow each
    other without a force (``let go``) until the spring is unloaded; then they part, and the hole stays.

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
    """Return a spring that unloads and reloads along a steeper line, and never pulls.

    It loads along a line through zero. The steeper line passes through the deepest point so far: it begins there, where
    the rate of approach falls through zero.

    References
    ----------
    Smith1960 (cushions); HustrulidFairhurst1971 (bit and rock).
    """
    if unloading == stiffness:
        loads = Branch("loads", stiffness, 0.0, (Until("static", False, 1),))
        return Branches((loads, Branch("open", 0.0, 0.0, (Until("approach", True, 0),), acts=False)), stiffness, 1)
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
