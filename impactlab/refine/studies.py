"""Studies of the descriptions that suit a scene, and the fineness with which each begins."""

from __future__ import annotations

from collections.abc import Iterator

from impactlab.refine import out_of_reach
from impactlab.refine.convergence import Study
from impactlab.refine.descriptions import suitable
from impactlab.refine.descriptions.cost import FIXED_S
from impactlab.refine.descriptions.description import Description
from impactlab.refine.errors.level_errors import allowed
from impactlab.scene.method import Simulation

FIRST_S = 12.0 * FIXED_S  # s of predicted solving, at most, of the first run of a description
FIRST_ALIKE_S = 40.0 * FIXED_S  # the same where a third run needs no set-up of its own
MAX_LEARNT = 10.0  # of an estimated over a predicted error, that other descriptions start with


def studies_of(request: Simulation) -> tuple[list[Study], str]:
    """Return a study of every description, and why the exact solver does not apply."""
    studies, why = in_turn(request)
    return list(studies), why


def in_turn(request: Simulation, served: tuple[Description | None, str] | None = None) -> tuple[Iterator[Study], str]:
    """Return studies of all descriptions, and why the exact solver is excluded.

    Each study is made when it is needed. The preferred one is the first; ``served`` is the exact solver where it has
    been sought.
    """
    descriptions, why = suitable.in_turn(request, served)
    error = allowed(request.method)
    return (begun(each, error) for each in descriptions), why


def begun(description: Description, error: float) -> Study:
    """Return a study with its first fineness, and the one wanted, for an error."""
    if not description.unit:
        return Study(description, 0)
    start = description.start_for(error)
    study = Study(description, _cheap(description, start), wanted=description.wanted_of(start, error))
    if (least := out_of_reach.in_common(description)) > error:
        study.closed, study.out_of_reach = out_of_reach.reason_in_common(least), True
    return study


def _cheap(description: Description, start: int) -> int:
    """Return the first fineness of a description.

    It is no finer than a run that is cheap, as its prediction may be wrong.
    """
    most = FIRST_ALIKE_S if description.alike else FIRST_S
    if description.seconds(start) <= most:
        return start
    low, high = description.min_fineness, start
    while high - low > max(1, low // 16):
        middle = (low + high) // 2
        low, high = (middle, high) if description.seconds(description.whole(middle)) <= most else (low, middle)
    return description.whole(low)


def _predicted(study: Study, fineness: int) -> float:
    """Return the error that a run of a study was predicted to state."""
    alone = all(level.alone for level in study.levels)
    return study.description.error(fineness) * (study.description.alone if alone else 1.0)


def start_finer(studies: list[Study], tolerance: float) -> None:
    """Begin untried descriptions finer by the prediction errors of tried ones.

    The smallest ratio of error to prediction is taken. The cause is mostly common to all: a contact that rises faster
    than predicted, or touches again.
    """
    known = [study for study in studies if study.reach is not None]
    if not known:
        return
    ratios = [study.reach.error / _predicted(study, study.reach.fineness) for study in known if study.reach]
    ratio = min(max(min(ratios), 1.0), MAX_LEARNT)
    for study in studies:
        if study.description.unit and not study.levels and not study.failures:
            again = begun(study.description, tolerance / ratio)
            study.next, study.wanted = max(study.next, again.next), max(study.wanted, again.wanted)
