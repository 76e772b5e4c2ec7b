"""Kernels compiled once where two workers start without compiled code: a half in each.

Tests are handed out when both have collected them, one after its half, one before it. Both need the start of a run: the
first compiles it while the second compiles laws.
"""

from __future__ import annotations

import contextlib
import time

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
PATIENCE_S = 60.0  # that the second half waits for the start of a run; compiling it takes a tenth on a quiet machine


def compile_half(number: int) -> None:
    """Compile the loop that cuts steps at events and the exact solver (0), or laws, schemes and whole steps (1)."""
    if not COMPILED or is_kept(loop.advance_dated if number else located.advance_located):
        return
    rest = AdditionDeletion(), Midpoint(), StepRule(dt=1e-6)
    if number == 0:
        run(*mass_on_rod(Modal(modes=10), *rest, events="located"))
        run(*mass_on_rod(Continuous(), *rest))
    else:
        for law in matrix.laws().values():
            LawAddress(law.respond, law.compiled)
        until = time.monotonic() + PATIENCE_S
        while not is_kept(loop.start) and time.monotonic() < until:
            time.sleep(0.1)
        cells = [(MODEL, law, SCHEME) for law in matrix.laws()] + [(MODEL, LAW, scheme) for scheme in matrix.schemes()]
        for cell in cells:
            with contextlib.suppress(ImpactlabError):
                begun(matrix.scene_of(*cell, trips=0.1))
        matrix.outcome(MODEL, LAW, SCHEME, trips=0.1, timed=False)
