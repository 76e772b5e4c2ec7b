"""A table of branches, the `branches` of a law, followed along a given motion in plain Python."""

from __future__ import annotations

from impactlab.types import Branches, Until

MAX_CHANGES = 50  # of branch in one stretch of a motion
ROUNDING = 1e-12  # of the size of a quantity: passing a value by less is no change


class Follower:
    """A law that is linear between changes of branch, followed in a motion.

    It is written for the contract suites, apart from the compiled code of the exact solver.
    """

    def __init__(self, law: Branches) -> None:
        self.law, self.branch = law, law.branches[law.first]
        self.set, self.largest = law.set, law.largest  # m, N
        self.constant = -law.elastic * law.set if self.branch.stiffness == law.elastic else 0.0  # N

    def static(self, approach: float) -> float:
        """Return the static force at an approach [N]."""
        return self.constant + self.branch.stiffness * approach

    def force(self, approach: float, rate: float) -> float:
        """Return the force on the faces [N]."""
        return self.static(approach) + self.branch.damping * rate if self.branch.acts else 0.0

    def _value(self, until: Until) -> float:
        return until.value + until.remembered * (self.set if until.of == "approach" else self.largest)

    def _short(self, until: Until, approach: float, rate: float) -> float:
        """Return the distance of a quantity from the value at which it ends.

        It is below zero beyond that value.
        """
        quantity = {
            "static": self.static(approach) - until.slope * approach,
            "force": self.static(approach) + self.branch.damping * rate,
            "approach": approach,
            "rate": rate,
        }[until.of]
        short = self._value(until) - quantity
        return short if until.rises else -short

    def move(self, start: float, end: float, rate: float) -> None:
        """Follow the faces between approaches [m] at a rate [m/s] of that sign."""
        at = start
        for _ in range(MAX_CHANGES):
            found: tuple[float, Until] | None = None
            for until in self.branch.ends:
                here, there = self._short(until, at, rate), self._short(until, end, rate)
                size = abs(self.constant) + self.branch.stiffness * (abs(at) + abs(end)) + abs(self._value(until))
                if there >= -ROUNDING * (size if until.of in ("static", "force") else abs(at) + abs(end)):
                    continue
                share = 0.0 if here <= 0.0 else here / (here - there)
                if found is None or share < found[0]:
                    found = share, until
            if found is None:
                return
            at += found[0] * (end - at)
            self._change(found[1], at)
        raise AssertionError(f"branches follow one another without end: {self.branch.name}")

    def _change(self, until: Until, at: float) -> None:
        approach, static = at, self.static(at)
        if until.of == "static":
            static = self._value(until) + until.slope * at
        elif until.of == "approach":
            approach = self._value(until)
            static = self.static(approach)
        self.largest = max(self.largest, abs(static))
        self.branch = self.law.branches[until.next]
        self.constant = static - self.branch.stiffness * approach
        if self.branch.stiffness == self.law.elastic:
            self.set = -self.constant / self.law.elastic

    def set_at(self, approach: float) -> float:
        """Return the set at an approach [m]."""
        yields = self.branch.acts and self.branch.stiffness != self.law.elastic
        return approach - self.static(approach) / self.law.elastic if yields else self.set
