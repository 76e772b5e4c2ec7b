"""Same case, same bits: whatever ran before in the process, in whatever order keys stand, from YAML or from JSON.

`tests.cases.test_every_case` asks the same of every case, once.
"""

from __future__ import annotations

import json
import random
import shutil
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

import impactlab as il
from impactlab.casefile.document import read_document
from impactlab.history import AbstractHistory
from tests.cases.support import CASES

Run = tuple[Path, str, str]  # case file, variant, method
Bits = dict[str, bytes]

# One of each kind of run: modes and their chatter, the exact solver with several bodies, sums of three energies.
TELLING = ("axial_impact", "dead_weight_preload", "several_masses")


def runs_of(files: Iterable[Path]) -> list[Run]:
    """Return every method of every variant of some case files, in file order."""
    found: list[Run] = []
    for file in files:
        case = il.load_case(file)
        for variant in case.variant_names:
            found += [(file, variant, method) for method in case.variant(variant).method_names]
    return found


def bits(case: il.Case) -> Bits:
    """Run a case and return the bytes of all channels, of its events and its energy balance."""
    return bits_of(il.run(case))


def bits_of(history: AbstractHistory) -> Bits:
    """Return the bytes of a run that has been."""
    t = np.linspace(0.0, history.duration, 1501)
    found = {channel: history.evaluate(t, channel).tobytes() for channel in history.channels()}
    found["events"] = np.array([event.time for event in history.events]).tobytes()
    found["balance"] = history.energy.balance.tobytes()
    return found


def as_given(run: Run) -> il.Case:
    """Return the case of a run, read from its file."""
    file, variant, method = run
    return il.load_case(file).variant(variant).method(method)


def rewritten(folder: Path, change: Callable[[Any], Any]) -> Callable[[Run], il.Case]:
    """Return how to read the case of a run from a JSON file whose data were changed."""

    def read(run: Run) -> il.Case:
        file, variant, method = run
        for table in file.parent.glob(f"{file.stem}*.csv"):
            shutil.copy(table, folder)
        written = folder / f"{file.stem}.json"
        written.write_text(json.dumps(change(plain(read_document(file).data))), encoding="utf-8")
        return il.load_case(written).variant(variant).method(method)

    return read


def plain(value: Any) -> Any:
    """Return data of a document as JSON has them."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, (list, tuple)) else value


def shuffled(value: Any, draw: random.Random) -> Any:
    """Return data with the keys of every block in another order."""
    if isinstance(value, dict):
        keys = list(value)
        draw.shuffle(keys)
        return {key: shuffled(value[key], draw) for key in keys}
    return [shuffled(item, draw) for item in value] if isinstance(value, list) else value


Pass = tuple[str, list[Run], Callable[[Run], il.Case]]  # what differs from the first one, order of runs, their cases


def one_by_one(runs: list[Run], folder: Path) -> list[Pass]:
    """Return a pass in reverse from JSON, and one in an order of its own with shuffled keys."""
    draw = random.Random(7)
    mixed = list(runs)
    draw.shuffle(mixed)
    return [
        ("reversed, from JSON", runs[::-1], rewritten(folder, lambda data: data)),
        ("mixed, keys shuffled", mixed, rewritten(folder, lambda data: shuffled(data, draw))),
    ]


def differences(runs: list[Run], passes: list[Pass]) -> list[str]:
    """Return the arrays whose bits differ from those of a first pass, in file order from YAML."""
    first = {run: bits(as_given(run)) for run in runs}
    found = []
    for label, order, read in passes:
        for run in order:
            seen = bits(read(run))
            assert set(seen) == set(first[run])
            where = f"{label}: {run[0].stem}/{run[1]}/{run[2]}"
            found += [f"{where} {name}" for name, array in first[run].items() if seen[name] != array]
    return found


def test_bits_depend_on_what_ran_before_or_on_the_order_of_keys(tmp_path: Path) -> None:
    runs = [*runs_of(CASES / f"{name}.yaml" for name in TELLING), (CASES / "all_methods.yaml", "base", "adaptive")]
    assert differences(runs, one_by_one(runs, tmp_path)) == []
