"""Kernels compiled once where two workers start without compiled code: a half in each."""

from __future__ import annotations

import contextlib
import time

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.errors import ImpactlabError
from impactlab.integrators.midpoint import Midpoint
from impactlab.models.modal import Modal
from impactlab.numerics.addresses import COMPILED
from impactlab.numerics.cache import is_kept
from impactlab.scene.method import StepRule
from impactlab.simulate import run
from impactlab.simulate.stepping import located, loop
from impactlab.testing.scenes import mass_on_rod
from impactlab.testing.trace import begun
from studies import matrix

MAX_WAIT_S = 120.0  # for the other half; it is compiled here where it does not appear
MODEL, LAW, SCHEME = "modal 40", "penalty", "newmark"


def compile_half(number: int) -> None:
    """Compile the loop that cuts steps at events (0), or exact solver, laws, schemes and whole steps (1); then wait."""
    kernels = located.advance_located, loop.advance_dated
    if not COMPILED or all(map(is_kept, kernels)):
        return
    if number == 0:
        run(*mass_on_rod(Modal(modes=10), AdditionDeletion(), Midpoint(), StepRule(dt=1e-6), events="located"))
    else:
        cells = [(MODEL, law, SCHEME) for law in matrix.laws()] + [(MODEL, LAW, scheme) for scheme in matrix.schemes()]
        for cell in cells:
            with contextlib.suppress(ImpactlabError):
                begun(matrix.scene_of(*cell, trips=0.1))
        matrix.outcome(MODEL, LAW, SCHEME, trips=0.1, timed=False)
    began = time.monotonic()
    while not is_kept(kernels[1 - number]) and time.monotonic() - began < MAX_WAIT_S:
        time.sleep(0.2)
