"""Answers mutants in processes that may hang or die, and counts how they were answered.

python -m tests.fuzz.fuzz --seed 1 --count 20000 --jobs 2
"""

from __future__ import annotations

import argparse
import collections
import json
import os
import queue
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

HUNG_S = 20.0  # of the processor
WAITING = 15.0  # times as long on the clock, where the machine is busy, or the process waits for ever
COMPILING_S = 120.0  # a first run compiles its law and its scheme
ROOT = Path(__file__).resolve().parents[2]
Row = dict[str, Any]


def work(seed: int, first: int, count: int, runs: int) -> None:
    """Answer a run of mutants, one line of JSON each on standard output, told before and after."""
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
        command = [sys.executable, "-m", "tests.fuzz.fuzz", "--work"]
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
                used = _processor_s(process.pid) - spent
                if begun is None or (used < hung_s and time.monotonic() - since < WAITING * hung_s):
                    continue
                ended = "hung"
                process.kill()
                break
            if line is None:
                break
            row = json.loads(line)
            if "begun" in row:
                begun, spent, since = row["begun"], _processor_s(process.pid), time.monotonic()
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


def _processor_s(pid: int) -> float:
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


def fuzz(seed: int, count: int, jobs: int, first: int = 0, runs: bool = False) -> list[Row]:
    """Return the rows of ``count`` mutants of a seed, answered by ``jobs`` processes."""
    from concurrent.futures import ThreadPoolExecutor

    share = -(-count // jobs)
    starts = [(first + k * share, min(share, count - k * share)) for k in range(jobs) if k * share < count]
    with ThreadPoolExecutor(jobs) as pool:
        return [row for rows in pool.map(lambda each: shard(seed, *each, runs), starts) for row in rows]


def main() -> None:
    """Print the counts of the outcomes, the slowest and largest, and every escape by its last lines."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--work", type=int, nargs=4)
    parser.add_argument("--runs", action="store_true", help="run the mutants, if only shortly")
    parser.add_argument("--rows", type=Path)
    given = parser.parse_args()
    if given.work:
        work(*given.work)
        return
    began = time.perf_counter()
    rows = fuzz(given.seed, given.count, given.jobs, given.first, given.runs)
    print(dict(collections.Counter(row["outcome"] for row in rows)), f"{time.perf_counter() - began:.0f} s")
    for key in ("seconds", "megabytes"):
        worst = sorted(rows, key=lambda row, k=key: -row[k])[:8]
        print(key, [(row["number"], round(row[key], 2)) for row in worst])
    bad = [row for row in rows if row["outcome"] not in ("accepted", "refused")]
    places = collections.Counter(_place(row) for row in bad)
    for place, many in places.most_common():
        print(many, place, [row["number"] for row in bad if _place(row) == place][:6])
    if given.rows:
        given.rows.write_text(json.dumps(rows), encoding="utf-8")


def _place(row: Row) -> str:
    lines = [line.strip() for line in row["text"].strip().splitlines()]
    ours = [line for line in lines if "impactlab/" in line and "File" in line]
    where = ours[-1].split("impactlab/")[-1][:60] if ours else ""
    return f"{row['outcome']}: {where}: {lines[-1][:120] if lines else ''}"


if __name__ == "__main__":
    main()
