"""Branches of laws as the tables of the march."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from impactlab.exact.arrays import BranchRecord, UntilRecord
from impactlab.exact.network import Log
from impactlab.numerics.records import columns
from impactlab.types import Branches

OF = {"static": 0, "force": 1, "approach": 2, "rate": 3}


def with_branches(log: Log, laws: Sequence[Branches | None]) -> Log:
    """Return the log with the branches of its contacts, each in the first one; None stands for a law without."""
    given = [law for law in laws if law is not None]
    first_of = dict[Branches, int]()  # contacts of one law share its rows
    for law in given:
        first_of.setdefault(law, sum(len(other.branches) for other in first_of))
    rows = [(branch, first) for law, first in first_of.items() for branch in law.branches]
    taken, branches = columns(BranchRecord, len(rows))
    taken_ends, ends = columns(UntilRecord, sum(len(branch.ends) for branch, _ in rows))
    at = 0
    for number, (branch, first) in enumerate(rows):
        stiffness = -1.0 if branch.rigid else branch.stiffness
        branches[number] = stiffness, branch.damping, branch.acts, at, at + len(branch.ends)
        for until in branch.ends:
            way = 1.0 if until.rises else -1.0
            ends[at] = OF[until.of], way, until.value, until.slope, until.remembered, first + until.next
            at += 1
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
    memory = log.memory._replace(branches=taken, untils=taken_ends)
    return log._replace(memory=memory, branches=branches, names=names, begins=log.contacts.copy())
