"""Measurements of docs/peers.md: the best settings again, and three ratios.

The settings are those of the scans, timed side by side.

All runs of a table are interleaved: each repeat builds and solves every one of them once, so that other work of the
machine falls on all alike. Times are of the processor, in this thread; the least counts, and how far the middle
lies above it is kept.
"""

from __future__ import annotations

import gc
import json
import math
import statistics
from collections.abc import Callable, Mapping
from typing import Any

from benchmarks import step_loop
from benchmarks.peers import exudyn_peer, impactlab_peer
from benchmarks.peers.cases import CASES, NORMS, PAPER, PAPER_EVENTS, Case, errors_of, exact
from benchmarks.peers.run import Run, Setting, timed
from benchmarks.peers.scan import PEERS, load, read

TOLERANCES = (5e-3, 1e-3)
CANDIDATES = 2  # per program: the quickest of the scan may owe its place to noise
OURS = {
    "exact": "exact",
    "central_difference": "central difference",
    "craig_bampton": "Craig-Bampton, located",
    "newmark": "Newmark",
    "automatic": "automatic",
}
PACKAGES = ("exudyn", "mujoco", "opensees")
WARM = 1  # runs before the counted ones
SHORT = 0.1  # s: runs below are warmed up each time

Times = dict[str, float]


def group_of(peer: str, setting: Setting) -> str:
    """Return the row of a setting: the program, and its model if that matters."""
    model = str(setting["model"])
    if peer == "impactlab":
        return f"impactlab, {OURS[model]}"
    if peer == "exudyn":
        return "Exudyn, reduced rod" if model == "reduced" else "Exudyn, mesh"
    return load(peer).NAME


def groups() -> list[tuple[str, str]]:
    """Return all rows in their order: program and name."""
    found = [("impactlab", f"impactlab, {name}") for name in OURS.values()]
    for peer in list(PEERS)[1:]:
        names = ["Exudyn, reduced rod", "Exudyn, mesh"] if peer == "exudyn" else [load(peer).NAME]
        found += [(peer, name) for name in names]
    return found


def best_of_scan(peer: str, group: str, case: Case, tolerance: float) -> list[Mapping[str, Any]]:
    """Return the quickest settings of a scan that keep all norms within a tolerance."""
    rows = [
        row
        for row in read(peer)
        if row["case"] == case.name
        and group_of(peer, row["setting"]) == group
        and all(row[norm] <= tolerance for norm in NORMS)
    ]
    return sorted(rows, key=lambda row: float(row["solve_s"]))[:CANDIDATES]


def interleaved(builds: list[Callable[[], Run]], repeats: int) -> list[Times]:
    """Return least time, spread and wall time of interleaved runs [s].

    The spread is the middle less the least. Short runs go twice each turn, the second one timed: a run of 50 us that
    follows another program's would measure the caches that this one emptied.
    """
    spent: list[list[float]] = [[] for _ in builds]
    wall = [math.inf] * len(builds)
    for repeat in range(WARM + repeats):
        gc.collect()
        for i, build in enumerate(builds):
            if wall[i] < SHORT:
                build().solve()
            processor, passed = timed(build())
            wall[i] = min(wall[i], passed) if repeat else passed
            if repeat >= WARM:
                spent[i].append(processor)
    return [
        {"solve_s": min(times), "spread_s": statistics.median(times) - min(times), "wall_s": passed}
        for times, passed in zip(spent, wall, strict=True)
    ]


def builder(peer: str, case: Case, setting: Setting) -> Callable[[], Run]:
    """Return the function that builds a run; packages write nothing while timed."""
    module = load(peer)
    return lambda: module.build(case, setting, record=False)


def errors(peer: str, case: Case, setting: Setting) -> dict[str, float]:
    """Return the errors of a setting, from a run of its own that records."""
    run = load(peer).build(case, setting, record=True)
    run.solve()
    return errors_of(run.outcome(), case)


def to_an_error(repeats: int) -> list[dict[str, Any]]:
    """Return the rows of time to reach an error.

    Per case, tolerance and program it is the quickest setting, timed again.
    """
    rows: list[dict[str, Any]] = []
    jobs: dict[tuple[str, str, str], dict[str, Any]] = {}
    for case in CASES.values():
        for tolerance in TOLERANCES:
            for peer, group in groups():
                row: dict[str, Any] = {"case": case.name, "tolerance": tolerance, "group": group, "peer": peer}
                rows.append(row)
                if load(peer).version() is None:
                    row["reason"] = "not installed"
                    continue
                if group == f"impactlab, {OURS['automatic']}":
                    setting = {"model": "automatic", "tolerance": tolerance}
                    row["chosen"], row["choosing_s"] = impactlab_peer.chosen(impactlab_peer.scene(case, setting))[1:]
                    found = [{"setting": setting}]
                else:
                    found = best_of_scan(peer, group, case, tolerance)
                row["candidates"] = keys = [(peer, case.name, json.dumps(each["setting"])) for each in found]
                if not keys:
                    row["reason"] = "no setting of the scan reaches it" if read(peer) else "no scan stored"
                jobs |= {key: {} for key in keys}
    order = list(jobs)
    builds = [builder(peer, CASES[case], json.loads(setting)) for peer, case, setting in order]
    for (peer, case, setting), times in zip(order, interleaved(builds, repeats), strict=True):
        jobs[peer, case, setting] = times | errors(peer, CASES[case], json.loads(setting))
    for row in rows:
        # Errors are taken again: a newer version of a program may do otherwise than when it was scanned.
        keys = row.pop("candidates", [])
        good = [key for key in keys if all(jobs[key][norm] <= row["tolerance"] for norm in NORMS)]
        if good:
            quickest = min(good, key=lambda key: jobs[key]["solve_s"])
            row |= {"setting": json.loads(quickest[2])} | jobs[quickest]
        elif keys:
            row["reason"] = "the setting of the scan misses it now: scan again"
    return rows


def exact_model(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the errors of the exact events of the paper's case, and a ratio.

    The ratio is that to the quickest package at 5e-3.
    """
    events = [event.time / PAPER.round_trip for event in exact(PAPER).history.events]
    found = {"event_error": math.inf, "solve_s": math.nan, "ratios": {}}
    if len(events) == len(PAPER_EVENTS):
        found["event_error"] = max(abs(one - other) for one, other in zip(events, PAPER_EVENTS, strict=True))
    here = [row for row in rows if row["case"] == PAPER.name and row["tolerance"] == TOLERANCES[0] and "solve_s" in row]
    ours = [row["solve_s"] for row in here if row["group"] == f"impactlab, {OURS['exact']}"]
    if ours:
        found["solve_s"] = ours[0]
        found["ratios"] = {row["group"]: row["solve_s"] / ours[0] for row in here if row["peer"] in PACKAGES}
    return found


def same_scheme(repeats: int, elements: int, ours: Setting, theirs: list[Setting]) -> dict[str, Any]:
    """Return impactlab and Exudyn on the same mesh with the same step: times, errors, ratios."""
    case = PAPER
    jobs = [("impactlab", ours), *(("exudyn", setting) for setting in theirs if exudyn_peer.version())]
    times = interleaved([builder(peer, case, setting) for peer, setting in jobs], repeats)
    rows = [
        {"peer": peer, "setting": dict(setting)} | each | errors(peer, case, setting)
        for (peer, setting), each in zip(jobs, times, strict=True)
    ]
    for row in rows:
        row["ratio"] = row["solve_s"] / rows[0]["solve_s"]
    return {"elements": elements, "rows": rows}


def explicit(repeats: int) -> dict[str, Any]:
    """Return central difference with 400 elements at 0.9 h/c beside Exudyn's.

    The step needs a soft contact there.
    """
    common = {"coordinates": 400, "courant": 0.9}
    theirs = [
        common | {"model": model, "scheme": "VelocityVerlet", "contact_stiffness": 0.3} for model in ("matrix", "items")
    ]
    return same_scheme(repeats, 400, common | {"model": "central_difference"}, theirs)


def implicit(repeats: int) -> dict[str, Any]:
    """Return Newmark with 1600 elements at h/c beside Exudyn's generalised-alpha."""
    common = {"coordinates": 1600, "courant": 1.0}
    # Less damping costs it more: the contact chatters, and each change of contact takes a Jacobian.
    scheme = {"model": "matrix", "scheme": "GeneralizedAlpha", "contact_stiffness": 10.0, "spectral_radius": 0.5}
    return same_scheme(repeats, 1600, common | {"model": "newmark"}, [common | scheme])


def by_hand(repeats: int) -> list[dict[str, Any]]:
    """Return loops of the package beside hand-written loops.

    Rows have steps, times, ratio and fixed cost of a run.
    """
    rows = []
    for name, elements, aim in (
        ("central_difference", 400, 2.0),
        ("central_difference", 1600, 1.5),
        ("newmark", 1600, 1.5),
    ):
        scheme = "Newmark" if name == "newmark" else "central difference"
        few = min(repeats, 12) if name == "newmark" else repeats
        measured = step_loop.measure(elements, few, step_loop.SCHEMES[name])
        rows.append({"scheme": scheme, "aim": aim} | measured)
    return rows


def fixed_cost(repeats: int) -> float:
    """Return the time of a run of hardly any steps [s].

    Every run pays it once.
    """
    setting = {"model": "central_difference", "coordinates": 2, "courant": 1.0}
    short = Case(PAPER.name, PAPER.segments, PAPER.striker, round_trips=0.25)
    return interleaved([lambda: impactlab_peer.build(short, setting, record=False)], repeats)[0]["solve_s"]
