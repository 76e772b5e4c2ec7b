"""Runs that touch once, under a force without jumps, and differ in their step alone: their errors follow an order.

Between the steps such runs are exact, so that their error is that of a force which is constant over each step. With a
step h such a run solves the exact problem of an overlap d that is larger by h^2 d''/6: half of it as the mean of the
force is that along a line between the ends of the step, half as the motion follows the mean. That is a sixth of the
second difference of the overlap, and acts as a flexibility in series with that of the contact, or as one that is left
out (`impactlab.refine.errors.left_out`).

It was measured on random beams under a ball (supports, laws, masses, speeds and gaps, with 1e-1 to 1e-4 asked for):

- Three quarters of the declared order state, of two runs, 1.3 times the error of the coarser one and more; in 3 of 2900
  pairs less, where the error was below a twentieth of the tolerance. With a second touch the error was up to 4
  times as large as stated: when and how fast the faces meet again is uneven in the step. On beams that shear half the
  order is left, as the error of their modes left out, which is added, may be larger than stated.
- Of one run, the change of the force by this sixth of the second difference bounds the error of its peak and impulse,
  times the half waves in which it swings; the displacement of a body that nearly rests after the touch has a larger
  one. The stated error was 1.3 times the true one and more in 3390 runs (of 330 beams), six times it in the median.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import AbstractHystereticLaw, Hertz
from impactlab.history.base import AbstractHistory
from impactlab.history.frame import touched_in
from impactlab.refine.descriptions.contact_times import times_of
from impactlab.refine.descriptions.description import MIN_ORDER_SHARE, Description
from impactlab.refine.errors.distances import counted
from impactlab.refine.errors.moving_frames import CELLS, moving_frames, norm
from impactlab.refine.errors.raw_records import records_of
from impactlab.scene.facts import beams_of, rods_of
from impactlab.scene.method import Simulation, laws_of

ORDER_SHARE = 0.75  # of the declared order, that an estimate from two such runs assumes
SAFETY_ALONE = 1.6  # factor on the error that one run shows
REBOUND_SHARE = 0.3  # of the error of a force, that its impulse has: a body that nearly rests behind it moves by that
READ_SHARE = 0.25  # of the second differences of a force that is curved: a peak is read from means of steps
MOVES_SHARE = 3.0  # of the overlap that is too large, which displacements have at most
SHOWN, SHOWN_OF_SPRINGS = 7.0, 5.0  # error that one run shows over the predicted one, about the median
SMOOTH = (Penalty, Hertz, AbstractHystereticLaw)


def are_soft(request: Simulation) -> bool:
    """Return whether all contacts have a law without a jump."""
    return all(isinstance(law, SMOOTH) and not law.force_jumps for law in laws_of(*request))


def is_smooth(request: Simulation) -> bool:
    """Return whether all contacts have a law without a jump, and neither rods nor loads send waves."""
    return are_soft(request) and not rods_of(request.scene) and not request.scene.loaded_ends


def stated_alone(request: Simulation) -> float:
    """Return the error that one run states, over its predicted one; inf where two are needed.

    They are with several contacts, and with probes, whose convergence two runs show.
    """
    if len(request.scene.contacts) != 1 or request.scene.probes or not is_smooth(request):
        return math.inf
    return SAFETY_ALONE * max(SHOWN_OF_SPRINGS if law.is_spring else SHOWN for law in laws_of(*request))


def error_alone(history: AbstractHistory, request: Simulation) -> float:
    """Return the error of a run of a scene that `stated_alone` has allowed; inf where it takes two to know it."""
    records = records_of(history)
    if records is None or len(history.contacts) != 1:
        return math.inf
    scene = request.scene
    (contact,), (law,) = scene.contacts, laws_of(*request)
    force, moving = records.force(0, hard=False), moving_frames(scene, touched_in(history))
    if isinstance(law, Hertz | AbstractHystereticLaw):
        bends = force.bends(law.stiffness, law.exponent)
        of_reading = READ_SHARE * bends.rough
    else:
        bends, of_reading = force.bends(times_of(*request)[contact.name].tangent, 1.0), 0.0
    magnified, of_moves = 1.0, 0.0
    for point, moved in zip(contact.faces, force.moved(CELLS), strict=True):
        body = scene.bodies[point.body]
        if body.moves:
            size = max(norm(moved - moving.drift(body.face_channel(point.x))), 1e-300)
            magnified = max(magnified, norm(moved - body.velocity * moving.t) / size)
            of_moves = max(of_moves, math.sqrt(CELLS) * bends.moved / size)
    on, swings = counted(request)[2], max(1.0, bends.swings)
    shown = {
        "displacements": max((1.0 + REBOUND_SHARE * (magnified - 1.0)) * swings * bends.mean, MOVES_SHARE * of_moves),
        "impulses": swings * bends.mean,
        "peak_forces": max(swings * max(bends.mean, bends.largest), of_reading),
    }
    return SAFETY_ALONE * max(shown[name] for name in on)


def order_share(description: Description, histories: Sequence[AbstractHistory], request: Simulation) -> float:
    """Return the share of the declared order that an estimate from two runs assumes."""
    once = description.alike and all(len(history.contacts) == 1 for history in histories) and is_smooth(request)
    sheared = any(beam.theory == "timoshenko" for beam in beams_of(request.scene))
    return ORDER_SHARE if once and not sheared else MIN_ORDER_SHARE
