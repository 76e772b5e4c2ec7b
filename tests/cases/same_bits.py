"""Same case, same bits: the bytes of a run, and its case read again from JSON with its keys in another order."""

from __future__ import annotations

import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import impactlab as il
from impactlab.casefile.document import read_document
from impactlab.history import AbstractHistory

Run = tuple[Path, str, str]  # case file, variant, method
Bits = dict[str, bytes]


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
