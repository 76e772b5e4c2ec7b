"""Command line of the studies: ``python -m studies NAME ...``.

Options are ``[--out DIR] [--check]``; without a name it lists the studies. ``--check`` writes nothing to docs/ and
fails where a page there differs from the study. Other options are those of one study: ``python -m studies NAME
--help``. Beside these ``studies/same_numbers.py`` compares the numbers of two versions, and with ``python -m``
``studies.first_picture`` draws the animation of the first page, ``studies.error_equation`` measures the stated errors
of single runs, and ``studies.killed_sweeps`` kills sweeps and compares their results.
"""

from __future__ import annotations

import argparse
import sys
import time
from importlib import import_module
from pathlib import Path

from studies.pages import DOCS, Study, changes, write

STUDIES = {
    "audit": "studies.audit.run",
    "beam_bases": "studies.beams.bases",
    "bench": "studies.bench",
    "bounds": "studies.bounds",
    "cases": "studies.cases",
    "dispersive": "studies.beams.dispersive",
    "first_force": "studies.beams.first_force",
    "granular": "studies.granular",
    "hard": "studies.hard",
    "hopkinson": "studies.hopkinson",
    "how_sure": "studies.how_sure",
    "how_to_choose": "studies.how_to_choose",
    "identified_force": "studies.identified_force",
    "instruments": "studies.instruments",
    "matrix": "studies.matrix",
    "methods": "studies.comparison.study",
    "paper": "studies.paper.study",
    "stepped_derivatives": "studies.stepped_derivatives",
    "applications": "studies.applications",
}


def listing() -> str:
    """Return the studies and the pages that they write."""
    lines = []
    for name, module in STUDIES.items():
        found = import_module(module)
        files = ", ".join(f"docs/{path}" for path in found.STUDY.texts)
        lines.append(f"{name:17} {(found.__doc__ or '').splitlines()[0]}")
        lines.append(f"{'':17} {files or 'no page'}; {len(found.STUDY.figures)} figures")
    return "\n".join(lines)


def done(name: str, study: Study, out: Path | None) -> bool:
    """Write a study, or compare its pages with those of docs/.

    It is written into a folder, or into none and only compared. Return whether its pages are those of docs/.
    """
    began = time.process_time()
    if out is not None:
        made = write(study, out)
        print(f"{name}: {len(made)} files in {out}, {time.process_time() - began:.0f} s", flush=True)
        return True
    found = list(changes(study))
    print("\n".join([f"{name}: {len(found)} lines differ, {time.process_time() - began:.0f} s", *found]), flush=True)
    return not found


def main() -> int:
    """Run the studies that the command line names."""
    parser = argparse.ArgumentParser(prog="python -m studies", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="without a name: list the studies")
    parser.add_argument("--out", type=Path, default=DOCS, metavar="DIR", help="folder of the pages and figures")
    parser.add_argument("--check", action="store_true", help="write nothing; fail where a page has changed")
    name, rest = sys.argv[1] if len(sys.argv) > 1 else "", sys.argv[2:]
    if name in STUDIES and rest and rest[0].startswith("-") and rest[0] not in ("--out", "--check"):
        command = import_module(STUDIES[name]).STUDY.command
        if command is not None:
            return int(command(rest))
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in STUDIES]
    if unknown:
        parser.error(f"no study {unknown[0]!r}; there are {', '.join(STUDIES)}")
    if not options.names:
        print(listing())
    out = None if options.check else options.out
    ended = [done(name, import_module(STUDIES[name]).STUDY, out) for name in options.names]
    return 0 if all(ended) else 1


if __name__ == "__main__":
    sys.exit(main())
