"""Loads and checks a mutant as ``impactlab check`` does, or runs it shortly; measures time and memory of the answer."""

from __future__ import annotations

import dataclasses
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
    from impactlab.console import tree_text
    from impactlab.errors import ImpactlabError

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
            treat(chosen.scene())
        except ImpactlabError as error:
            case.place(error)
            refusals.append(str(error))
    return "\n".join(refusals) or None


def _prepared(scene: Any) -> None:
    from impactlab import simulate

    simulate.prepare(scene)


def _run_shortly(scene: Any) -> None:
    """Run a scene that takes few steps, or as much of it as takes few."""
    from impactlab import simulate
    from impactlab.choice.times import echoes

    if scene.tolerance is not None:
        _prepared(scene)
        return
    plan = simulate.prepare(scene)
    steps = plan.steps if plan.dt is not None else echoes(scene) if plan.march is None else 1.0
    if steps > MOST_STEPS:
        scene = dataclasses.replace(scene, duration=scene.duration * MOST_STEPS / steps, snapshots=())
    unknowns = sum(body.system.load.size for body in plan.built.values())
    if unknowns <= MOST_UNKNOWNS:
        simulate.run(scene)


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
