"""Cost of fits of exact scenes, and of their parts.

Three numbers of a cushioned hammer are fitted to 400 samples.

Times are minima of processor time over fits that take turns, after a first one; beside them their ratio to a single run
of the case, which does not depend on the load of the machine.

    python -m benchmarks.fits [--repeats 15]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

import impactlab as il
from impactlab.fits.model import Means
from impactlab.fits.trials import Trials
from studies.fits import number, scenes

SAMPLES, NOISE = 400, 0.02


def measured(case: il.Case, channel: str) -> il.Signal:
    """Return a channel of a run with noise."""
    history = il.run(case)
    times = np.asarray((np.arange(SAMPLES) + 0.5) * 1.15 * history.duration / SAMPLES, dtype=float)
    empty = il.Signal(channel, times, 0.0 * times)
    clean = Means(history, channel).over(empty.edges, 0.0)
    error = np.random.default_rng(1).standard_normal(SAMPLES)
    return replace(empty, values=clean + NOISE * np.max(np.abs(clean)) * error)


def least(calls: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Return the least processor time of each call [s]; they take turns."""
    found = dict.fromkeys(calls, np.inf)
    for turn in range(repeats + 1):
        for name, call in calls.items():
            began = time.process_time()
            call()
            if turn:
                found[name] = min(found[name], time.process_time() - began)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=15)
    repeats = parser.parse_args().repeats
    scene = scenes()[0]
    truth = {path: number(scene.case, path) for path in scene.parameters}
    signal = measured(scene.case, scene.channel)
    start = scene.case.with_settings({path: value * 1.25 for path, value in truth.items()})
    bounds = {path: (value / 5.0, 5.0 * value) for path, value in truth.items()}
    problem = il.fit_problem(start, signal, bounds)
    fast, whole = problem.trials[0], Trials(start, problem.parameters, [scene.channel])
    random = np.random.default_rng(0)

    def trial(of: Trials) -> None:
        of.means(tuple(value * random.uniform(0.99, 1.01) for value in truth.values()))

    found = least(
        {
            "a run of the case": lambda: il.run(scene.case),
            "a trial as a run": lambda: trial(whole),
            "a trial in prepared memory": lambda: trial(fast),
            "checks and preparation": lambda: il.fit_problem(start, signal, bounds),
            "fit, trigger known": lambda: il.fit(start, signal, bounds),
            "fit, trigger free": lambda: il.fit(start, signal, bounds, shift="free"),
            "fit, with profiles": lambda: il.fit(start, signal, bounds, intervals="profile"),
        },
        repeats,
    )
    base = found["a run of the case"]
    for name, seconds in found.items():
        print(f"{name:28} {1e3 * seconds:9.3f} ms  {seconds / base:8.2f} runs")


if __name__ == "__main__":
    main()
