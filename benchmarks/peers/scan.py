"""Tries every setting of every program on both cases.

It keeps time and errors of each.

    python -m benchmarks.peers.scan [--peer exudyn ...]

Writes ``benchmarks/peers/scans/PEER.csv``, one row per case and setting; `compare.py` times the best of them again.
Settings that fail or do not converge keep a row with the reason.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
from importlib import import_module
from pathlib import Path
from typing import Any

from benchmarks.peers.cases import CASES, NORMS, Case, errors_of
from benchmarks.peers.run import Peer, Setting, timed

PEERS = {
    "impactlab": "impactlab_peer",
    "compiled": "compiled_peer",
    "numpy": "numpy_peer",
    "solve_ivp": "scipy_peer",
    "exudyn": "exudyn_peer",
    "mujoco": "mujoco_peer",
    "opensees": "opensees_peer",
}
FOLDER = Path(__file__).parent / "scans"
COLUMNS = ("case", "setting", "solve_s", *NORMS, "status")
REPEATS = 2
SLOW = 0.1  # s: a setting that takes longer is timed once


def load(name: str) -> Peer:
    """Return the module of a program."""
    module: Any = import_module(f"benchmarks.peers.{PEERS[name]}")
    return module  # type: ignore[no-any-return]


def tried(peer: Peer, case: Case, setting: Setting) -> dict[str, Any]:
    """Return the row of one setting."""
    row = {"case": case.name, "setting": json.dumps(setting), "status": "completed"}
    try:
        run = peer.build(case, setting, record=True)
        run.solve()
        row |= errors_of(run.outcome(), case)
        least = math.inf
        for _ in range(REPEATS):
            least = min(least, timed(peer.build(case, setting, record=False))[0])
            if least > SLOW:
                break
        row["solve_s"] = least
    except Exception as error:  # noqa: BLE001 - a program may fail in any way; the reason is kept
        row["status"] = f"{type(error).__name__}: {error}".splitlines()[0][:120]
    return row


def scan(name: str, cases: list[Case]) -> list[dict[str, Any]]:
    """Return the rows of a program."""
    peer = load(name)
    return [tried(peer, case, setting) for case in cases for setting in peer.settings(case)]


def read(name: str) -> list[dict[str, Any]]:
    """Return the kept rows of a program that completed, empty without a scan.

    Numbers are read as numbers.
    """
    path = FOLDER / f"{name}.csv"
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["status"] == "completed"]
    return [
        {"case": row["case"], "setting": json.loads(row["setting"])}
        | {name: float(row[name]) for name in ("solve_s", *NORMS)}
        for row in rows
    ]


def main() -> None:
    """Scan and write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--peer", nargs="+", choices=PEERS, default=list(PEERS))
    for name in parser.parse_args().peer:
        if load(name).version() is None:
            print(f"{name}: not installed, its stored scan stays")
            continue
        rows = scan(name, list(CASES.values()))
        FOLDER.mkdir(exist_ok=True)
        with (FOLDER / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            for row in rows:
                writer.writerow(
                    {key: f"{value:.4g}" if isinstance(value, float) else value for key, value in row.items()}
                )
        print(f"{name}: {len(rows)} settings, {sum(row['status'] == 'completed' for row in rows)} completed")


if __name__ == "__main__":
    main()
