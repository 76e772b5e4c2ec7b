"""Kills sweeps at random moments and compares the kept results: ``python -m studies.killed_sweeps [--points 10000]``.

A sweep of the paper's rod in a pool of two processes is killed 20 times, one on a local Dask cluster over TCP five
times, and five times a worker of such a cluster. Each ends with the bits of a sweep that nothing disturbed: no point is
lost, repeated or changed. Writes no page.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import impactlab as il
from impactlab.sweeps import counts

CASE = Path(__file__).parents[1] / "cases" / "axial_impact.yaml"
QUANTITIES = "impulse,contacts,peak_force"


def command(out: Path, points: int, *options: str) -> list[str]:
    """Return the command of the sweep.

    An axis of methods keeps each point a run of its own.
    """
    main = "from impactlab.cli import main; main()"
    over = f"--over=bodies.hammer.mass=0.5 kg:5 kg:{points}log"
    own = ["sweep", str(CASE), "--over=method=continuous", over, f"--quantities={QUANTITIES}", "--out", str(out)]
    return [sys.executable, "-c", main, *own, *options]


def chunks(out: Path) -> dict[str, int]:
    """Return the names of kept chunks with the time at which each was written [ns]."""
    return {path.name: path.stat().st_mtime_ns for path in out.glob("chunks/*.npz")}


def tree(pid: int) -> list[int]:
    """Return the processes below one, the nearest first."""
    texts = [path.read_text() for path in Path(f"/proc/{pid}/task").glob("*/children")]  # each thread may start some
    found = [int(child) for child in " ".join(texts).split()]
    return found + [deep for child in found for deep in tree(child)]


def workers_of(pid: int) -> list[int]:
    """Return the worker processes of a local cluster.

    They are those that have loaded compiled code of impactlab.
    """
    found = []
    for child in tree(pid):
        try:
            maps = Path(f"/proc/{child}/maps").read_text()
        except OSError:
            continue
        if "llvmlite" in maps:
            found.append(child)
    return found


def killed(out: Path, whole: list[str], kills: int, chance: random.Random, *, worker: bool = False) -> tuple[int, int]:
    """Run a sweep that is killed several times.

    Return the kills that hit and the chunks that were written twice. The killed process is the one that calls, or a
    ``worker`` of its cluster.
    """
    hit = twice = 0
    while True:
        before = chunks(out)
        process = subprocess.Popen(whole, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while worker and hit < kills and process.poll() is None:
            while process.poll() is None and len(chunks(out)) < 2:
                time.sleep(0.05)
            time.sleep(chance.uniform(0.5, 4.0))
            victims = workers_of(process.pid) if process.poll() is None else []
            if victims:
                os.kill(chance.choice(victims), signal.SIGKILL)
                hit += 1
        if not worker and hit < kills:
            while process.poll() is None and len(chunks(out)) <= len(before):
                time.sleep(0.02)
            time.sleep(chance.uniform(0.0, 1.0))
            if process.poll() is None:
                process.kill()
                hit += 1
        process.wait()
        after = chunks(out)
        twice += sum(after.get(name) != written for name, written in before.items())
        if process.returncode == 0:
            return hit, twice
        if worker and process.returncode not in (0, -9):
            raise RuntimeError(f"the sweep ended with {process.returncode}")


def main() -> None:
    """Run the trials and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="trials whose names hold this text")
    asked = parser.parse_args()
    chance, failed = random.Random(asked.seed), False
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        began = time.perf_counter()
        subprocess.run(command(folder / "whole", asked.points, "--workers", "2"), check=True)
        whole = il.open_sweep(folder / "whole")
        print(
            f"undisturbed: {counts(whole)}, {len(chunks(folder / 'whole'))} chunks, {time.perf_counter() - began:.0f} s"
        )
        for trial, kills, options, worker in (
            ("pool, caller killed", 20, ("--workers", "2"), False),
            ("cluster, caller killed", 5, ("--cluster", "local:2"), False),
            ("cluster, worker killed", 5, ("--cluster", "local:2"), True),
        ):
            if asked.only not in trial:
                continue
            out, began = folder / trial.replace(" ", "-"), time.perf_counter()
            hit, twice = killed(out, command(out, asked.points, *options), kills, chance, worker=worker)
            found = il.open_sweep(out)
            same = all(
                np.array_equal(found[each].values, whole[each].values, equal_nan=each not in ("reason",))
                for each in (*QUANTITIES.split(","), "status")
            )
            failed |= not same or twice > 0 or hit < kills
            print(
                f"{trial}: {hit} kills, {counts(found)}, same bits {same}, {twice} chunks written twice, "
                f"{time.perf_counter() - began:.0f} s",
                flush=True,
            )
    sys.exit(failed)


if __name__ == "__main__":
    main()
