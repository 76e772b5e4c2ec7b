"""Answers mutants in processes that may hang or die; a process is one run of this module."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

from tests.support import ROOT

HUNG_S = 20.0  # of the processor
WAITING = 15.0  # times as long on the clock, where the machine is busy, or the process waits without end
COMPILING_S = 120.0  # a first run compiles its law and its scheme
Row = dict[str, Any]


def work(seed: int, first: int, count: int, runs: int) -> None:
    """Answer mutants one by one; print a line of JSON before and after each."""
    from impactlab.report import console  # noqa: F401 - imported before memory is measured
    from tests.fuzz.answers import answer
    from tests.fuzz.mutants import mutant

    answer(mutant(0, 0), 0)
    for number in range(first, first + count):
        print(json.dumps({"begun": number}), flush=True)
        found = answer(mutant(seed, number), number, bool(runs))
        print(json.dumps({"done": number, **found._asdict()}), flush=True)


def shard(seed: int, first: int, count: int, runs: bool = False) -> list[Row]:
    """Return one row per mutant, answered in a process that is started again where it hangs or dies."""
    rows: list[Row] = []
    hung_s = COMPILING_S if runs else HUNG_S
    last = first + count
    while first < last:
        command = [sys.executable, "-m", "tests.fuzz.fuzz"]
        command += [str(each) for each in (seed, first, last - first, int(runs))]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT)
        lines: queue.Queue[str | None] = queue.Queue()
        errors: list[str] = []
        threads = [
            threading.Thread(target=_read, args=(process.stdout, lines), daemon=True),
            threading.Thread(target=_read_all, args=(process.stderr, errors), daemon=True),
        ]
        for thread in threads:
            thread.start()
        begun, ended, spent, since = None, "", 0.0, 0.0
        while True:
            try:
                line = lines.get(timeout=5.0)
            except queue.Empty:
                used = processor_s(process.pid) - spent
                if begun is None or (used < hung_s and time.monotonic() - since < WAITING * hung_s):
                    continue
                ended = "hung"
                process.kill()
                break
            if line is None:
                break
            row = json.loads(line)
            if "begun" in row:
                begun, spent, since = row["begun"], processor_s(process.pid), time.monotonic()
            else:
                rows.append({"number": row.pop("done"), **row})
                first = rows[-1]["number"] + 1
                begun = None
        process.wait()
        for thread in threads:
            thread.join(5.0)
        printed = "".join(errors)
        if begun is not None:
            rows.append({"number": begun, "outcome": ended or "died", "text": printed[-3000:], "seconds": hung_s})
            rows[-1]["megabytes"] = 0.0
            first = begun + 1
        elif first < last:
            raise RuntimeError(f"a worker ended early: {printed[-2000:]}")
        elif "Traceback" in printed or "Exception ignored" in printed:
            rows.append({"number": -1, "outcome": "printed", "text": printed[-3000:], "seconds": 0.0, "megabytes": 0.0})
    return rows


def processor_s(pid: int) -> float:
    """Return the processor time of a process [s], whatever else the machine does; 0 of one that has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    except (OSError, ProcessLookupError):
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _read(stream: Any, lines: queue.Queue[str | None]) -> None:
    for line in stream:
        lines.put(line)
    lines.put(None)


def _read_all(stream: Any, texts: list[str]) -> None:
    texts.append(stream.read())


def fuzz(seed: int, count: int, jobs: int, runs: bool = False) -> list[Row]:
    """Return the rows of ``count`` mutants of a seed, answered by ``jobs`` processes."""
    from concurrent.futures import ThreadPoolExecutor

    share = -(-count // jobs)
    starts = [(k * share, min(share, count - k * share)) for k in range(jobs) if k * share < count]
    with ThreadPoolExecutor(jobs) as pool:
        return [row for rows in pool.map(lambda each: shard(seed, *each, runs), starts) for row in rows]


if __name__ == "__main__":
    work(*map(int, sys.argv[1:]))
