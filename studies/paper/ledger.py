"""The ledger of the paper's claims and their verdicts.

Each claim is run again, and the page of verdicts is written from the runs.
"""

from __future__ import annotations

import json
from collections import Counter
from functools import cache

from studies.paper import (
    claims_dispersive,  # noqa: F401 - registers its rows
    claims_mechanisms,  # noqa: F401
    claims_method,  # noqa: F401
    claims_results,  # noqa: F401
    claims_rotation,  # noqa: F401
    claims_theory,  # noqa: F401
    claims_waves,  # noqa: F401
)
from studies.paper.claims import ROWS, SECTIONS, VERDICTS, Finding
from studies.paper.problem import CONTACT

INTRODUCTION = """\
# The paper's claims, run again

<!-- Written by `python -m studies paper`; edit studies/paper/claims_*.py, not this page. -->

J. L. Escalona, J. Mayo, J. Domínguez, *A new numerical method for the dynamic analysis of impact loads in flexible
beams*, Mechanism and Machine Theory 34 (1999) 765-780 (EscalonaMayoDominguez1999). Each claim that can be tested was
put to a run of this package. The page is written from those runs, and the script stops if a verdict is no longer
supported by its numbers. The paper's figures, drawn again: [figures](figures/README.md).

Units: $T = 2L/c$, $v_0$ = 1 m/s, $s_0 = \\rho c v_0$. Errors are relative L2 errors over $3\\,T$ against the exact
solution of the continuous rod. "10 of 10" means 10 modes of 10 elements. Unless a row says otherwise the scheme is
Newmark with ten points in the shortest period, as in the paper. *Residual* adds the quasi-static stress of the modes
left out to what the messenger reads (our extension)."""

ROWS.sort(key=lambda item: item.section)  # stable: within a section in the order of the modules


@cache
def findings() -> dict[str, Finding]:
    """Return the findings of all rows in their order."""
    return {item.name: item.test() for item in ROWS}


def unsupported(found: dict[str, Finding]) -> list[str]:
    """Return the rows whose numbers do not support their verdict."""
    return [name for name, finding in found.items() if not finding.stands]


def supported() -> dict[str, Finding]:
    """Return the findings; a verdict without support by its numbers stops the study."""
    found = findings()
    lost = unsupported(found)
    if lost:
        numbers = "".join(f"\n  {name}: {found[name].values}" for name in lost)
        raise SystemExit(f"verdicts without support by their numbers: {', '.join(lost)}{numbers}")
    return found


def page() -> str:
    """Return the ledger as Markdown."""
    found = supported()
    counts = Counter(item.verdict for item in ROWS)
    lines = [
        *INTRODUCTION.splitlines(),
        "",
        "| verdict | claims | meaning |",
        "|---|---|---|",
        *(f"| {verdict} | {counts[verdict]} | {meaning} |" for verdict, meaning in VERDICTS.items()),
        "",
        "All rows again: `python -m studies paper`; one row with all its digits: `python -m studies paper --row NAME`.",
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
    """Return the values with six digits; rounding of zero is zero."""
    return {key: float(f"{value:.6g}") if abs(value) > 1e-9 else 0.0 for key, value in values.items()}


def document() -> str:
    """Return the ledger as JSON, numbers with six digits."""
    found = supported()
    rows = [
        {
            "name": item.name,
            "claim": item.claim,
            "where": f"EscalonaMayoDominguez1999, {item.where}",
            "printed": item.printed,
            "ours": found[item.name].ours,
            "verdict": item.verdict,
            "rerun": item.rerun,
            "values": six_digits(found[item.name].values),
        }
        for item in ROWS
    ]
    return json.dumps({"contact": CONTACT, "rows": rows}, indent=1, ensure_ascii=False) + "\n"
