"""Loads and checks a mutant as ``impactlab check`` does, or runs it shortly; measures time and memory of the answer."""

from __future__ import annotations

import math
import random
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from tests.fuzz.mutants import Mutant, originals

MOST_STEPS = 1000.0  # of a short run
MOST_UNKNOWNS = 500


class Answer(NamedTuple):
    """How a mutant was answered."""

    outcome: str  # accepted, refused or escaped
    text: str  # of the refusal, or the traceback
    seconds: float  # of processor time
    megabytes: float  # that the memory of the process grew by, at most; 0 where the system does not say


def answer(mutant: Mutant, seed: int, runs: bool = False) -> Answer:
    """Return the answer to a mutant: its case, two of its methods and one of its variants, checked or shortly run."""
    from impactlab.errors import ImpactlabError

    before = _forget_peak()
    began = time.process_time()
    try:
        refusal = check(mutant, random.Random(seed), _run_shortly if runs else _prepared)
        outcome, text = ("accepted", "") if refusal is None else ("refused", refusal)
        text.encode("utf-8")
    except ImpactlabError as error:
        outcome, text = "refused", str(error)
        try:
            text.encode("utf-8")
        except UnicodeEncodeError:
            outcome, text = "escaped", "a message that cannot be written: " + ascii(text)
    except BaseException:  # whatever it is: this is what is looked for
        outcome, text = "escaped", traceback.format_exc()
    if "report it" in text:
        outcome = "escaped"
    return Answer(outcome, text, time.process_time() - began, _peak() - before)


def check(mutant: Mutant, chance: random.Random, treat: Callable[[Any], None]) -> str | None:
    """Load a mutant and treat its scenes; return the refusals of its methods, None where all are accepted."""
    from impactlab.casefile.case import case_of
    from impactlab.casefile.document import Document, parse_json, parse_yaml
    from impactlab.casefile.edit import read_setting
    from impactlab.errors import ImpactlabError
    from impactlab.report.console import tree_text

    if mutant.way == "set":
        case = case_of(mutant.name, mutant.name, Document(originals()[mutant.name], {}))
        case = case.with_settings([read_setting(text) for text in mutant.given])
    else:
        read: Any = {"yaml": parse_yaml, "json": parse_json, "data": lambda data: Document(data, {})}[mutant.way]
        case = case_of(mutant.name, mutant.name, read(mutant.given))
    tree_text(case.resolved())
    refusals = []
    ways = [("base", None)]
    ways += [("method", name) for name in _few(case.method_names[1:], 2, chance)]
    ways += [("variant", name) for name in _few(case.variant_names[1:], 1, chance)]
    for kind, name in ways:
        try:
            chosen = case if name is None else case.method(name) if kind == "method" else case.variant(name)
            treat(chosen)
        except ImpactlabError as error:
            case.place(error)
            refusals.append(str(error))
    return "\n".join(refusals) or None


def _prepared(case: Any) -> None:
    from impactlab import api

    api.prepare(case)


def _run_shortly(case: Any) -> None:
    """Run a case that takes few steps, or as much of it as takes few, and summarise it."""
    from impactlab import api
    from impactlab.report.console import summary_text

    scene = case.scene()
    plan = api.prepare(case)
    if case.simulation().method.tolerance is not None:
        return
    steps = float(plan.steps)
    if plan.dt is None:  # an exact run or an adaptive one: waves through the shortest piece
        pieces = [piece for body in scene.bodies.values() for piece in getattr(body, "segments", ())]
        steps = 50.0 * scene.duration / min((piece.length / piece.wave_speed for piece in pieces), default=math.inf)
    if steps > MOST_STEPS:
        case = case.with_settings([("solve.duration", scene.duration * MOST_STEPS / steps), ("snapshots", [])])
    unknowns = sum(body.system.load.size for body in plan.built.values())
    if unknowns <= MOST_UNKNOWNS:
        summary, _ = api.summarised(case, api.run(case), 0.05)
        summary_text(summary)


def _few(names: tuple[str, ...], count: int, chance: random.Random) -> list[str]:
    return chance.sample(list(names), min(count, len(names)))


def _forget_peak() -> float:
    """Make the system forget the largest memory of the process so far; return the memory now [MB]."""
    try:
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    except OSError:
        return 0.0
    return _peak()


def _peak() -> float:
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0.0
    return next((float(line.split()[1]) / 1e3 for line in lines if line.startswith("VmHWM")), 0.0)
