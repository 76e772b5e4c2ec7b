"""Modules that commands use, each imported on first use: ``impactlab --help`` needs none."""

from __future__ import annotations

from typing import TYPE_CHECKING

from impactlab.startup.lazy import lazy

if TYPE_CHECKING:
    from impactlab import api, casefile, derivatives, files, fits, sweeps, uncertainties
    from impactlab import cite as citations
    from impactlab import plugins as registries
    from impactlab.bench import cells, grid
    from impactlab.bench import run as benching
    from impactlab.bench.report import stability as stability_report
    from impactlab.bench.report import write as bench_report
    from impactlab.casefile import edit, jsonschema, starter
    from impactlab.casefile import listing as listings
    from impactlab.casefile import settings as settings_of
    from impactlab.history import base as histories
    from impactlab.history import sampling
    from impactlab.refine.references import reference_record
    from impactlab.report import choice as choices
    from impactlab.report import compare_report, console, output, progress_bar, provenance, run_report
    from impactlab.report.figures import figure_files, film_files
    from impactlab.sweeps import axes, axis_texts, given_twice
    from impactlab.testing import verdict as verdicts
else:
    api = lazy("impactlab.api")
    axes = lazy("impactlab.sweeps.axes")
    axis_texts = lazy("impactlab.sweeps.axis_texts")
    bench_report = lazy("impactlab.bench.report.write")
    benching = lazy("impactlab.bench.run")
    casefile = lazy("impactlab.casefile")
    cells = lazy("impactlab.bench.cells")
    choices = lazy("impactlab.report.choice")
    citations = lazy("impactlab.cite")
    compare_report = lazy("impactlab.report.compare_report")
    console = lazy("impactlab.report.console")
    derivatives = lazy("impactlab.derivatives")
    edit = lazy("impactlab.casefile.edit")
    figure_files = lazy("impactlab.report.figures.figure_files")
    files = lazy("impactlab.files")
    film_files = lazy("impactlab.report.figures.film_files")
    fits = lazy("impactlab.fits")
    given_twice = lazy("impactlab.sweeps.given_twice")
    grid = lazy("impactlab.bench.grid")
    histories = lazy("impactlab.history.base")
    jsonschema = lazy("impactlab.casefile.jsonschema")
    listings = lazy("impactlab.casefile.listing")
    output = lazy("impactlab.report.output")
    progress_bar = lazy("impactlab.report.progress_bar")
    provenance = lazy("impactlab.report.provenance")
    reference_record = lazy("impactlab.refine.references.reference_record")
    registries = lazy("impactlab.plugins")
    run_report = lazy("impactlab.report.run_report")
    sampling = lazy("impactlab.history.sampling")
    settings_of = lazy("impactlab.casefile.settings")
    stability_report = lazy("impactlab.bench.report.stability")
    starter = lazy("impactlab.casefile.starter")
    sweeps = lazy("impactlab.sweeps")
    uncertainties = lazy("impactlab.uncertainties")
    verdicts = lazy("impactlab.testing.verdict")
