"""The page of a fit: parameters with their intervals, signals, residuals, profiles and correlations."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from impactlab.fits.identifiable import Product
from impactlab.fits.loss import from_median
from impactlab.fits.plots import (
    MIN_CORRELATED,
    determined,
    name_of,
    plot_autocorrelations,
    plot_correlations,
    plot_profiles,
    plot_signals,
    unit_of,
)
from impactlab.fits.result import JACOBIAN, KINDS, METHODS, WIDENED, Fit, Fitted, Shown, case_files, in_words
from impactlab.history.units import UNITS
from impactlab.printing import counted
from impactlab.report import facts
from impactlab.report.figures.figure_files import PageFigure, write_figures
from impactlab.report.page import write_study
from impactlab.report.provenance import of_case

PAGE = "fit.html"
POWERS = "⁰¹²³⁴⁵⁶⁷⁸⁹"
NOISE = {
    "white": "white noise",
    "ar1": "noise that correlates from sample to sample (ar1)",
    "std": "the standard deviation given for each sample",
}
LOSS = {"linear": "least squares", "huber": "Huber's loss, in which samples far off count less"}


def _figures(fit: Fit) -> Iterator[PageFigure]:
    """Yield the figures of a fit."""
    yield PageFigure(
        "signals", "Signals", "Measured and fitted signal; below, the residuals divided by their standard deviation. "
        "The band extends two standard deviations to each side: of white noise, 95 % of the residuals lie inside, "
        "without a pattern.",
        partial(plot_signals, fit),
    )  # fmt: skip
    yield PageFigure(
        "autocorrelation", "Autocorrelation of the residuals", "Correlation of the residuals with those some samples "
        "earlier. Beyond the band (95 % of white noise) the noise is coloured, or an effect is missing in the case.",
        partial(plot_autocorrelations, fit),
    )  # fmt: skip
    if fit.profiles:
        yield PageFigure(
            "profiles", "Profiles", "Rise of the least sum of squares, over the variance of the residuals, with one "
            "parameter fixed and all others fitted again. The 95 % interval ends where the rise passes the line. Where "
            "the profile differs from the parabola of the derivatives, the intervals from the derivatives are not "
            "valid.",
            partial(plot_profiles, fit),
        )  # fmt: skip
    known = determined(fit)
    if len(known) >= MIN_CORRELATED:
        without = "" if len(known) == len(fit.parameters) else " Without those that the signals do not determine."
        yield PageFigure(
            "correlations", "Correlations", "Of the estimates: close to 1 or \N{MINUS SIGN}1, two numbers can change "
            f"together with little change of the signals.{without}", partial(plot_correlations, fit),
        )  # fmt: skip


def write_page(folder: Path, fit: Fit, command: str = "") -> None:
    """Write ``fit.html`` and ``figures/`` of a fit into a folder that has its other files."""
    figures, rules = write_figures(folder, _figures(fit))
    kinds = [kind for kind in KINDS if any(kind in each.intervals for each in fit.parameters)]
    (scene, method), origin = fit.case.simulation(), of_case(fit.case, command)
    write_study(
        folder / PAGE,
        "impactlab.fits",
        scene,
        origin,
        title=origin.title or fit.case.label,
        kicker=f"impactlab · a fit of {counted(len(fit.parameters), 'number')}",
        facts=[*_facts(fit), *facts.scene_facts(scene, facts.joined_in(scene, method))],
        findings=[_raised(text[:1].upper() + text[1:]) + "." for text in fit.undetermined],
        warnings=[text.partition(": ")[2] for text in fit.warnings],
        headings=[f"95 %, {METHODS[kind]}" for kind in kinds],
        rows=[_row(each, name_of(fit, each.path), kinds) for each in fit.parameters],
        products=[_product(each, kinds) for each in fit.determined],
        figures=figures,
        rules=rules,
        files=[
            *((name, "a fitted case: it runs") for name in case_files(fit)),
            ("parameters.csv", "the table"),
            ("fit.json", "all numbers"),
            ("figures/", "SVG, PNG"),
        ],
    )


def _row(each: Fitted, name: str, kinds: list[str]) -> dict[str, Any]:
    """Return a number as a row of the table, in a suitable unit."""
    known = [abs(end) for end in each.intervals[JACOBIAN] if math.isfinite(end)]
    unit = unit_of(each.unit, max([abs(each.value), *known]))
    ends = [each.intervals.get(kind) for kind in kinds]
    cells = ["" if end is None else _raised(in_words(each.value, *end, unit.size)[1]) for end in ends]
    value = in_words(each.value, *each.intervals[JACOBIAN], unit.size)[0]
    value = _raised(f"{value}\N{NO-BREAK SPACE}{unit.label}".rstrip())
    return {
        "name": name,
        "under": each.path if each.path != name else "",
        "note": each.note,
        "value": value,
        "cells": cells,
    }


def _product(each: Product, kinds: list[str]) -> dict[str, Any]:
    """Return a product as a row of the table, its interval widened as the numbers' are."""
    value, between = in_words(each.value, each.lower, each.upper)
    own = WIDENED if WIDENED in kinds else JACOBIAN
    cells = [_raised(between) if kind == own else "" for kind in kinds]
    return {"name": _raised(each.text), "under": "in SI units", "note": "", "value": _raised(value), "cells": cells}


def _raised(text: str) -> str:
    """Return a text with raised powers and true minus signs."""
    text = re.sub(r"\^(\d)|(?<=\bm)([23])\b", lambda found: POWERS[int(found[1] or found[2])], text)
    return re.sub(r"(?<![\w)])-(?=\d)|(?<=\de)-(?=\d)", "\N{MINUS SIGN}", text)


def _facts(fit: Fit) -> list[tuple[str, str]]:
    """Return signals, noise and bootstrap as names and words."""
    found = []
    if len(fit.cases) > 1:
        found.append(("experiments", f"{len(fit.cases)}, of which the first is described here"))
    found += [("signal", _signal(each)) for each in fit.signals]
    size = f"; {fit.noise:.3g} of the standard deviation that was given" if fit.assumed["noise"] == "std" else ""
    words = f"neighbours correlate by {fit.autocorrelation:.2f}{size}"
    found.append(("residuals", words.replace("-", "\N{MINUS SIGN}")))
    found.append(("assumed", f"{NOISE[fit.assumed['noise']]}, {LOSS[fit.assumed['loss']]}"))
    if fit.bootstrap:
        count, seed, blocks = fit.bootstrap
        each = " and ".join(counted(block, "sample") for block in blocks)
        found.append(("bootstrap", f"{count} resamples in blocks of {each}, seed {seed}"))
    return found


def _signal(shown: Shown) -> str:
    """Return a signal in words, with the size of its residuals.

    Half of the residuals are smaller than 0.67 of it.
    """
    off = shown.fitted - shown.measured
    differing = off[off != 0.0]  # without samples before a touch, where model and signal are both 0
    size = from_median(differing - np.median(differing)) if differing.size else 0.0
    unit = unit_of(UNITS.get(shown.channel.partition(":")[0], "1"), size)
    name = shown.channel.replace("|", " | ")
    return f"{name}: {len(off):,} samples, noise {size / unit.size:.3g}\N{NO-BREAK SPACE}{unit.label}".rstrip()
