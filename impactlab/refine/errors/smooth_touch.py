"""Error estimates of runs on beams that touch once, under a force without jumps, and differ only in their step.

Between the steps such runs are exact: their only error by the steps is that of a force which is constant over each
step. With a step h such a run solves the exact problem of an overlap d that is larger by h^2 d''/6: half of this as the
force is the mean of the law along a line between the ends of the step, half as the motion follows the mean. It is a
sixth of the second difference of the overlap, and acts as a flexibility in series with that of the contact, or as one
that is left out (`impactlab.refine.errors.left_out`).

Measured on random beams under a ball (supports, laws, masses, speeds and gaps, tolerances of 1e-1 to 1e-4):

- Two runs, estimated with three quarters of the declared order: the stated error was at least 1.3 times that of the
  coarser run, except in 3 of 2900 pairs, whose error was below a twentieth of the tolerance. After a second touch
  the error was up to 4 times the stated one, as time and speed of that touch depend unevenly on the step. On beams with
  shear half the order is assumed, as the error by modes left out, which is added, may be larger than stated.
- One run: the change of the force by this sixth of the second difference bounds the error of peak force and impulse,
  times its number of half waves; the displacement of a body that nearly rests after the touch has a larger error. The
  stated error was at least 1.05 times the true one in 3390 runs (of 330 beams), and five times in the median.
- Two runs whose fineness differs by a factor of 2.6 to 16: twice the extrapolation by the whole order, and at least 0.3
  of the error that the finer one states by itself, was at least 1.07 times the true error in 3263 pairs (of 1188 beams
  without losses), and three times in the median. With a factor of 2 it was too small in 3 of 297 pairs.
- Newmark's method, by which damped modes are stepped, is not exact between the steps: its modes vibrate too slowly, and
  one run does not show it. Of 124 damped beams 11 had a larger error than one run states, up to 7.7 times.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import AbstractHystereticLaw, Hertz
from impactlab.history.base import AbstractHistory
from impactlab.history.frame import touched_in
from impactlab.refine.descriptions.beams import is_lossy
from impactlab.refine.descriptions.contact_times import times_of
from impactlab.refine.descriptions.description import MIN_ORDER_SHARE, Description
from impactlab.refine.errors.distances import counted
from impactlab.refine.errors.moving_frames import CELLS, moving_frames, norm
from impactlab.refine.errors.raw_records import records_of
from impactlab.scene.facts import beams_of, rods_of
from impactlab.scene.method import Simulation, laws_of

ORDER_SHARE = 0.75  # of the declared order, assumed by an estimate from two such runs
SAFETY_ALONE = 1.3  # factor on the error that one run shows
SAFETY_OF_TWO = 2.0  # factor on the extrapolation from two such runs by the whole order
LEAST_SHARE = 0.3  # of the error that one run states: two runs may agree by luck where errors cancel
REBOUND_SHARE = 0.3  # error of an impulse over that of the force: it moves a body that nearly rests after the touch
READ_SHARE = 0.25  # error of a peak read from means of steps, over the second differences of a curved force
MOVES_SHARE = 3.0  # largest error of displacements over that of the overlap
SHOWN, SHOWN_OF_SPRINGS = 7.0, 3.0  # error that one run shows over the predicted one: medians
SMOOTH = (Penalty, Hertz, AbstractHystereticLaw)


def are_soft(request: Simulation) -> bool:
    """Return whether all contacts have a law without a jump."""
    return all(isinstance(law, SMOOTH) and not law.force_jumps for law in laws_of(*request))


def is_smooth(request: Simulation) -> bool:
    """Return whether all contacts have a law without a jump, and neither rods nor loads send waves."""
    return are_soft(request) and not rods_of(request.scene) and not request.scene.loaded_ends


def stated_alone(request: Simulation) -> float:
    """Return the error that one run states over its predicted one; inf where two runs are needed.

    Two are needed with several contacts, with probes, as only two runs show whether these converge, and with beams that
    lose energy, which are not stepped exactly.
    """
    if len(request.scene.contacts) != 1 or request.scene.probes or not is_smooth(request):
        return math.inf
    if any(is_lossy(beam) for beam in beams_of(request.scene)):
        return math.inf
    return SAFETY_ALONE * max(SHOWN_OF_SPRINGS if law.is_spring else SHOWN for law in laws_of(*request))


def error_alone(history: AbstractHistory, request: Simulation) -> float:
    """Return the error of one run of a scene that `stated_alone` allows; inf where two runs are needed."""
    records = records_of(history)
    if records is None or len(history.contacts) != 1:
        return math.inf
    scene = request.scene
    (contact,), (law,) = scene.contacts, laws_of(*request)
    force, moving = records.force(0, hard=False), moving_frames(scene, touched_in(history))
    if isinstance(law, Hertz | AbstractHystereticLaw):
        found = force.second_differences(law.stiffness, law.exponent)
        of_reading = READ_SHARE * found.rough
    else:
        found, of_reading = force.second_differences(times_of(*request)[contact.name].tangent, 1.0), 0.0
    magnified, of_moves = 1.0, 0.0
    for point, moved in zip(contact.faces, force.moved(CELLS), strict=True):
        body = scene.bodies[point.body]
        if body.moves:
            size = max(norm(moved - moving.drift(body.face_channel(point.x))), 1e-300)
            magnified = max(magnified, norm(moved - body.velocity * moving.t) / size)
            of_moves = max(of_moves, math.sqrt(CELLS) * found.moved / size)
    on, half_waves = counted(request)[2], max(1.0, found.half_waves)
    rebound = 1.0 + REBOUND_SHARE * (magnified - 1.0)
    shown = {
        "displacements": max(rebound * half_waves * found.mean, MOVES_SHARE * of_moves),
        "impulses": half_waves * found.mean,
        "peak_forces": max(half_waves * max(found.mean, found.largest), of_reading),
    }
    return SAFETY_ALONE * max(shown[name] for name in on)


def order_share(description: Description, histories: Sequence[AbstractHistory], request: Simulation) -> float:
    """Return the share of the declared order that an estimate from two runs assumes."""
    once = description.alike and all(len(history.contacts) == 1 for history in histories) and is_smooth(request)
    plain = all(beam.theory != "timoshenko" and not is_lossy(beam) for beam in beams_of(request.scene))
    return ORDER_SHARE if once and plain else MIN_ORDER_SHARE
