"""Runs a case, or several methods on one case, from Python: the same objects and errors as on the command line."""

from __future__ import annotations

import contextlib
import dataclasses
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from impactlab.casefile import Case
from impactlab.errors import ImpactlabError, RunWarning, StepError
from impactlab.history.base import SERIOUS, AbstractHistory
from impactlab.refine.reference import CHEAP, THOROUGH, Reference
from impactlab.refine.reference import content as reference_content
from impactlab.scene.bodies import Body, ElasticBody
from impactlab.scene.problem import Scene

Progress = Callable[[float], None]


class Row(NamedTuple):
    """One method of a comparison; a method that was refused or failed keeps its row."""

    name: str
    summary: dict[str, Any]  # of the run, or its status and error
    history: AbstractHistory | None  # None where the run did not end
    reference: Reference | None  # the answer its errors were measured against
    error: Exception | None


@dataclass(frozen=True)
class Comparison:
    """Several methods on one case, side by side."""

    case: str
    rows: tuple[Row, ...]

    @property
    def histories(self) -> dict[str, AbstractHistory]:
        """The histories of the methods that ended, by name."""
        return {row.name: row.history for row in self.rows if row.history is not None}

    @property
    def reference(self) -> Reference | None:
        """The answer that the first method with one was measured against, or None."""
        return next((row.reference for row in self.rows if row.reference is not None), None)

    @property
    def references(self) -> dict[str, AbstractHistory]:
        """The answers that the methods were measured against, by name of the method."""
        return {row.name: row.reference[1] for row in self.rows if row.reference is not None}

    @property
    def document(self) -> dict[str, Any]:
        """What ``compare --json`` prints: schema_version, case, reference, rows of name and summary."""
        from impactlab.report.summary import comparison

        name = self.reference[0] if self.reference is not None else None
        return comparison(self.case, name, [(row.name, row.summary) for row in self.rows])

    def __str__(self) -> str:
        from impactlab.report.summary import table

        return table(self.document)


def run(case: Case | Scene, progress: Progress | None = None) -> AbstractHistory:
    """Return the history of a case or a scene.

    A history whose answer is in doubt issues a `RunWarning`, once for each of its serious warnings: it misses its
    tolerance (``history.choice.met`` is False), or it gained energy. All warnings stand in ``history.warnings``.

    Parameters
    ----------
    case : Case or Scene
        What to run; of a case with methods, the one chosen by ``case.method(name)``.
    progress : callable, optional
        Called with the fraction done, from 0 to 1, about ten times a second.

    Raises
    ------
    CaseError, PairingError, PluginError
        Before the first step; of a case they carry file and line.
    StepError
        If the run fails on the way, or more than doubles the energy of its bodies; it carries what was reached.
    """
    from impactlab.simulate import driver as simulate

    scene = case.scene() if isinstance(case, Case) else case
    try:
        history = simulate.run(scene, progress=progress)
    except ImpactlabError as error:
        if isinstance(case, Case):
            case.place(error)
        raise
    for warned in history.warnings:
        if warned.code in SERIOUS:
            warnings.warn(f"{warned.code}: {warned.text}", RunWarning, stacklevel=2)
    return history


@contextlib.contextmanager
def warnings_kept() -> Iterator[None]:
    """Issue no `RunWarning` inside: for callers that show the warnings of a history themselves."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RunWarning)
        yield


def physics_of(case: Case) -> Scene:
    """Return the scene whose exact answer a method is measured against: its own, under the laws of the case as written.

    So a penalty that stands in for a hard contact is measured against the hard contact, not against itself.
    """
    scene = case.scene()
    if case.written is None:
        return scene
    laws = {contact.name: contact.law for contact in case.written.contacts}
    contacts = [dataclasses.replace(each, law=laws.get(each.name, each.law)) for each in scene.contacts]
    # A relative stiffness refers to the elements of the case as written, too.
    bodies = {name: _described_as(body, case.written.bodies.get(name)) for name, body in scene.bodies.items()}
    return dataclasses.replace(scene, contacts=tuple(contacts), bodies=bodies)


def _described_as(body: Body, written: Body | None) -> Body:
    if isinstance(body, ElasticBody) and isinstance(written, ElasticBody):
        if body.model is not None and written.model is not None and body.model.theory != written.model.theory:
            return body  # of another theory: no reference of the case as written answers for it
        return dataclasses.replace(body, model=written.model)
    return body


def reference_of(scene: Scene, budget: float = THOROUGH) -> Reference | None:
    """Return the answer that a method on a scene is measured against, or None where there is none.

    The exact one where the exact solver serves the scene, else a converged one; ``budget`` are the seconds of predicted
    solving that this may take (`impactlab.refine.reference`).
    """
    from impactlab.refine import reference

    return reference.find(scene, budget)


def compare(
    case: Case, methods: Sequence[str] | None = None, progress: Callable[[str, float], None] | None = None
) -> Comparison:
    """Return several methods run on one case, with their errors against the exact or converged answer.

    Parameters
    ----------
    case : Case
        The case.
    methods : sequence of str, optional
        Names of its methods, ``base`` being the case as written; all of them if not given.
    progress : callable, optional
        Called with the name of the method and the fraction of the whole comparison that is done.

    Raises
    ------
    CaseError
        If the case has no method of a given name. A method that is refused or fails stays as a row instead.
    """
    from impactlab.casefile.edit import check_method_name

    names = list(dict.fromkeys(methods if methods is not None else case.method_names))
    for name in names:
        check_method_name(name, case.method_names, case.file)
    references: dict[Any, Reference | None] = {}
    rows = []
    for number, name in enumerate(names):
        rows.append(_row(case, name, references, _share(progress, name, number, len(names))))
    return Comparison(case.label, tuple(rows))


def summarised(case: Case, history: AbstractHistory, budget: float = CHEAP) -> tuple[dict[str, Any], Reference | None]:
    """Return the summary of a run of a case and the reference its errors were measured against.

    ``budget`` are the seconds of predicted solving that a reference may take where no exact answer serves: by default
    so few that a run is not kept waiting.
    """
    from impactlab.report.summary import summarise

    scene = case.scene()
    reference = reference_of(physics_of(case), budget)
    return summarise(case.label, scene, history, reference), reference


def failure(case_name: str, error: BaseException) -> dict[str, Any]:
    """Return the document of a run that was refused or failed, as ``--json`` prints it."""
    ours = isinstance(error, ImpactlabError)
    refused = ours and not isinstance(error, StepError)
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


def _fault(error: BaseException) -> dict[str, Any]:
    if not isinstance(error, ImpactlabError):
        place: dict[str, Any] = {"file": None, "line": None, "path": None, "text": _said(error), "remedy": None}
    else:
        place = {"file": error.file or None, "line": error.line, "path": error.path or None, "text": error.text}
        place["remedy"] = error.remedy or None
    return {"kind": type(error).__name__, **place}


def _said(error: BaseException) -> str:
    return "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)[:500] or type(error).__name__


def _share(
    progress: Callable[[str, float], None] | None, name: str, number: int, count: int
) -> Callable[[float], None] | None:
    if progress is None:
        return None
    progress(name, number / count)
    return lambda fraction: progress(name, (number + fraction) / count)


def _row(case: Case, name: str, references: dict[Any, Reference | None], progress: Progress | None) -> Row:
    from impactlab.report.summary import summarise

    try:
        variant = case.method(name)
        scene = variant.scene()
        with warnings_kept():
            history = run(variant, progress)
        physics = physics_of(variant)
        key = reference_content(physics)
        if key not in references:
            references[key] = reference_of(physics)
        reference = references[key]
        return Row(name, summarise(case.label, scene, history, reference), history, reference, None)
    except Exception as error:  # noqa: BLE001 - a plugin may raise anything; its row says what
        return Row(name, failure(case.label, error), None, None, error)
