"""Where a result comes from: the command, the resolved case, its sources, version and date."""

from __future__ import annotations

import os
from datetime import UTC, datetime
from typing import NamedTuple

import impactlab
from impactlab.casefile import Case
from impactlab.cite import cite


class Provenance(NamedTuple):
    """Where a result comes from, as texts of a case or of a file."""

    title: str = ""
    source: str = ""
    command: str = ""  # that repeats it; empty: the plain command of the case
    case_yaml: str = ""  # the case with variant, method and set values in place
    citations: str = ""  # BibTeX
    version: str = impactlab.__version__
    date: str = ""  # UTC; empty: now


def of_case(case: Case, command: str = "") -> Provenance:
    """Return the provenance of a run of a case, dated now or at ``SOURCE_DATE_EPOCH``."""
    return Provenance(case.title, case.source, command, case.to_yaml(), cite(case).bibtex, date=now())


def now() -> str:
    """Return the instant in UTC to the minute, or that of the environment's ``SOURCE_DATE_EPOCH`` [s]."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    instant = datetime.fromtimestamp(int(epoch), UTC) if epoch.isdigit() else datetime.now(UTC)
    return f"{instant:%Y-%m-%d %H:%M} UTC"
