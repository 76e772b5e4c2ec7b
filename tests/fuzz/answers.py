"""Loads and checks a mutant as ``impactlab check`` does, and measures time and memory of the answer."""

from __future__ import annotations

import random
import time
import traceback
from pathlib import Path
from typing import Any, NamedTuple

from tests.fuzz.mutants import Mutant, originals


class Answer(NamedTuple):
    """How a mutant was answered."""

    outcome: str  # accepted, refused or escaped
    text: str  # of the refusal, or the traceback
    seconds: float  # of processor time
    megabytes: float  # that the memory of the process grew by, at most; 0 where the system does not say


def answer(mutant: Mutant, seed: int) -> Answer:
    """Return the answer to a mutant: its case, two of its methods and one of its variants, loaded and checked."""
    from impactlab.errors import ImpactlabError

    before = _forget_peak()
    began = time.process_time()
    try:
        refusal = check(mutant, random.Random(seed))
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
    return Answer(outcome, text, time.process_time() - began, _peak() - before)


def check(mutant: Mutant, chance: random.Random) -> str | None:
    """Load and check a mutant; return the refusal of one of its methods, None where all are accepted."""
    from impactlab import simulate
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
            simulate.prepare(chosen.scene())
        except ImpactlabError as error:
            case.place(error)
            refusals.append(str(error))
    return "\n".join(refusals) or None


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
