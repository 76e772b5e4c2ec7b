"""The ledger of the paper's claims: each is run again, and the page of verdicts is written from the runs.

``python -m studies.paper.ledger`` writes docs/paper/ledger.md and ledger.json; ``--row NAME`` prints one row and
its numbers. A verdict that its own numbers no longer support stops the script.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from pathlib import Path

from studies.pages import DOCS
from studies.paper import (
    claims_dispersive,  # noqa: F401 - registers its rows
    claims_method,  # noqa: F401
    claims_results,  # noqa: F401
    claims_theory,  # noqa: F401
    claims_waves,  # noqa: F401
)
from studies.paper.claims import ROWS, SECTIONS, VERDICTS, Finding
from studies.paper.problem import CONTACT

INTRODUCTION = """\
# The paper's claims, run again

<!-- Written by `python -m studies.paper.ledger`; edit studies/paper/claims_*.py, not this page. -->

J. L. Escalona, J. Mayo, J. Domínguez, *A new numerical method for the dynamic analysis of impact loads in flexible
beams*, Mechanism and Machine Theory 34 (1999) 765-780 (EscalonaMayoDominguez1999). Each claim that can be tested was
put to a run of this package. The page is written from those runs, and the script stops if a verdict is no longer
supported by its numbers. The paper's figures, drawn anew: [figures](figures/README.md).

Units: T = 2L/c, v0 = 1 m/s, s0 = rho c v0. Errors are relative L2 errors over 3 T against the exact solution of the
continuous rod. "10 of 10" means 10 modes of 10 elements. Unless a row says otherwise the scheme is Newmark with ten
points in the shortest period, as in the paper. *Residual* adds the quasi-static stress of the modes left out to what
the messenger reads (our extension)."""

ROWS.sort(key=lambda item: item.section)  # stable: within a section in the order of the modules


def findings(names: list[str] | None = None) -> dict[str, Finding]:
    """Return the findings of the rows, all or those named, in their order."""
    return {item.name: item.test() for item in ROWS if names is None or item.name in names}


def unsupported(found: dict[str, Finding]) -> list[str]:
    """Return the rows whose numbers do not support their verdict."""
    return [name for name, finding in found.items() if not finding.stands]


def page(found: dict[str, Finding]) -> str:
    """Return the ledger as Markdown."""
    counts = Counter(item.verdict for item in ROWS)
    lines = [
        *INTRODUCTION.splitlines(),
        "",
        "| verdict | claims | meaning |",
        "|---|---|---|",
        *(f"| {verdict} | {counts[verdict]} | {meaning} |" for verdict, meaning in VERDICTS.items()),
        "",
        "All rows again: `python -m studies.paper.ledger`; one row with all its digits: `python "
        "-m studies.paper.ledger --row NAME`.",
    ]
    for section, title in SECTIONS.items():
        lines += [
            "",
            f"## {title}",
            "",
            "| claim | where | printed | ours | verdict | run it again |",
            "|---|---|---|---|---|---|",
        ]
        for item in ROWS:
            if item.section == section:
                again = f"`{item.rerun}`" if not item.rerun.startswith("no run") else item.rerun
                cells = (
                    f'<a id="{item.name}"></a>{item.claim}', item.where, item.printed, found[item.name].ours,
                    f"**{item.verdict}**", again,
                )  # fmt: skip
                lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def six_digits(values: dict[str, float]) -> dict[str, float]:
    """Return the values with six digits; what is rounding of zero is zero."""
    return {key: float(f"{value:.6g}") if abs(value) > 1e-9 else 0.0 for key, value in values.items()}


def document(found: dict[str, Finding]) -> str:
    """Return the ledger as JSON, numbers with six digits."""
    rows = [
        {
            "name": item.name,
            "claim": item.claim,
            "where": f"EscalonaMayoDominguez1999, {item.where}",
            "printed": item.printed,
            "ours": found[item.name].ours,
            "verdict": item.verdict,
            "rerun": item.rerun,
            "values": {
                key: float(f"{value:.6g}") if abs(value) > 1e-9 else 0.0
                for key, value in found[item.name].values.items()
            },
        }
        for item in ROWS
    ]
    return json.dumps({"contact": CONTACT, "rows": rows}, indent=1, ensure_ascii=False) + "\n"


def write(out: Path) -> int:
    """Run all rows and write the ledger; return 1, and write nothing, where a verdict has lost its support."""
    found = findings()
    lost = unsupported(found)
    if lost:
        print(f"verdicts no longer supported by their numbers: {', '.join(lost)}", file=sys.stderr)
        for name in lost:
            print(f"  {name}: {found[name].values}", file=sys.stderr)
        return 1
    out.mkdir(parents=True, exist_ok=True)
    (out / "ledger.md").write_text(page(found), encoding="utf-8")
    (out / "ledger.json").write_text(document(found), encoding="utf-8")
    print(f"{len(ROWS)} claims: {out / 'ledger.md'}, {out / 'ledger.json'}")
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description="Run the paper's claims again and write the ledger.")
    parser.add_argument("--out", type=Path, default=DOCS / "paper", help="folder of ledger.md and ledger.json")
    parser.add_argument("--row", choices=[item.name for item in ROWS], help="print one row instead")
    options = parser.parse_args()
    if options.row:
        item = next(item for item in ROWS if item.name == options.row)
        found = item.test()
        print(f"{item.where}: {item.claim}\nprinted: {item.printed}\nours: {found.ours}\nverdict: {item.verdict}")
        print("\n".join(f"  {key} = {value:.12g}" for key, value in found.values.items()))
        return 0 if found.stands else 1
    return write(options.out)


if __name__ == "__main__":
    sys.exit(main())
