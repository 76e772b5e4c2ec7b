"""Every method on the hard cases: hard-cases.md, from a table.

It is the stored table of ``impactlab bench --suite hard``. A violation in the table stops the study. ``python -m
studies hard --run`` measures the table again.
"""

from __future__ import annotations

import argparse
import gzip
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from impactlab.bench.report.read import read_table
from impactlab.bench.report.stability import markdown, report
from impactlab.bench.report.verdicts import ERROR_WARN, faults
from impactlab.bench.schema import Row
from studies.pages import DOCS, ROOT, Study

TABLE = DOCS / "bench" / "hard.csv.gz"

HEAD = f"""# Hard cases: every method where methods break

Written by `python -m studies hard` from the table of `impactlab bench --suite hard`; the cases are in
[cases/hard](../cases/hard), each with its purpose and its exact solution; the methods are in
`impactlab/bench/hard.yaml` and, named `own`, in the cases themselves.

A run may end in three ways: completed; refused before its first step, with reason and remedy; failed, with an error
that holds the time reached and the history so far. Anything else is a violation: a hang, a crash, a number that is
not finite, momentum that does not balance, energy gained without a warning, or an error above {100 * ERROR_WARN:.0f} %
of displacement or impulse without a warning.
"""
SEVERAL = """Rows are of several versions of the code; `--run` measures all of them again.
"""
TIME_LIMIT = 1200  # s of a row, from which it has hung: the longest takes 30 s alone, and 300 s beside other work


def run(table: Path) -> None:
    """Measure the table again and store it without times."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "impactlab", "bench", "--suite", "hard", "--no-timing", "--jobs", "0"]
        command += ["--time-limit", str(TIME_LIMIT)]
        subprocess.run([*command, "--out", folder], cwd=ROOT, check=True)
        store(Path(folder) / "table.csv", table)


def store(source: Path, table: Path) -> None:
    """Keep a table compressed; the same table gives the same file."""
    table.parent.mkdir(exist_ok=True)
    table.write_bytes(gzip.compress(source.read_bytes(), mtime=0))


def page(rows: Sequence[Row]) -> str:
    """Return the text of the page."""
    codes = sorted({row.code for row in rows})
    several = f"{SEVERAL}\n" if len(codes) > 1 else ""
    with_ = ", ".join(sorted({f"Python {row.python}, numpy {row.numpy}, numba {row.numba}" for row in rows}))
    return f"{HEAD}\nCode {', '.join(codes)}; {with_}.\n\n{several}{markdown(report(rows))}"


def text(_: str) -> str:
    """Return the page; a violation in the table stops the study."""
    rows = read_table(TABLE)
    found = [f"{row.scene} {row.method}: {fault}" for row, fault in faults(rows)]
    if found:
        raise SystemExit("\n".join(found))
    return page(rows)


def command(arguments: Sequence[str]) -> int:
    """Measure the table again, or store one."""
    parser = argparse.ArgumentParser(prog="python -m studies hard", description="Store the table of the hard cases.")
    parser.add_argument("--run", action="store_true", help="measure the table again: half an hour on two cores")
    parser.add_argument("--table", type=Path, help="a table.csv to store")
    options = parser.parse_args(arguments)
    if options.table is not None:
        store(options.table, TABLE)
    elif options.run:
        run(TABLE)
    return 0


STUDY = Study({"hard-cases.md": text}, command=command)
