"""The commands. Everything heavy is imported inside a command, so that ``impactlab --help`` answers at once.

Exit codes: 0 done, 1 a run failed, 2 the input is wrong, 130 after Ctrl-C.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from impactlab.casefile import Case

app = typer.Typer(
    name="impactlab",
    help="Impacts on flexible rods: run a case, compare methods on it, see what each costs and how wrong it is.",
    no_args_is_help=True,
    rich_markup_mode=None,
    add_completion=False,
    pretty_exceptions_enable=False,
)

CaseFile = Annotated[Path, typer.Argument(metavar="CASE", help="Case file: .yaml, .toml or .json.", show_default=False)]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on standard output, nothing else there.")]
Out = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Write history and figures into this folder.", show_default=False),
]
Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Change a value, as in solve.step.dt=1e-7.", show_default=False),
]
Method = Annotated[
    str | None, typer.Option("--method", metavar="NAME", help="One of the methods of the case.", show_default=False)
]

Variant = Annotated[
    str | None,
    typer.Option("--variant", metavar="NAME", help="One of the variants of the case.", show_default=False),
]


def main() -> None:
    """Run the command line and leave with its exit code."""
    try:
        app()
    except KeyboardInterrupt:
        sys.exit(130)
    except Left:
        raise
    except SystemExit as leaving:
        if leaving.code == 2 and "--json" in sys.argv:  # typer has said on standard error what is wrong
            from impactlab.errors import CaseError

            _print_failure(None, CaseError("the command line is wrong", remedy="See standard error, or --help."))
        raise


class Left(SystemExit):
    """A command that reported its failure leaves with this."""


@app.command()
def run(
    case: CaseFile,
    sets: Sets = None,
    method: Method = None,
    variant: Variant = None,
    out: Out = None,
    reference: Annotated[
        bool,
        typer.Option("--reference", help="Where no exact answer serves, take the time for a converged one."),
    ] = False,
    as_json: Json = False,
) -> None:
    """Run one case: its summary on the screen, history and figures in DIR."""
    with reporting(case, as_json):
        from impactlab import api, console, output
        from impactlab.reference import CHEAP, THOROUGH

        loaded = _load(case, sets, method, variant)
        if out is not None:
            output.check_target(out)
        with console.progress() as show:

            def tell(fraction: float) -> None:
                if fraction == 0.0:  # nothing stands against the run any more
                    console.say_if_compiling()
                show(loaded.label, fraction)

            history = api.run(loaded, tell)
        summary, judge = api.summarised(loaded, history, THOROUGH if reference else CHEAP)
        if out is not None:
            from impactlab.report.run_report import write_run

            console.say(f"drawing figures for {out} ...")
            with output.output_folder(out) as draft:
                write_run(draft, summary, history, loaded.scene(), judge, loaded.title, loaded.source)
            console.say(f"written: {out}")
        console.answer(summary) if as_json else print(console.summary_text(summary))


@app.command()
def compare(
    case: CaseFile,
    methods: Annotated[
        str | None,
        typer.Option("--methods", metavar="A,B,...", help="Methods to run; default base and all.", show_default=False),
    ] = None,
    sets: Sets = None,
    variant: Variant = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Run several methods on one case: one table, one set of figures, errors against the exact answer."""
    with reporting(case, as_json):
        from impactlab import api, console, output

        loaded = _load(case, sets, None, variant)
        names = [name.strip() for name in methods.split(",") if name.strip()] if methods is not None else None
        if out is not None:
            output.check_target(out)
        console.say_if_compiling()
        with console.progress() as show:
            comparison = api.compare(loaded, names, show)
        for row in comparison.rows:
            if row.error is not None:
                console.say(f"{row.name} {row.summary['status']}: {_words(row.error)}")
        code = _code_of_rows(comparison)
        document = comparison.document
        if out is not None and code == 0:
            from impactlab.report.compare_report import write_comparison

            console.say(f"drawing figures for {out} ...")
            with output.output_folder(out) as draft:
                write_comparison(
                    draft,
                    document,
                    comparison.histories,
                    loaded.scene(),
                    comparison.reference,
                    loaded.title,
                    loaded.source,
                    comparison.references,
                )
            console.say(f"written: {out}")
        console.answer(document) if as_json else print(comparison)
        if code:
            raise Left(code)


@app.command()
def bench(
    cases: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[CASES]...", help="Case files; the suite if none is given.", show_default=False),
    ] = None,
    suite: Annotated[
        str, typer.Option("--suite", metavar="NAME", help="standard: cases/*.yaml here; hard: cases/hard/*.yaml.")
    ] = "standard",
    grid: Annotated[
        Path | None, typer.Option("--grid", metavar="FILE", help="A grid of one's own.", show_default=False)
    ] = None,
    methods: Annotated[
        str | None,
        typer.Option(
            "--methods",
            metavar="A,B,...",
            help="Methods of the grid, own for those of the cases; all if not given.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of the rows and the table.")] = Path(
        "out/bench"
    ),
    jobs: Annotated[int, typer.Option("--jobs", metavar="N", min=0, help="Processes; 0 for one per core.")] = 1,
    repeats: Annotated[int, typer.Option("--repeats", metavar="N", min=1, help="Of a timed run, at most.")] = 9,
    no_timing: Annotated[bool, typer.Option("--no-timing", help="Leave out the times.")] = False,
    time_limit: Annotated[
        float, typer.Option("--time-limit", metavar="S", min=0.001, help="Seconds after which a run has hung.")
    ] = 60.0,
    no_report: Annotated[bool, typer.Option("--no-report", help="Leave out figures, tables and pages.")] = False,
    table: Annotated[
        Path | None,
        typer.Option(
            "--from", metavar="TABLE", help="Run nothing: draw the report of this table into DIR.", show_default=False
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Speed against error: a grid of methods over cases, one table row per run. What is done is not done again."""
    with reporting(None, as_json):
        from impactlab import console

        if table is not None:
            out.mkdir(parents=True, exist_ok=True)
            page = _draw_bench(out, table, jobs, suite)
            if as_json:
                console.answer({"schema_version": 1, "report": str(page)})
            return
        from impactlab.bench import grid as grids
        from impactlab.bench.cells import case_files
        from impactlab.bench.run import Options
        from impactlab.bench.run import bench as run_bench

        files = case_files(cases or [], suite)
        names = [name.strip() for name in methods.split(",") if name.strip()] if methods is not None else None
        families = grids.chosen(grids.read_grid(grid or grids.of_suite(suite)), names)
        options = Options(jobs, repeats, not no_timing, time_limit)
        console.say_if_compiling()
        with console.progress() as show:
            found = run_bench(files, suite, families, out, options, names, show, console.say)
        counts = ", ".join(f"{count} {status}" for status, count in sorted(found.counts.items()))
        console.say(f"written: {out / 'table.csv'}")
        if not no_report:
            _draw_bench(out, out / "table.csv", jobs, suite)
        console.answer(found.document) if as_json else print(f"{len(found.cells)} rows: {counts}")


def _draw_bench(out: Path, table: Path, jobs: int, suite: str) -> Path:
    """Draw the report of a table and return its page; nothing is timed any more: any number of processes may draw."""
    from impactlab import console

    if suite == "hard":
        from impactlab.bench.report.stability import write_stability

        count = write_stability(out, table)
        console.say(f"written: {out / 'stability.html'}; violations: {count}")
        return out / "stability.html"
    from impactlab.bench.report.write import write_bench

    console.say(f"drawing figures for {out} ...")
    with console.progress() as show:
        write_bench(out, table, jobs or os.cpu_count() or 1, lambda fraction: show("report", fraction))
    console.say(f"written: {out / 'index.html'}")
    return out / "index.html"


@app.command()
def check(
    case: CaseFile, sets: Sets = None, method: Method = None, variant: Variant = None, as_json: Json = False
) -> None:
    """Check a case and all its methods; print every value in SI, defaults filled in."""
    with reporting(case, as_json):
        from impactlab import api, console, simulate
        from impactlab.errors import ImpactlabError

        loaded = _load(case, sets, method, variant)
        names = (method,) if method is not None else loaded.method_names
        plans: dict[str, dict[str, Any]] = {}
        faults: list[tuple[str, ImpactlabError]] = []
        chosen = loaded
        for name in names:
            try:
                chosen = loaded if method is not None else loaded.method(name)
                plan = simulate.prepare(chosen.scene())
                warned = [warning._asdict() for warning in plan.warnings]
                plans[name] = {"status": "accepted", "dt": plan.dt, "steps": plan.steps, "warnings": warned}
            except ImpactlabError as error:
                chosen.place(error)
                faults.append((name, error))
                plans[name] = api.failure(loaded.label, error)
        document = {"schema_version": 1, "case": loaded.label, "resolved": loaded.resolved(), "methods": plans}
        for name, fault in faults:
            console.say(f"method {name}: {fault}")
        console.answer(document) if as_json else print(console.tree_text(_brief(document)))
        if faults:
            raise Left(2)


@app.command()
def choose(
    case: CaseFile,
    tolerance: Annotated[
        float | None,
        typer.Option("--tolerance", metavar="E", help="Relative error allowed; default that of the case, else 1e-3."),
    ] = None,
    sets: Sets = None,
    variant: Variant = None,
    as_json: Json = False,
) -> None:
    """Choose how to solve a case within a tolerance: all candidates, with predicted and measured errors and times."""
    with reporting(case, as_json):
        from impactlab import api, console
        from impactlab.choice.ladder import choose as chosen
        from impactlab.choice.text import ladder_text

        loaded = _load(case, sets, None, variant)
        if tolerance is not None or loaded.scene().tolerance is None:
            loaded = loaded.with_("solve.tolerance", 1e-3 if tolerance is None else tolerance)
        console.say_if_compiling()
        scene = loaded.scene()
        document = chosen(loaded.label, scene, api.physics_of(loaded), scene.tolerance or 0.0)
        console.answer(document) if as_json else print(ladder_text(document))


@app.command()
def schema(
    builtin: Annotated[bool, typer.Option("--builtin", help="Leave out the parts of plugins.")] = False,
) -> None:
    """Print the JSON schema of case files, with the fields of every installed part."""
    with reporting(None, as_json=False):
        from impactlab import console, plugins
        from impactlab.casefile.jsonschema import case_schema

        installed = plugins.registry()
        console.answer(case_schema(installed.only("impactlab") if builtin else installed))


@app.command(name="plugins")
def plugins_(
    check_name: Annotated[
        str | None,
        typer.Option(
            "--check",
            metavar="NAME",
            help="Run the contract suite of this part and measure it; law:NAME where two kinds share a name.",
            show_default=False,
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """List the installed models, contact laws and integrators, broken ones with the reason; or check one of them."""
    with reporting(None, as_json):
        from impactlab import console, plugins

        if check_name is not None:
            from impactlab.testing.verdict import verdict

            console.say_if_compiling()
            found = verdict(check_name, plugins.registry())
            console.answer(found.document()) if as_json else print(console.verdict_text(found.document()))
            if not found.ok:
                raise Left(1)
            return
        listing = plugins.registry().listing()
        if as_json:
            console.answer({"schema_version": 1, "parts": [line._asdict() for line in listing]})
            return
        group = ""
        for line in listing:
            if line.group != group:
                group = line.group
                print(group)
            print(
                f"  {line.name:28} {'broken: ' + line.fault if line.fault else line.description}  [{line.distribution}]"
            )


@app.command()
def cite(case: CaseFile, method: Method = None, as_json: Json = False) -> None:
    """Print the BibTeX entries of the parts that a case uses, and of its source."""
    with reporting(case, as_json):
        from impactlab import cite as citations
        from impactlab import console

        found = citations.cite(_load(case, None, method))
        if as_json:
            console.answer({"schema_version": 1, "case": case.stem, "keys": list(found.keys), "bibtex": found.bibtex})
        else:
            print(found.bibtex)


@app.command()
def new(name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the case.", show_default=False)]) -> None:
    """Write NAME.yaml here: a commented case to start from."""
    with reporting(None, as_json=False):
        from impactlab import console
        from impactlab.casefile.starter import write_starter

        console.say(f"written: {write_starter(name, Path.cwd())}")


@contextlib.contextmanager
def reporting(case: Path | None, as_json: bool) -> Iterator[None]:
    """Turn any failure inside into one message on standard error, a JSON document if asked for, and an exit code."""
    try:
        yield
    except (typer.Exit, typer.Abort, BrokenPipeError):
        raise
    except KeyboardInterrupt as error:
        _report(case, as_json, error, "interrupted")
        raise Left(130) from None
    except Exception as error:
        if os.environ.get("IMPACTLAB_DEBUG"):
            raise
        _report(case, as_json, error, _words(error))
        raise Left(_code(error)) from None


def _report(case: Path | None, as_json: bool, error: BaseException, text: str) -> None:
    from impactlab import console

    console.say(text)
    if as_json:
        _print_failure(case, error)


def _print_failure(case: Path | None, error: BaseException) -> None:
    from impactlab.api import failure
    from impactlab.console import answer

    answer(failure(case.stem if case is not None else "", error))


def _words(error: BaseException) -> str:
    from impactlab.errors import ImpactlabError

    if isinstance(error, ImpactlabError):
        return str(error)
    text = f"{type(error).__name__}: {str(error)[:500]}"
    return f"{text}\nThis came out of a part or of impactlab itself; IMPACTLAB_DEBUG=1 shows where."


def _code(error: BaseException) -> int:
    from impactlab.errors import ImpactlabError, StepError

    return 2 if isinstance(error, ImpactlabError) and not isinstance(error, StepError) else 1


def _code_of_rows(comparison: Any) -> int:
    """A comparison is done if any method ended; otherwise it fails as its first method did."""
    errors = [row.error for row in comparison.rows if row.error is not None]
    return _code(errors[0]) if errors and len(errors) == len(comparison.rows) else 0


def _load(file: Path, sets: list[str] | None, method: str | None, variant: str | None = None) -> Case:
    from impactlab.casefile import load_case
    from impactlab.casefile.edit import read_setting

    loaded = load_case(file)
    if variant is not None:
        loaded = loaded.variant(variant)
    if method is not None:
        loaded = loaded.method(method)
    return loaded.with_settings([read_setting(setting) for setting in sets]) if sets else loaded


def _brief(document: dict[str, Any]) -> dict[str, Any]:
    """Leave the text of refusals to standard error."""
    methods = {
        name: {key: plan[key] for key in ("status", "dt", "steps") if key in plan}
        for name, plan in document["methods"].items()
    }
    return {**{key: value for key, value in document["resolved"].items() if key != "methods"}, "methods": methods}


if __name__ == "__main__":
    main()
