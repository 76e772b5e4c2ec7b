"""Run a case, or compare several methods on it.

Objects and errors are the same as on the command line.
"""

from __future__ import annotations

import contextlib
import dataclasses
import shutil
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from impactlab.casefile import Case
from impactlab.casefile.case import expect_case, simulation_of
from impactlab.casefile.edit import check_name
from impactlab.errors import (
    CaseError,
    DoubtfulResult,
    ImpactlabError,
    RunNote,
    RunWarning,
    StepError,
    SweepError,
    UnusualValue,
    texts,
)
from impactlab.history.advice import ADVICE
from impactlab.history.base import SERIOUS, AbstractHistory
from impactlab.history.instruments import check_instruments
from impactlab.numerics.garbage_collection import GarbageCollectionPaused
from impactlab.report.progress_bar import of_long_run
from impactlab.scene.method import Method, Simulation, theories
from impactlab.scene.precision import in_precision
from impactlab.scene.problem import Scene
from impactlab.startup.lazy import lazy
from impactlab.startup.wall_time import CHOOSING, REFERENCE, spent_on
from impactlab.types import Progress

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from impactlab.exact import solve as exact
    from impactlab.numerics import addresses, ahead
    from impactlab.refine import choice
    from impactlab.refine.references import outlook as outlooks
    from impactlab.refine.references import reference as references
    from impactlab.refine.references import reference_record
    from impactlab.refine.references.reference_record import Reference
    from impactlab.report import comparison as comparisons
    from impactlab.report import notebook
    from impactlab.report import summary as summaries
    from impactlab.simulate import driver, needed_kernels, plan
    from impactlab.simulate.plan import Plan
else:  # with the libraries that they load, each when it is first used
    addresses, ahead = lazy("impactlab.numerics.addresses"), lazy("impactlab.numerics.ahead")
    exact, needed_kernels = lazy("impactlab.exact.solve"), lazy("impactlab.simulate.needed_kernels")
    driver, plan = lazy("impactlab.simulate.driver"), lazy("impactlab.simulate.plan")
    choice, references = lazy("impactlab.refine.choice"), lazy("impactlab.refine.references.reference")
    reference_record = lazy("impactlab.refine.references.reference_record")
    outlooks = lazy("impactlab.refine.references.outlook")
    notebook, summaries = lazy("impactlab.report.notebook"), lazy("impactlab.report.summary")
    comparisons = lazy("impactlab.report.comparison")

warnings.simplefilter("ignore", RunNote, append=True)  # the last filter: those that a user sets come before it


class ComparedMethod(NamedTuple):
    """One method of a comparison; a method that was refused or failed has a row, too."""

    name: str
    summary: dict[str, Any]  # of the run, or its status and error
    history: AbstractHistory | None  # None where the run did not end
    reference: Reference | None  # that its errors were measured against
    error: Exception | None  # of a method that was refused or failed


@dataclass(frozen=True)
class Comparison:
    """Several methods on one case, side by side."""

    case: str
    rows: tuple[ComparedMethod, ...]
    title: str = ""

    @property
    def histories(self) -> dict[str, AbstractHistory]:
        """The histories of the methods that ended, by name."""
        return {row.name: row.history for row in self.rows if row.history is not None}

    @property
    def reference(self) -> Reference | None:
        """The reference of the first method that has one, or None."""
        return next((row.reference for row in self.rows if row.reference is not None), None)

    @property
    def references(self) -> dict[str, AbstractHistory]:
        """The references of the methods, by name of the method."""
        return {row.name: row.reference[1] for row in self.rows if row.reference is not None}

    @property
    def document(self) -> dict[str, Any]:
        """The document of ``compare --json``: schema_version, case, reference, rows of name and summary."""
        name = self.reference[0] if self.reference is not None else None
        return comparisons.comparison(self.case, name, [(row.name, row.summary) for row in self.rows])

    def plot(self) -> Figure:
        """Return a figure of all methods' signals over time, a panel for each place.

        Raises
        ------
        ImpactlabError
            If no method ended, or there is no signal.
        """
        return notebook.plot_comparison(self.histories, self.references)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a row for each method: status, relative errors, contacts, steps, dt [s], solve_s [s]."""
        return comparisons.to_pandas(self.document)

    def _repr_html_(self) -> str:
        return notebook.of_comparison(self.document, self.histories, self.references, self.title)

    def __repr__(self) -> str:
        against = comparisons.solution_words(self.reference.name) if self.reference else "nothing"
        lines = [f"<Comparison of '{self.case}', errors against {against}"]
        for row in self.rows:
            errors = row.summary.get("errors") or {}
            error = errors.get("mass_displacement")
            error = errors.get("face_displacement") if error is None else error
            lines.append(
                f"  {row.name}: {row.summary['status']}" + (f", error {error:.3g}" if error is not None else "")
            )
        return "\n".join(lines) + ">"

    def __str__(self) -> str:
        width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
        return comparisons.table(self.document, width)


def run(case: Case | Simulation, progress: Progress | None = None, frames: int = 0) -> AbstractHistory:
    """Run a case, or a scene with its method, and return the history.

    All warnings of the run are collected in ``history.warnings``, and each is issued as a `RunWarning`: as a
    `DoubtfulResult` where the result is in doubt, as it misses its tolerance (``history.choice.met`` is False), left
    linear theory, gained energy or lost much of it; else as a `RunNote`, which a filter may show:
    ``warnings.simplefilter("default", il.RunNote)``. A value of the case that looks like a mistake issues an
    `UnusualValue`.

    Parameters
    ----------
    case : Case or Simulation
        Of a case with methods, the one chosen by ``case.method(name)``. A method with a tolerance is
        first completed by the automatic choice.
    progress : callable, optional
        Called with the fraction done, from 0 to 1, about ten times a second. Without it a bar is drawn on a terminal
        if the run takes longer than a second.
    frames : int, optional
        Fields of stepped bodies are kept at the ends of so many equal parts of the run, beside those of the case
        (``history.field_times(body)``); no other number of the history depends on it.

    Raises
    ------
    CaseError, PairingError, PluginError
        Before the first step; of a case they carry file and line.
    StepError
        If the run fails on the way, or more than doubles the energy of its bodies; it carries the history so far.
    """
    scene, method = simulation_of(case, "run")
    if frames:
        scene = scene.with_frames(frames)
    try:
        with of_long_run(scene.name, method.tolerance is not None, progress) as show:
            history = solve(scene, method, show)
        check_instruments(history)  # of a step that the automatic choice found, or of a thinned run
    except ImpactlabError as error:
        if isinstance(case, Case):
            case.place(error)
        raise
    history.case = case if isinstance(case, Case) else None
    for warned in history.warnings:
        kind = DoubtfulResult if warned.code in SERIOUS else RunNote
        warnings.warn(f"{warned.code}: {warned.text}", kind, stacklevel=2)
    for hint in case.hints if isinstance(case, Case) else ():
        warnings.warn(hint, UnusualValue, stacklevel=2)
    return history


def solve(scene: Scene, method: Method, progress: Progress | None = None) -> AbstractHistory:
    """Run a scene under a method, chosen automatically under a tolerance; issue no `RunWarning`."""
    if method.tolerance is None:
        with GarbageCollectionPaused(len(scene.bodies)):
            return driver.run(scene, method, progress)
    with spent_on(CHOOSING):  # the run that is chosen is one of its trials
        return choice.run(scene, method, progress)


@contextlib.contextmanager
def warnings_kept() -> Iterator[None]:
    """Issue no `RunWarning` inside: for callers that show the warnings of a history themselves."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RunWarning)
        yield


def prepare(case: Case) -> Plan:
    """Return the plan of a run.

    Under a tolerance it is that of the method predicted to be cheapest.

    Raises
    ------
    CaseError, PairingError
        Where the run cannot start.
    """
    scene, method = case.simulation()
    if method.tolerance is not None:
        with in_precision("the first guess of a description", "solve.tolerance"):
            scene, method = choice.first_guess(scene, method)
    with addresses.trial():
        return plan.prepare(scene, method)


def physics_of(case: Case) -> Simulation:
    """Return the scene and the method, with the laws as written, to which errors refer.

    So a penalty that stands in for a hard contact is measured against the hard contact, not against itself.
    """
    scene, method = case.simulation()
    if case.written is None:
        return Simulation(scene, method)
    # A relative stiffness refers to the elements of the case as written, too; a model of another theory keeps its own,
    # as no reference of the case as written holds for it.
    models = dict(method.models)
    for name, written in case.written.models.items():
        if written.theory == (models[name].theory if name in models else ""):
            models[name] = written
    laws = {name: case.written.laws.get(name, law) for name, law in method.laws.items()}
    return Simulation(scene, dataclasses.replace(method, laws=laws, models=models))


def reference_of(scene: Scene, method: Method, budget: float | None = None) -> Reference | None:
    """Return the reference of a run, or None without one.

    The exact one where the exact solver supports the scene, else a converged one; ``budget`` are the seconds of
    predicted solving that this may take (`impactlab.refine.references.reference`), by default as many as a comparison
    waits for.
    """
    return references.find(scene, method, reference_record.FULL_BUDGET_S if budget is None else budget)


def compare(
    case: Case,
    methods: str | Sequence[str] | None = None,
    progress: Callable[[str, float], None] | None = None,
    frames: int = 0,
) -> Comparison:
    """Run several methods on one case and return them with their errors.

    Parameters
    ----------
    case : Case
        The case.
    methods : str or sequence of str, optional
        Names of its methods, ``base`` being the case as written; all of them if not given.
    progress : callable, optional
        Called with the name of the method and the fraction of the whole comparison that is done.
    frames : int, optional
        As of `run`.

    Raises
    ------
    CaseError
        If the case has no method of a given name. A method that is refused or fails stays as a row instead.
    """
    expect_case(case, "compare")
    if isinstance(methods, str):
        methods = (methods,)
    given = case.method_names if methods is None else texts("methods", methods, "Give names of methods of the case.")
    names = list(dict.fromkeys(given))
    for name in names:
        check_name("method", name, case.method_names, case.file)
    known: dict[Any, Reference | None] = {}  # by the scene and method that determine each
    rows = []
    with code_ahead(case, names):
        for number, name in enumerate(names):
            rows.append(_row(case, name, known, _share(progress, name, number, len(names)), frames))
    return Comparison(case.label, tuple(rows), case.title)


def summarised(
    case: Case, history: AbstractHistory, budget: float | None = None
) -> tuple[dict[str, Any], Reference | None]:
    """Return the summary of a run and the reference of its errors.

    ``budget`` are the seconds of predicted solving that a reference may take. Without it a reference is computed where
    it is predicted to take no longer than ten times the run, and ten seconds at most
    (`impactlab.refine.references.outlook`).
    """
    physics = physics_of(case)
    with spent_on(REFERENCE):
        if budget is None:
            reference, outlook = outlooks.of_plain_run(*physics, history)
        else:
            reference = reference_of(*physics, budget)
            outlook = outlooks.of(reference, physics.method)
    with spent_on("writing"):
        summary = summaries.summarise(case.label, history, reference, outlook)
        return with_fault(summary, case), reference


def code_ahead(case: Case, methods: Sequence[str] = ()) -> ahead.ahead:
    """Return a context in which code is compiled side by side.

    It is the code of the exact solution, for errors, and of some methods. Nothing happens where the code is on disk. A
    method that is refused is left out.
    """

    def kernels() -> Iterator[ahead.Kernel]:
        physics = physics_of(case)
        if not any(theories(*physics)) and exact.serves(*physics) is None:
            yield from needed_kernels.of_exact()
        for name in methods:
            with contextlib.suppress(ImpactlabError):
                yield from needed_kernels.of_steps(*case.method(name).simulation())

    return ahead.ahead(kernels)


def failure(case_name: str, error: BaseException) -> dict[str, Any]:
    """Return the document of a run that was refused or failed, as ``--json`` prints it."""
    ours = isinstance(error, ImpactlabError)
    refused = ours and not isinstance(error, (StepError, SweepError))
    document: dict[str, Any] = {
        "schema_version": 1,
        "case": case_name,
        "status": "refused" if refused else "failed",
        "error": _fault(error),
    }
    if isinstance(error, ImpactlabError) and error.others:
        document["more_errors"] = [_fault(other) for other in error.others]
    if isinstance(error, StepError):
        document["reached"] = {"time": error.time, "step": error.step}
        if error.history is not None:
            document["reached"]["events"] = [event._asdict() for event in error.history.events]
    return document


def with_fault(summary: dict[str, Any], case: Case) -> dict[str, Any]:
    """Return the summary of a run, with an ``error`` if its tolerance is not met.

    The numbers of the summary stay beside the error.
    """
    missed = [warned["text"] for warned in summary["warnings"] if warned["code"] == summary["status"]]
    if not missed:
        return summary
    fault = CaseError(missed[0], remedy=ADVICE[summary["status"]], path="solve.tolerance")
    failed = {"status": summary["status"], "error": {**_fault(case.place(fault)), "kind": "ToleranceNotMet"}}
    first = {key: summary[key] for key in ("schema_version", "case")}
    return first | failed | summary


def _fault(error: BaseException) -> dict[str, Any]:
    if not isinstance(error, ImpactlabError):
        place: dict[str, Any] = {"file": None, "line": None, "path": None, "text": _text_of(error), "remedy": None}
    else:
        place = {"file": error.file or None, "line": error.line, "path": error.path or None, "text": error.text}
        place["remedy"] = error.remedy or None
    return {"kind": type(error).__name__, **place}


def _text_of(error: BaseException) -> str:
    return "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)[:500] or type(error).__name__


def _share(progress: Callable[[str, float], None] | None, name: str, number: int, count: int) -> Progress | None:
    if progress is None:
        return None
    progress(name, number / count)
    return lambda fraction: progress(name, (number + fraction) / count)


def _row(
    case: Case, name: str, known: dict[Any, Reference | None], progress: Progress | None, frames: int
) -> ComparedMethod:
    try:
        variant = case.method(name)
        with warnings_kept():
            history = run(variant, progress, frames)
        physics = physics_of(variant)
        key = reference_record.physics_key(*physics)
        reference = known[key] if key in known else known.setdefault(key, reference_of(*physics))
        summary = summaries.summarise(case.label, history, reference)
        return ComparedMethod(name, with_fault(summary, variant), history, reference, None)
    except Exception as error:  # noqa: BLE001 - a plugin may raise anything; its row shows it
        return ComparedMethod(name, failure(case.label, error), None, None, error)
