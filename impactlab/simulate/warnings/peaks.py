"""Warnings of largest contact forces that last too short a time for the method.

Where a front meets elements or modes, the contact force oscillates at the highest frequencies that they have, or the
contact opens and closes at each step. The largest force is then one of these oscillations: it follows the mesh and the
step, while impulses and displacements may be right.

Behind a front that has crossed many elements of a mesh the oscillation is slower (`mesh_dispersion`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from impactlab.history.base import Warned
from impactlab.integrators.base import AbstractIntegrator
from impactlab.scene.bodies import ElasticBody
from impactlab.scene.problem import Contact
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.simulate.planning.contact_facts import ContactFacts
from impactlab.simulate.warnings.mesh_dispersion import LOBES, airy_scale
from impactlab.simulate.warnings.sawtooth import MIN_SHARE
from impactlab.types import Array

RESOLUTIONS = 3.0  # time resolutions: forces that last less may be oscillations of the mesh, modes or contact
MAX_TRIPS = 0.5  # round trips: fronts follow each other as fast, and a window holds no more than one
# Largest force over the largest mean in this time, beyond the ratio of a force that decays as exp(-Z t/m). A half sine
# as short as contacts without `coarse_contact` are has 1.02. Of 1411 peaks wrong by 5 % or more in random hard cases of
# rods on meshes 1215 are above it, and of 157 right to 3 % 49, most of them right because several errors cancel; of 403
# right ones under springs 8.
RATIO_WARN, RATIO_WARN_BEAMS = 1.06, 1.15
# Long runs keep means over several steps. The mean is then taken over this many records, if they are at most so many
# times longer than the time above. Over such times more right forces vary: of 123 above this ratio 103 are wrong.
MIN_RECORDS, MAX_LONGER, RATIO_WARN_LONGER = 2.0, 4.0, 1.25


def oscillating(history: AbstractRecordedHistory, contact: Contact, facts: ContactFacts) -> Iterator[Warned]:
    """Yield a warning where the largest force of a contact lasts less than the method resolves.

    Euler-Bernoulli beams are left out: their waves have no front, a soft contact has a smooth force, and a hard one has
    no bound (`singular_force`).
    """
    scene, law = history.scene, history.method.laws[contact.name]
    elastic = [body for point in contact.faces if (body := scene.bodies[point.body].elastic) is not None]
    if law.two_sided or not law.answers_force or not elastic or any(body.unbounded_first_force for body in elastic):
        return
    times, values = history.force_means(contact)
    if times.size <= MIN_RECORDS:
        return
    at = int(values.argmax())
    if at == times.size - 1 and facts.stiffness not in (math.inf, None) and not facts.is_relative:
        return  # a spring that is pressed further at the end of the run
    exact = all(keeps_waves(history, body) for body in elastic)
    resolved = RESOLUTIONS * (history.dt or 0.0 if exact else facts.resolution_of_all)
    lobes = 0.0 if exact else lobes_of(history, elastic, float(times[at]))
    dispersed, resolved = lobes > resolved, max(lobes, resolved) + RESOLUTIONS * facts.delay
    time = max(resolved, MIN_RECORDS * float(times[-1] - times[0]) / (times.size - 1))
    thinned = time > resolved
    if time > MAX_LONGER * resolved:
        return
    decays = time * facts.impedance / facts.striker if facts.impedance < math.inf else 0.0  # of a mass m on a rod Z
    ratio = RATIO_WARN if all(body.waves is not None for body in elastic) else RATIO_WARN_BEAMS
    least = (RATIO_WARN_LONGER if thinned else ratio) * (decays / -math.expm1(-decays) if decays > 0.0 else 1.0)
    peak = max((span.peak_force or 0.0 for span in history.spans(contact.name)), default=0.0)
    if any(peak <= least * mean for mean in beside(times, values, time)):
        return
    mean = largest_mean(times, values, time)
    if peak <= least * mean:
        return
    length = "three times the time resolution of this method"
    cause = "Oscillations of elements, modes or the contact last as long"
    if dispersed:
        length = "one oscillation of a front on this mesh"
        cause = "A mesh disperses fronts, whatever the number of elements, and the force swings about that of the waves"
    if thinned:
        length = "the shortest that the records of this long run show"
    text = (
        f"{contact.name}: the largest force, {peak:.4g} N, is {peak / mean:.3g} times the largest mean over {time:.3g} "
        f"s, {length}. {cause}, so that it follows the mesh and the step: as a rule it is too large by about "
        f"{100.0 * (peak / mean - 1.0):.2g} %. Compare it with this mean, "
        f"{mean:.4g} N, and with model continuous or a lumped mesh at courant 1"
    )
    yield Warned("peak_oscillates", text, contact.name)


def lobes_of(history: AbstractRecordedHistory, bodies: Sequence[ElasticBody], time: float) -> float:
    """Return the duration of the first oscillation of a front on some meshes at a time of the run [s]."""
    shortest = min(body.round_trip for body in bodies)
    return min(LOBES * airy_scale(history, bodies, time), MAX_TRIPS * shortest)


def keeps_waves(history: AbstractRecordedHistory, body: ElasticBody) -> bool:
    """Return whether waves of a body do not disperse: on a lumped mesh of a rod at the stability limit of the step."""
    scheme, system = history.method.integrator, history.built[body.name].system
    if body.waves is None or body.rotation is not None or system.modes or not isinstance(scheme, AbstractIntegrator):
        return False
    return scheme.needs_diagonal_mass and history.dt is not None and history.dt > MIN_SHARE * scheme.limit(system)


def beside(times: Array, values: Array, time: float) -> Iterator[float]:
    """Yield the means of a recorded force over a time or more after, around and before its largest value [N].

    Of most runs one of them shows already that the largest force lasts.
    """
    at, last = int(values.argmax()), times.size - 1
    count = math.ceil(time * last / (times[last] - times[0]))
    for first in (at - 1, at - 1 - count // 2, at - count):
        end = first + count
        if 0 <= first < end <= last:
            span = times[first : end + 1]
            yield float((values[first + 1 : end + 1] @ (span[1:] - span[:-1])) / (span[-1] - span[0]))


def largest_mean(times: Array, values: Array, time: float) -> float:
    """Return the largest mean of a recorded force over windows of a length.

    Windows begin or end at a record; outside the records there is no force.

    Parameters
    ----------
    times : array, shape (n,)
        Times of the records [s].
    values : array, shape (n,)
        Mean force from the record before to each record [N].
    time : float
        Length of the windows [s].

    Returns
    -------
    float
        Largest mean [N].
    """
    if times.size == 0:
        return 0.0
    impulse = np.append(0.0, (values[1:] * np.diff(times)).cumsum())
    ahead = np.interp(times + time, times, impulse) - impulse
    behind = impulse - np.interp(times - time, times, impulse)
    return float(max(ahead.max(), behind.max())) / time
