"""The page of an uncertainty: distributions of its quantities, probabilities of contacts, Sobol indices."""

from __future__ import annotations

import re
from collections.abc import Collection
from functools import partial
from pathlib import Path

from impactlab.report import facts
from impactlab.report.figures.figure_files import PageFigure, write_figures
from impactlab.report.page import write_study
from impactlab.report.provenance import Provenance
from impactlab.scene.problem import Scene
from impactlab.sweeps.result import clauses, counts
from impactlab.sweeps.sampled import is_sampled
from impactlab.uncertainties.result import Uncertainty

CAPTION = (
    "Left the samples, right the probability of a smaller value; dots are percentiles with their 95 % intervals. "
    "Dashed: a normal distribution with mean and deviation of the linear estimate."
)
BAND = "Between the outer percentiles, with the mean; dashed: the run at the means."
COUNTS = "Bars are shares of the samples, lines their 95 % intervals."
INDICES = (
    "First: the share of the variance that the number explains alone. Total: the share "
    "including its interactions. Lines are 95 % intervals."
)


def write_page(folder: Path, found: Uncertainty, scene: Scene, origin: Provenance, links: Collection[str] = ()) -> None:
    """Write ``index.html`` and ``figures/`` of an uncertainty into its folder.

    ``links`` are the names of the contacts that are joined from the start.
    """
    figures, rules = write_figures(folder, _figures(found))
    write_study(
        folder / "index.html",
        "impactlab.uncertainties",
        scene,
        origin,
        title=origin.title or f"Uncertainty of {found.case}",
        kicker=f"impactlab · {found.samples:,} samples of {_numbers(len(found.uncertain))}",
        facts=[*_facts(found), *facts.scene_facts(scene, links)],
        figures=figures,
        rules=rules,
        tables=found.tables,
        warnings=found.warnings,
        files=[
            ("uncertainty.json", "all estimates with their intervals"),
            ("table.csv", "a row for each point"),
            ("sweep.nc", "labelled data, for xarray"),
            ("case.yaml", "the case"),
            ("citations.bib", "sources to cite"),
            *([("figures/", "SVG, PNG")] if figures else []),
        ],
    )


def _figures(found: Uncertainty) -> list[PageFigure]:
    """Return the figures of the page."""
    figures = []
    if found.shares:
        figures.append(PageFigure("contacts", "Number of periods of contact", COUNTS, partial(found.plot, "contacts")))
    if found.known_indices:
        figures.append(PageFigure("indices", "Sobol indices", INDICES, found.plot_indices))
    captions = {True: BAND, False: CAPTION}
    for name in dict.fromkeys(each.quantity for each in found.spreads if each.varies and each.quantity != "contacts"):
        sampled = is_sampled(name)
        title = name if sampled else clauses(found.data[name])[0]
        draw = partial(found.plot, name)
        figures.append(PageFigure(re.sub(r"\W+", "_", name), title, captions.get(sampled, ""), draw))
        captions.pop(sampled, None)  # the first figure of a kind explains it
    return figures


def _facts(found: Uncertainty) -> list[tuple[str, str]]:
    points = ", ".join(f"{count:,} {status}" for status, count in counts(found.data).items())
    return [
        *((each.path, each.text) for each in found.uncertain),
        ("samples", f"{found.samples:,} scrambled Sobol points, seed {found.seed}"),
        ("points", points),
    ]


def _numbers(count: int) -> str:
    return "one number" if count == 1 else f"{count} numbers"
