"""The commands that run a case: ``run`` and ``compare``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from impactlab.cli.lazy_modules import (
    api,
    compare_report,
    console,
    figure_files,
    files,
    histories,
    output,
    progress_bar,
    provenance,
    reference_record,
    run_report,
    sampling,
)
from impactlab.cli.options import (
    CaseFile,
    Figures,
    Json,
    Method,
    Metrics,
    Out,
    Sets,
    Variant,
    Width,
    command_line,
    load,
    names_in,
    option,
)
from impactlab.cli.reporting import CommandFailed, code_of, print_hints, reporting, words
from impactlab.errors import CaseError, ImpactlabError
from impactlab.startup.wall_time import timed

if TYPE_CHECKING:
    from pathlib import Path

    from impactlab.history.base import AbstractHistory
    from impactlab.refine.references.reference_record import Reference
    from impactlab.report.figures.figure_files import FigureFiles
    from impactlab.report.provenance import Provenance


def run(
    context: typer.Context,
    case: CaseFile,
    sets: Sets = None,
    method: Method = None,
    variant: Variant = None,
    out: Out = None,
    figures: Figures = None,
    width: Width = None,
    reference: Annotated[
        bool,
        typer.Option(
            "--reference",
            help=(
                "Compute the reference solution and the errors even if this is predicted to take over 10 "
                "s, or over ten times the run."
            ),
        ),
    ] = False,
    metric: Metrics = None,
    as_json: Json = False,
) -> None:
    """Run one case: its summary on the screen, history and figures in DIR."""
    with reporting(case, as_json), timed() as watch:
        loaded = load(case, sets, method, variant, metric)
        print_hints(loaded)
        drawn_as = figure_files.figure_files(figures, width, out)
        if out is not None:
            output.check_target(out)
        with progress_bar.progress() as show, api.warnings_kept(), api.code_ahead(loaded):

            def report(fraction: float) -> None:
                if fraction == 0.0:  # all checks before the first step are passed
                    console.log_compiling()
                show(loaded.label, fraction)

            history = api.run(loaded, report, 0 if out is None else sampling.FRAMES)
        summary, against = api.summarised(loaded, history, reference_record.FULL_BUDGET_S if reference else None)
        watch.change("writing")
        if out is not None:
            summary["cost"]["wall_time"] = watch.seconds()  # of the summary in the folder: up to here
            _write_run(out, history, summary, against, provenance.of_case(loaded, command_line(context)), drawn_as)
        text = "" if as_json else console.summary_text(summary)
        summary["cost"]["wall_time"] = watch.seconds()  # also of the text
        if as_json:
            console.print_json(summary)
        else:
            print(text, console.wall_time(summary), sep="\n")
        if summary["status"] != "completed":
            raise CommandFailed(1)


def _write_run(
    out: Path,
    history: AbstractHistory,
    summary: dict[str, Any],
    against: Reference | None,
    origin: Provenance,
    drawn_as: FigureFiles,
) -> None:
    """Write data, figures and page of a run; its data stay if they cannot be drawn, and the error is raised."""
    undrawn: Exception | None = None
    console.say(f"drawing figures for {out} ...")
    with output.output_folder(out) as draft:
        data = files.write_data(draft, history, summary, against, origin._asdict())
        try:
            run_report.write_run(draft, summary, history, against, origin, drawn_as, data)
        except (ImpactlabError, OSError, MemoryError):
            raise
        except Exception as error:  # noqa: BLE001 - raised below, when the data of the run are in place
            undrawn = error
            if data is not None and not (draft / "history.nc").exists():
                data()
    console.say(f"written: {out}")
    if undrawn is not None:
        console.say("its figures and its page could not be drawn; the data of the run are complete")
        raise undrawn


def compare(
    context: typer.Context,
    case: CaseFile,
    methods: Annotated[
        str | None,
        option("--methods", "A,B,...", "Methods to run; default: base, the case as written, and all others."),
    ] = None,
    sets: Sets = None,
    variant: Variant = None,
    out: Out = None,
    figures: Figures = None,
    width: Width = None,
    metric: Metrics = None,
    as_json: Json = False,
) -> None:
    """Run several methods on one case: table, figures, errors against the exact solution."""
    with reporting(case, as_json):
        loaded = load(case, sets, None, variant, metric)
        print_hints(loaded)
        names = names_in(methods) if methods is not None else None
        if names == []:
            raise CaseError(
                "--methods names no method", remedy=f"Methods of this case: {', '.join(loaded.method_names)}."
            )
        drawn_as = figure_files.figure_files(figures, width, out)
        if out is not None:
            output.check_target(out)
        console.log_compiling()
        with progress_bar.progress() as show:
            comparison = api.compare(loaded, names, show, 0 if out is None else sampling.FRAMES)
        for row in comparison.rows:
            if row.error is not None:
                console.say(f"{row.name} {row.summary['status']}: {words(row.error)}")
            for warned in row.summary.get("warnings", ()):
                if warned["code"] in histories.SERIOUS:
                    console.say(f"{row.name} {warned['code']}: {warned['text']}")
        code = _code_of_rows(comparison)
        document = comparison.document
        if out is not None and comparison.histories:
            console.say(f"drawing figures for {out} ...")
            with output.output_folder(out) as draft:
                compare_report.write_comparison(
                    draft,
                    document,
                    comparison.histories,
                    loaded.scene(),
                    comparison.references,
                    provenance.of_case(loaded, command_line(context)),
                    drawn_as,
                )
            console.say(f"written: {out}")
        if as_json:
            console.print_json(document)
        else:
            print(comparison)
        if code:
            raise CommandFailed(code)


def _code_of_rows(comparison: Any) -> int:
    """Return 0 if any method completed, else the exit code of the first failure."""
    if any(row.summary["status"] == "completed" for row in comparison.rows):
        return 0
    if any(row.error is None for row in comparison.rows):
        return 1
    return code_of(comparison.rows[0].error)
