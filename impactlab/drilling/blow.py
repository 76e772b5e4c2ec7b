"""One blow of a percussive drill: work on the rock, efficiency, penetration and remaining energy."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from impactlab import api
from impactlab.casefile import Case
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.bilinear import Bilinear
from impactlab.drilling.drill import Drill, drill_of
from impactlab.errors import DoubtfulResult
from impactlab.history.base import AbstractHistory
from impactlab.measurement.inputs import expect, warn
from impactlab.prefixes import prefixed, prefixed_range
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Contact
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.startup.lazy import above
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 20_000  # instants of the force-penetration loop of a run without steps
MIN_SHARE = 1e-3  # of the largest force on the rock, of the energy of the hammer: less does nothing to the rock
SAME_TIME = 1e-9  # relative: rounding of a run that ends with the first pass


class Loop(NamedTuple):
    """Force on the rock over the penetration of the bit, shape (n,) each."""

    time: Array  # s
    penetration: Array  # m
    force: Array  # N
    work: Array  # J, on the rock so far

    def __repr__(self) -> str:
        return (
            f"<Loop of {len(self.time)} samples, {prefixed_range(self.time[0], self.time[-1], 's')}: penetration to "
            f"{prefixed(self.penetration.max(), 'm')}, force to {prefixed(self.force.max(), 'N')}, "
            f"work {prefixed(self.work[-1], 'J')}>"
        )


@dataclass(frozen=True, repr=False)
class Blow:
    """Effect of one blow on the rock."""

    work: float  # J, on the rock at the end of the run
    efficiency: float  # work over the kinetic energy of the hammer
    first_pass: float  # efficiency until the wave reflected at the bit has returned from the nearest joint
    peak_force: float  # N
    deepest: float  # m, largest penetration
    final: float  # m, permanent penetration
    left_in_hammer: float  # J, at the end of the run
    left_in_rods: float  # J, at the end of the run
    loop: Loop
    history: AbstractHistory = field(compare=False)

    def __repr__(self) -> str:
        return (
            f"<Blow: work {prefixed(self.work, 'J')}, efficiency {self.efficiency:.4g} (first pass "
            f"{self.first_pass:.4g}), penetration {prefixed(self.final, 'm')}, peak {prefixed(self.peak_force, 'N')}>"
        )

    def plot(self) -> Figure:
        """Return the force over the penetration, and the work over time, as a figure."""
        made: Figure = above("report.figures.evaluations").drill_blow(self)
        return made


def blow(case: Case | Simulation) -> Blow:
    """Return the effect of one blow on the rock.

    The hammer is every body that moves at t = 0, the rock the only wall that a body meets, as a rule with the law
    `bilinear`: loading along k, unloading along k/gamma.

    Parameters
    ----------
    case : Case or Simulation
        One blow, long enough for the wave to reach the rock as often as it counts.

    Raises
    ------
    CaseError
        If hammer and rock cannot be found in the case.
    CaseError, PairingError, PluginError, StepError
        As `impactlab.run`.

    Warns
    -----
    DoubtfulResult
        If the run ends before the first pass does, or while the bit goes deeper, or if the hammer meets no body.

    References
    ----------
    HustrulidFairhurst1971, Lundberg1973.
    """
    return blow_of(api.run(case))


def blow_of(history: AbstractHistory) -> Blow:
    """Return the effect of the blow of a run on the rock; raise and warn as `blow`."""
    expect(history, AbstractHistory, "Give the history of a run: il.run(case). Of a case, take drilling.blow.")
    laws = history.method.laws
    drill = drill_of(history.scene, laws)
    law = laws[drill.rock.name]
    loop = loop_of(history, drill.rock, law)
    first = _first_force(loop, 0.0 if history.dt is None else MIN_SHARE)
    if history.contacts:
        _warn_if_too_short(loop, first, drill, _left(history, drill.hammer))
    else:
        named = " and ".join(repr(name) for name in drill.hammer)
        warn(
            f"rock {drill.rock.name!r}: the hammer, {named}, meets no body in the {loop.time[-1]:.6g} s of the run. "
            "Let its velocity point at the rod (positive where the rod is on its right), or give solve.duration a "
            "longer time.",
            DoubtfulResult,
        )
    work, deepest = float(loop.work[-1]), max(0.0, float(loop.penetration.max()))
    # The first pass lasts until the wave of the first force has returned from the nearest joint.
    passed = 0.0 if first is None else float(np.interp(first + drill.round_trip, loop.time, loop.work))
    return Blow(
        work=work,
        efficiency=work / drill.kinetic_energy,
        first_pass=passed / drill.kinetic_energy,
        peak_force=float(loop.force.max()),
        deepest=deepest,
        final=_final(history, law, drill.rock, loop),
        left_in_hammer=_left(history, drill.hammer),
        left_in_rods=_left(history, drill.rods),
        loop=loop,
        history=history,
    )


def loop_of(history: AbstractHistory, rock: Contact, law: AbstractContactLaw) -> Loop:
    """Return force, penetration and work at the rock at the instants of a run.

    Force and work of a bilinear law follow from the penetration, which every scheme gives at the end of a step; of any
    other law the force is that of the run, and the work its integral over the penetration.
    """
    steps = POINTS if history.dt is None else round(history.duration / history.dt)
    time = np.linspace(0.0, history.duration, steps + 1)
    if history.dt is None:  # the deepest point may be a kink between two instants
        changes = [change.time for change in history.changes if change.contact == rock.name]
        time = np.unique(np.concatenate((time, changes, history.jumps(f"force:{rock.name}"))))
    penetration = -history.evaluate(time, f"gap:{rock.name}")
    if isinstance(law, Bilinear):
        return Loop(time, penetration, *law.along(penetration))
    force = history.evaluate(time, f"force:{rock.name}")
    return Loop(time, penetration, force, _work(history, rock, time))


def _work(history: AbstractHistory, rock: Contact, time: Array) -> Array:
    """Return the work of the force on the rock up to times [J].

    The force may jump. The force of a step acts over an interval that a run records; the mean over any other is that in
    its middle.
    """
    force, gap = f"force:{rock.name}", f"gap:{rock.name}"
    kept = history.recorded[force] if isinstance(history, AbstractRecordedHistory) else None
    if kept is not None and kept.stepped:
        ends, means = np.minimum(kept.times, history.duration), kept.values[1:]
    else:
        ends, means = time, history.evaluate(0.5 * (time[1:] + time[:-1]), force)
    done = np.cumsum(-means * np.diff(history.evaluate(ends, gap)))
    return np.interp(time, ends, np.concatenate(([0.0], done)))


def _warn_if_too_short(loop: Loop, first: float | None, drill: Drill, left: float) -> None:
    """Issue a `DoubtfulResult` if a run ends before its first pass does.

    It is issued as well while the bit goes deeper. ``first`` is the instant of the first force [s]. A pass is over
    early where the bit no longer presses and the hammer has no energy ``left`` [J].
    """
    ends = float(loop.time[-1])
    acts = (
        abs(float(loop.force[-1])) > MIN_SHARE * float(np.abs(loop.force).max())
        or left > MIN_SHARE * drill.kinetic_energy
    )
    texts = []
    if first is None:
        texts.append("until then no force acts on the rock")
    elif acts and ends < (first + drill.round_trip) * (1.0 - SAME_TIME):
        texts.append(
            f"the first pass lasts until {first + drill.round_trip:.6g} s, when the wave reflected at "
            "the bit returns from the nearest joint: first_pass has the work up to the end of the run"
        )
    if first is not None and np.argmax(loop.penetration) == len(loop.time) - 1:
        texts.append("the penetration still grows: work, deepest and final are those at the end of the run")
    if texts:
        warn(
            f"rock {drill.rock.name!r}: the run ends at {ends:.6g} s, and {'; '.join(texts)}. Give solve.duration a "
            "longer time.",
            DoubtfulResult,
        )


def _first_force(loop: Loop, share: float) -> float | None:
    """Return the instant before the first force on the rock [s], or None.

    The force is above ``share`` of the largest. In an explicit scheme each step carries a trace of a wave into the next
    element, faster than the wave itself.
    """
    pressed = np.flatnonzero(loop.force > share * max(0.0, float(loop.force.max())))
    return float(loop.time[max(0, pressed[0] - 1)]) if pressed.size else None


def _final(history: AbstractHistory, law: AbstractContactLaw, rock: Contact, loop: Loop) -> float:
    """Return the permanent penetration [m].

    Of a bilinear law it follows from the deepest one, of a link it is its set; else it is that as the bit last left.
    """
    if isinstance(law, Bilinear):
        return max(0.0, float(loop.penetration.max())) * (1.0 - law.stiffness / law.unloading)
    held = next((link.set for link in history.links if link.name == rock.shared_name), None)
    if held is not None:
        return held
    spans = history.spans(rock.name)
    if not spans:
        return 0.0
    return float(np.interp(spans[-1].until(history.duration), loop.time, loop.penetration))


def _left(history: AbstractHistory, bodies: tuple[str, ...]) -> float:
    """Return the energy [J] of bodies at the end of a run."""
    return sum(float(history.evaluate([history.duration], f"energy:{name}")[0]) for name in bodies)
