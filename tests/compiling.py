"""Kernels compiled once where two workers start without compiled code: a half in each.

Neither waits for the other: tests are handed out when both have collected them, one after its half, one before it.
"""

from __future__ import annotations

import contextlib

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.errors import ImpactlabError
from impactlab.integrators.midpoint import Midpoint
from impactlab.models.continuous import Continuous
from impactlab.models.modal import Modal
from impactlab.numerics.addresses import COMPILED
from impactlab.numerics.cache import is_kept
from impactlab.numerics.law_address import LawAddress
from impactlab.scene.method import StepRule
from impactlab.simulate import run
from impactlab.simulate.stepping import located, loop
from impactlab.testing.scenes import mass_on_rod
from impactlab.testing.trace import begun
from studies import matrix

MODEL, LAW, SCHEME = "modal 40", "penalty", "newmark"


def compile_half(number: int) -> None:
    """Compile the loop that cuts steps at events and the exact solver (0), or laws, schemes and whole steps (1)."""
    if not COMPILED or is_kept(loop.advance_dated if number else located.advance_located):
        return
    rest = AdditionDeletion(), Midpoint(), StepRule(dt=1e-6)
    if number == 0:
        run(*mass_on_rod(Modal(modes=10), *rest, events="located"))
        run(*mass_on_rod(Continuous(), *rest))
    else:
        for law in matrix.laws().values():  # first, alone: the other half compiles the start of a run meanwhile
            LawAddress(law.respond, law.compiled)
        cells = [(MODEL, law, SCHEME) for law in matrix.laws()] + [(MODEL, LAW, scheme) for scheme in matrix.schemes()]
        for cell in cells:
            with contextlib.suppress(ImpactlabError):
                begun(matrix.scene_of(*cell, trips=0.1))
        matrix.outcome(MODEL, LAW, SCHEME, trips=0.1, timed=False)
