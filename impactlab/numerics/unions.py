"""Groups of things that pairs of them join."""

from __future__ import annotations

from typing import Generic, TypeVar

T = TypeVar("T")


class Unions(Generic[T]):
    """Things, each alone at first, that are joined pair by pair."""

    def __init__(self) -> None:
        self._next: dict[T, T] = {}  # towards the leader of the group

    def leader(self, one: T) -> T:
        """Return the member that represents the group of another one."""
        row = []
        while one in self._next:
            row.append(one)
            one = self._next[one]
        self._next.update(dict.fromkeys(row, one))  # so that a long chain is walked once
        return one

    def join(self, one: T, other: T) -> bool:
        """Join the groups of two things; return whether they were apart."""
        first, second = self.leader(one), self.leader(other)
        if first != second:
            self._next[first] = second
        return first != second
