"""The independent solution of undamped scenes, with its uncertainty.

They are scenes of rods without damping and rigid bodies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from studies.audit.collocation import Net, arrays_of, memory_of
from studies.audit.compare import JUDGED, Truth, errors
from studies.audit.march import DONE, FULL, Out, Rule, march
from studies.audit.network import FIXED, Doc, Frame, Network, frames, read
from studies.audit.tables import STAGES, Array

SAMPLES = 6000  # middles of equal cells of the run, as in the metrics
MOST_STEPS = 60_000
LEVELS = (
    (3e-5, 0.8),
    (1e-5, 1.0),
    (1e-6, 1.2),
    (3e-8, 1.7),
    (2e-9, 3.0),
)  # roughness over the speed; by how much steps are shorter
HALVED, SLOW = 0.5, 10.0  # levels that do not come to less than a half of their distance are as often less well known
ROUNDING = 1e-9
SHARE = 0.01  # of the tolerance: uncertainty at which refining ends


class NotKnownError(Exception):
    """There is no truth for a scene.

    The program does not serve the scene, or did not come to an end.
    """


def scales(net: Network) -> tuple[float, float]:
    """Return a speed of the scene and the longest step [m/s, s].

    The step resolves the scene's own times.
    """
    speed = max([abs(n.velocity) for n in net.nodes] + [abs(p.velocity) for p in net.pieces] + [0.0])
    speed = max(speed, abs(net.gravity) * net.duration)
    load = min([p.impedance for p in net.pieces], default=math.inf)
    push = max([abs(n.force) for n in net.nodes], default=0.0)
    return max(speed, push / load if math.isfinite(load) else 0.0), net.duration / 150.0


def softest(net: Network, arrays: Net) -> float:
    """Return the least force per speed of a contact side [N s/m].

    It is the resistance of the side over the run.
    """
    sides = [side for touch in net.touches for side in (touch.left, touch.right)]
    put_up = [arrays.load[n] + net.nodes[n].mass / net.duration for n in sides if net.nodes[n].kind != FIXED]
    return float(min(put_up))


def walk(net: Network, rough: float, finer: float) -> tuple[Net, Out]:
    """Return the output of a march.

    Its roughness is relative to the speed; the longest step is divided by ``finer``.
    """
    arrays = arrays_of(net)
    speed, longest = scales(net)
    rule = Rule(longest / finer, rough * speed, speed, speed * softest(net, arrays))
    steps = 4000
    while True:
        ends, contacts, nodes = len(arrays.node), len(arrays.left), len(arrays.kind)
        out = Out(
            np.zeros(steps),
            np.zeros(steps),
            np.zeros((steps, ends, STAGES)),
            np.zeros((ends, 4 * steps)),
            np.zeros((SAMPLES, nodes)),
            np.zeros((SAMPLES, contacts)),
            np.zeros(contacts),
            np.zeros(contacts),
            np.zeros(contacts, np.int64),
            np.zeros((20000, 3)),
            np.zeros(3, np.int64),
        )
        velocity = np.array([n.velocity for n in net.nodes])
        ended = march(arrays, rule, net.duration, memory_of(arrays), out, np.zeros(nodes), velocity)
        if ended == DONE:
            return arrays, out
        if ended != FULL or steps > MOST_STEPS:
            raise NotKnownError("stuck" if ended != FULL else "too many steps")
        steps *= 4


def drifted(frame: Frame, times: Array) -> Array:
    """Return the displacement of a frame."""
    return frame.velocity * times + 0.5 * frame.gravity * times**2


def answer(doc: Doc, net: Network, out: Out) -> Truth:
    """Return a march in the words of a history."""
    times = (np.arange(SAMPLES) + 0.5) * (net.duration / SAMPLES)
    frame = frames(doc, {touch.name for c, touch in enumerate(net.touches) if out.touches[c]})
    fall = 0.5 * net.gravity * times**2
    names = [touch.name for touch in net.touches]
    jumps: dict[str, list[tuple[float, float]]] = {name: [] for name in names}
    for time, contact, size in out.jumps[: out.counts[1]]:
        jumps[names[int(contact)]].append((float(time), float(size)))
    return Truth(
        times,
        {name: out.u[:, node] + fall for name, node in net.channels.items()},
        {name: out.force[:, c] for c, name in enumerate(names)},
        {name: float(out.impulse[c]) for c, name in enumerate(names)},
        {name: float(out.peak[c]) for c, name in enumerate(names)},
        jumps,
        {name: drifted(frame[body], times) for name, body in net.body_of.items()},
        net.round_trip,
        int(out.touches.sum()),
    )


def unknown(found: Truth, judged: Sequence[str]) -> float:
    """Return the largest uncertainty of the quantities that count."""
    return max(found.uncertainty[name] for name in judged)


def solve(doc: Doc, judged: Sequence[str] = JUDGED) -> Truth:
    """Return the solution of a case of undamped rods and rigid bodies.

    The difference of two marches is its uncertainty. It is refined until the quantities of `judged` are known to a
    share of the tolerance.

    Raises
    ------
    NotKnownError
        Where the scene is not served, or a march does not end.
    """
    try:
        net = read(doc)
    except (ValueError, KeyError) as error:
        raise NotKnownError(f"not served: {error}") from error
    wanted = SHARE * float(doc["solve"].get("tolerance", 1e-4))
    before: Truth | None = None
    known: Truth | None = None
    last: dict[str, float] = {}
    for level in LEVELS:
        try:
            found = answer(doc, net, walk(net, *level)[1])
        except NotKnownError:
            if known is None:
                raise
            break
        if before is not None:
            apart = errors(before, found, tolerance=1e-4)
            found.uncertainty = dict(apart)
            for name in apart:
                if known is not None and apart[name] > max(HALVED * last[name], ROUNDING):
                    found.uncertainty[name] = SLOW * apart[name]
                    known.uncertainty[name] = max(known.uncertainty[name], SLOW * apart[name])
            last = apart
            if known is None or unknown(found, judged) < unknown(known, judged):
                known = found
            if unknown(known, judged) <= wanted:
                break
        before = found
    assert known is not None
    return known


__all__ = ["NotKnownError", "Truth", "answer", "solve", "walk"]
