"""Points of a sweep: their runs, their results as rows, and shared content."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, NamedTuple

import numpy as np

import impactlab
from impactlab import api
from impactlab.casefile import Case
from impactlab.errors import ImpactlabError, StepError
from impactlab.jobs.sources import code_hash, numeric_environment, plugin_modules, top, tree_hash
from impactlab.plugins import QUANTITIES
from impactlab.report.summary import status_of
from impactlab.startup.cached import cached_property
from impactlab.sweeps import axes
from impactlab.sweeps.axes import Points
from impactlab.sweeps.batch import Batch, batch_of
from impactlab.sweeps.chunks import ENGINES, STATUSES, Chunk
from impactlab.sweeps.quantities import WantedQuantity, values
from impactlab.sweeps.sampled import extreme_in, frames_of

MAX_REASON = 300  # characters
LOG = logging.getLogger("impactlab")


@dataclass(frozen=True)
class Sweep:
    """All that the results of a sweep depend on."""

    case: Case
    points: Points
    wanted: tuple[WantedQuantity, ...]

    @cached_property
    def extremes(self) -> list[str]:
        """Names of quantities that are extremes of channels."""
        return [each.name for each in self.wanted if extreme_in(each.name) is not None]

    @cached_property
    def batch(self) -> Batch | None:
        """The points as a batch, or None where they are runs of their own."""

        def single(number: int) -> list[list[float]] | None:
            found = row(self, number)
            return found.values if found.status == STATUSES.index("completed") else None

        found = batch_of(self.case, self.points, self.wanted, single)
        if isinstance(found, str):
            LOG.info("each point is a run of its own: %s", found)
            return None
        return found

    def __getstate__(self) -> dict[str, Any]:
        """Return it without the batch, which holds memory of this process."""
        return {name: value for name, value in vars(self).items() if name != "batch"}

    def content(self, command: str = "") -> dict[str, Any]:
        """Return it as plain values: two sweeps of the same content have the same results."""
        found = [
            {"path": axis.path, "values": axis.values, "si": axis.si, "unit": axis.unit} for axis in self.points.axes
        ]
        return {
            **origin_of(self.case),
            "axes": found,
            "listed": self.points.listed,
            **({"design": dict(self.points.design)} if self.points.design else {}),
            "quantities": [each._asdict() for each in self.wanted],
            "plugins": {name: tree_hash(name) for name in sorted(self._modules())},
            "version": impactlab.__version__,
            "date": datetime.now(UTC).isoformat(timespec="seconds"),
            "command": command,
        }

    def _with(self, axis: axes.Axis, value: Any) -> Case:
        """Return the case with a value of an axis alone; of a kind that lacks keys alone, at the first such point."""
        try:
            return axes.at_point(self.case, {axis.path: value})
        except ImpactlabError:
            return axes.at_point(self.case, self.points.first_with(axis, value))

    def _modules(self) -> set[str]:
        """Return the top modules of plugins that the results come from."""
        names = [each.name for each in self.wanted]
        entries = [each for each in self.case.registry.entries if each.group == QUANTITIES.name and each.name in names]
        cases = [self.case]
        for axis in self.points.axes:
            if not axis.is_numeric:
                distinct = {repr(value): value for value in axis.values}.values()
                cases += [self._with(axis, value) for value in distinct]
        return ({top(each) for each in entries} | {name for case in cases for name in plugin_modules(case)}) - {
            "impactlab"
        }


def origin_of(case: Case) -> dict[str, Any]:
    """Return the part of the content of a sweep that its axes were checked against."""
    return {
        "schema_version": 2,
        "name": case.label,
        "case": {"document": case.document.data, "variant": case.variant_name, "method": case.method_name},
        "resolved": case.resolved(),
        "code": code_hash(),
        "environment": numeric_environment(),
    }


class PointResult(NamedTuple):
    """Results of a point."""

    status: int
    reason: str
    values: list[list[float]]


def row(made: Sweep, number: int) -> PointResult:
    """Return the results of a point; its values are missing without a run.

    A run may be refused or fail.
    """
    try:
        case = made.points.case(made.case, number)
        frames = frames_of(made.extremes, case.scene()) if made.extremes else 0
        with api.warnings_kept():
            history = api.run(case, frames=frames)
        found = values(history, made.wanted, case.registry)
        return PointResult(STATUSES.index(status_of(history)), "", found)
    except ImpactlabError as error:
        return missing(made, "failed" if isinstance(error, StepError) else "refused", error.in_a_line())
    except Exception as error:  # noqa: BLE001 - a part may raise anything; its point reports it
        return missing(made, "failed", f"{type(error).__name__}: {error}")


def missing(made: Sweep, status: str, reason: str) -> PointResult:
    """Return a point without values."""
    text = " ".join(reason.split())[:MAX_REASON]
    return PointResult(STATUSES.index(status), text, [[math.nan] * each.size for each in made.wanted])


def chunk_of(first: int, rows: Sequence[PointResult], wanted: Sequence[WantedQuantity]) -> Chunk:
    """Return the chunk of consecutive points."""
    tables = tuple(np.array([each.values[k] for each in rows], dtype=float) for k in range(len(wanted)))
    status = np.array([each.status for each in rows], np.int8)
    engine = np.full(len(rows), ENGINES.index("run"), np.int8)
    return Chunk(first, status, tuple(each.reason for each in rows), tables, engine)
