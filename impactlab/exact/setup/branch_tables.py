"""Branches of laws as the tables of the march."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from impactlab.exact.kernel import MAX_DEPTH
from impactlab.exact.setup.network import Log
from impactlab.types import Array, Branch, Branches

# Columns of a row with a branch; from UNTIL on WIDE numbers for each of its ends.
STIFFNESS, DAMPING, ACTS, ENDS, UNTIL = 0, 1, 2, 3, 4
OF, WAY, VALUE, SLOPE, REMEMBERED, NEXT, WIDE = 0, 1, 2, 3, 4, 5, 6
STATIC, FORCE, APPROACH, RATE = 0.0, 1.0, 2.0, 3.0
QUANTITIES = {"static": STATIC, "force": FORCE, "approach": APPROACH, "rate": RATE}
FIRST = MAX_DEPTH + 1  # row of the stack


def row_of(branch: Branch, first: int, width: int) -> Array:
    """Return a branch as a row, (width,).

    ``first`` is the row of the first branch of its law.
    """
    row = np.zeros(width)
    row[:UNTIL] = -1.0 if branch.rigid else branch.stiffness, branch.damping, branch.acts, len(branch.ends)
    for number, until in enumerate(branch.ends):
        at = UNTIL + WIDE * number
        way = 1.0 if until.rises else -1.0
        row[at : at + WIDE] = (
            QUANTITIES[until.of], way, until.value, until.slope, until.remembered, first + until.next,
        )  # fmt: skip
    return row


def with_branches(log: Log, laws: Sequence[Branches | None]) -> Log:
    """Return the log with the branches of its contacts.

    Each contact is in the first branch of its law; None stands for a law without branches.
    """
    first_of = dict[Branches, int]()  # contacts of one law share its rows
    for law in laws:
        if law is not None:
            first_of.setdefault(law, FIRST + sum(len(other.branches) for other in first_of))
    rows = [(branch, first) for law, first in first_of.items() for branch in law.branches]
    stack = log.memory.stack
    stack = np.concatenate([stack, [row_of(branch, first, stack.shape[1]) for branch, first in rows]])
    for number, law in ((number, law) for number, law in enumerate(laws) if law is not None):
        branch, contact = law.branches[law.first], log.contacts[number : number + 1]
        contact["branch"], contact["closed"] = first_of[law] + law.first, branch.acts
        contact["elastic"], contact["set"], contact["largest"] = law.elastic, law.set, law.largest
        contact["kept"] = law.kept
        contact["constant"] = -law.elastic * law.set if branch.stiffness == law.elastic and not law.rigid else 0.0
    for junction in log.junctions:
        own = log.contacts["branch"][junction["first_contact"] : junction["last_contact"]]
        junction["branched"] = int(np.any(own >= 0))
    names = tuple(branch.name for branch, _ in rows)
    return log._replace(memory=log.memory._replace(stack=stack), names=names, begins=log.contacts.copy())
