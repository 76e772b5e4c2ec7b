"""The commands ``check``, ``choose`` and ``cite``, which run nothing but trials of a case."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from impactlab.cli.lazy_modules import api, choices, citations, console
from impactlab.cli.options import CaseFile, Json, Method, Sets, Variant, load
from impactlab.cli.reporting import CommandFailed, code_of, print_hints, reporting
from impactlab.errors import ImpactlabError

PREDICTED = (
    "the run chooses its method within the tolerance; dt and steps are a prediction (impactlab choose tries all)"
)


def check(
    case: CaseFile, sets: Sets = None, method: Method = None, variant: Variant = None, as_json: Json = False
) -> None:
    """Check a case and all its methods; print every value in SI, defaults filled in."""
    with reporting(case, as_json):
        try:
            loaded = load(case, sets, method, variant)
        except ImpactlabError as error:
            if not as_json:
                console.say(listing(error))
                raise CommandFailed(code_of(error)) from None
            raise
        names = (method,) if method is not None else loaded.method_names
        plans: dict[str, dict[str, Any]] = {}
        faults: list[tuple[str, ImpactlabError]] = []
        chosen = loaded
        for name in names:
            try:
                chosen = loaded if method is not None else loaded.method(name)
                plan = api.prepare(chosen)
                warned = [{"code": each.code, "text": each.text} for each in plan.warnings]
                plans[name] = {"status": "accepted", "dt": plan.dt, "steps": plan.steps, "warnings": warned}
                if chosen.simulation().method.tolerance is not None:
                    plans[name]["predicted"] = PREDICTED
            except ImpactlabError as error:
                chosen.place(error)
                faults.append((name, error))
                plans[name] = api.failure(loaded.label, error)
        document = {"schema_version": 1, "case": loaded.label, "resolved": loaded.resolved(), "methods": plans}
        print_hints(loaded)
        for name, fault in faults:
            console.say(f"method {name}: {fault}")
        if as_json:
            console.print_json(document)
        else:
            print(console.tree_text(_brief(document)))
        if faults:
            raise CommandFailed(2)


def listing(error: ImpactlabError) -> str:
    """Return all faults that were found together, one after the other."""
    faults = (error, *error.others)
    error.others = ()
    return "\n".join(str(each) for each in faults)


def choose(
    case: CaseFile,
    tolerance: Annotated[
        float | None,
        typer.Option("--tolerance", metavar="E", help="Allowed relative error; default: that of the case, or 1e-3."),
    ] = None,
    sets: Sets = None,
    variant: Variant = None,
    as_json: Json = False,
) -> None:
    """Choose how to solve a case within a tolerance.

    All candidates are listed, with predicted and measured errors and times.
    """
    with reporting(case, as_json):
        loaded = load(case, sets, None, variant)
        if tolerance is not None or loaded.simulation().method.tolerance is None:
            loaded = loaded.with_settings(
                {"solve.tolerance": 1e-3 if tolerance is None else tolerance}, by="--tolerance"
            )
        console.log_compiling()
        document = choices.choose(loaded.label, loaded.simulation(), api.physics_of(loaded))
        if as_json:
            console.print_json(document)
        else:
            print(choices.ladder_text(document))


def cite(case: CaseFile, method: Method = None, as_json: Json = False) -> None:
    """Print the BibTeX entries of the parts that a case uses, and of its source."""
    with reporting(case, as_json):
        found = citations.cite(load(case, None, method))
        if as_json:
            console.print_json(
                {"schema_version": 1, "case": case.stem, "keys": list(found.keys), "bibtex": found.bibtex}
            )
        else:
            print(found.bibtex)


def _brief(document: dict[str, Any]) -> dict[str, Any]:
    """Return the document with few contacts and without errors.

    Errors go to standard error.
    """
    methods = {
        name: {key: plan[key] for key in ("status", "dt", "steps", "predicted") if key in plan}
        for name, plan in document["methods"].items()
    }
    resolved = {key: value for key, value in document["resolved"].items() if key != "methods"}
    derived = resolved["derived"] | {"contacts": console.few_of(resolved["derived"]["contacts"])}
    if "laws" in derived:
        derived["laws"] = {name: each for name, each in derived["laws"].items() if name in derived["contacts"]}
    return {**resolved, "derived": derived, "methods": methods}
