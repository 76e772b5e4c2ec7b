"""Compare every summary number of two versions: ``python studies/same_numbers.py --help``.

``collect`` runs all cases with their methods and variants, and every law with every integrator on every model, and
keeps the summaries. ``compare`` lists the numbers that moved between two such files; each version is collected by its
own copy of this program. All cells take some hours; ``--every 500`` takes a sample.
"""

from __future__ import annotations

import argparse
import gzip
import itertools
import json
import math
import multiprocessing
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import impactlab as il
from impactlab.api import warnings_kept
from impactlab.errors import ImpactlabError, StepError
from impactlab.plugins import BASES, INTEGRATORS, LAWS, MODELS, registry
from impactlab.report.summary import summarise

CASES = Path(__file__).resolve().parent.parent / "cases"
SAME = 1e-12  # relative difference up to which a number is the same
REORDERED = 1e-9  # the same where a formula was written in another order
LISTED = 4  # moved values that are printed of each cell
FRACTIONS = ("energy.largest_gain", "energy.largest_loss", "energy.final_error")  # of the reference energy
UNSAFE = ("cost", "reached", "considered", "trials")  # blocks of times, or that depend on them
TEXTS = ("text", "reason", "estimate", "remedy", "line", "file", "more_errors")
ROD_CASE, BEAM_CASE = "axial_impact", "sphere_on_beam"
SPRING = 1.6e7  # N/m, of laws with a stiffness on the beam
TRIPS = 1.2  # round trips that a cell of the matrix lasts: first contact and the first reflection
Cell = tuple[str, ...]


class Moved(NamedTuple):
    """A value that differs between two collections."""

    cell: str
    path: str
    before: Any
    after: Any
    relative: float  # over the larger of the two; inf where they are not both numbers


def case_cells() -> Iterator[Cell]:
    """Give every case with each variant and method."""
    for file in sorted([*CASES.glob("*.yaml"), *(CASES / "hard").glob("*.yaml")]):
        case = il.load_case(file)
        for variant in ("", *case.variant_names):
            shown = case.variant(variant) if variant else case
            yield from (("case", str(file.relative_to(CASES)), variant, method) for method in shown.method_names)


def written(value: Any) -> Any:
    """Return an option of a part as a case file writes it."""
    return {"relative": value.relative} if hasattr(value, "relative") else value


def options(group: Any, name: str) -> Iterator[dict[str, Any]]:
    """Give the options of the examples of a part."""
    for example in getattr(registry().load(group, name), "examples", ({},)):
        given = {key: written(value) for key, value in example.items()}
        yield {key: value for key, value in given.items() if isinstance(value, int | float | str | dict)}


def matrix_cells() -> Iterator[Cell]:
    """Yield every law with every integrator on every model.

    Models are of a rod and of a beam, each with its examples.
    """
    ours = registry().only("impactlab")

    def parts(group: Any) -> list[str]:
        return [json.dumps({"kind": name, **given}) for name in ours.names(group) for given in options(group, name)]

    sizes = {"elements": 20, "modes": 8}
    models = []
    for text in parts(MODELS):
        model = json.loads(text)
        models.append({key: sizes.get(key, value) for key, value in model.items()})
    models += [{"kind": "modal", **sizes, "basis": basis} for basis in ours.names(BASES)]
    integrators = [(text, "dated") for text in parts(INTEGRATORS)] + [('{"kind": "midpoint"}', "located")]
    for name, law, model, (integrator, events) in itertools.product(
        (ROD_CASE, BEAM_CASE), parts(LAWS), [json.dumps(model) for model in models], integrators
    ):
        yield "matrix", name, law, model, integrator, events


def summary_of(cell: Cell) -> dict[str, Any]:
    """Return the summary of a cell, or the kind and the place of its error."""
    try:
        if cell[0] == "case":
            case = il.load_case(CASES / cell[1])
            row = il.compare(case.variant(cell[2]) if cell[2] else case, [cell[3]]).rows[0]
            return row.summary
        _, name, law, model, integrator, events = cell
        case, part = il.load_case(CASES / f"{name}.yaml"), json.loads(law)
        fields = set(getattr(registry().load(LAWS, part["kind"]), "__dataclass_fields__", {}))
        if name == BEAM_CASE and "stiffness" in fields:
            part["stiffness"] = part["stiffness"] if "exponent" in fields and "stiffness" in part else SPRING
        case = case.with_settings(
            [
                ("snapshots", []),
                ("probes", []),
                ("methods", {}),
                ("contacts.0.law", part),
                ("solve", {
                    "model": json.loads(model), "integrator": json.loads(integrator), "events": events,
                    "duration": {"round_trips": TRIPS} if name == ROD_CASE else 1e-4,
                    "step": {"dt": 2e-6 if name == ROD_CASE else 2e-7},
                }),
            ]
        )  # fmt: skip
        with warnings_kept():
            return summarise(case.label, il.run(case))  # without a reference: the cases have theirs
    except StepError as error:
        return {"status": "failed", "error": {"kind": type(error).__name__, "step": error.step, "time": error.time}}
    except ImpactlabError as error:
        return {"status": "refused", "error": {"kind": type(error).__name__, "path": error.path}}


def numbers(document: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the numbers and words of a summary with their paths.

    Times and texts are left out.
    """
    if isinstance(document, Mapping):
        for key, value in document.items():
            if key not in (*UNSAFE, *TEXTS) and not key.endswith(("_s", "_ms")):
                yield from numbers(value, f"{path}.{key}" if path else key)
    elif isinstance(document, list):
        yield f"{path}.count", len(document)
        for number, value in enumerate(document):
            yield from numbers(value, f"{path}.{number}")
    else:
        yield path, document


def collected(cell: Cell) -> tuple[str, dict[str, Any], float]:
    """Return a cell's name, its values by path, and the seconds it took."""
    began = time.perf_counter()
    values = dict(numbers(summary_of(cell)))
    return " ".join(cell), values, time.perf_counter() - began


def collect(cells: list[Cell], jobs: int) -> dict[str, dict[str, Any]]:
    """Return the values of all cells."""
    found: dict[str, dict[str, Any]] = {}
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        for number, (name, values, seconds) in enumerate(pool.imap(collected, cells, chunksize=4)):
            found[name] = values
            if seconds > 5.0 or number % 500 == 0:
                print(f"{number}/{len(cells)} {name} {seconds:.1f} s", flush=True)
    return found


def relative_change(path: str, before: Any, after: Any, energy: float) -> float:
    """Return the change of a value over the larger of the two; inf of words.

    An energy changes over that of the run. A fraction (errors, restitution, gains) changes over one.
    """
    for value in (before, after):
        if isinstance(value, bool) or not isinstance(value, int | float):
            return math.inf
    fraction = path in FRACTIONS or path.startswith("errors.") or path.endswith(".restitution")
    least = 1.0 if fraction else energy if path.startswith("energy.") else 0.0
    return float(abs(before - after) / max(abs(before), abs(after), least))


def moved(before: Mapping[str, Mapping[str, Any]], after: Mapping[str, Mapping[str, Any]]) -> Iterator[Moved]:
    """Give each value that is not the same, of the cells that both sides have."""
    for cell in before.keys() & after.keys():
        old, new = before[cell], after[cell]
        for path in old.keys() | new.keys():
            if path.rpartition(".")[2] in TEXTS:
                continue  # kept by a version of this script that compared them
            a, b = old.get(path), new.get(path)
            if a != b:
                yield Moved(cell, path, a, b, relative_change(path, a, b, abs(old.get("energy.initial") or 0.0)))


def starts_at_rounding(changes: list[Moved]) -> bool:
    """Return whether the first events and contacts that differ do so by rounding alone.

    A run whose impacts multiply a difference, such as the chatter of a hard contact, moves in its later values after
    any change of the order of operations. Its first values then still agree.
    """
    order = {int(parts[1]): each for each in changes if (parts := each.path.split("."))[0] == "events" and parts[1:]
             and parts[1].isdigit() and parts[-1] == "time"}  # fmt: skip
    return bool(order) and order[min(order)].relative < SAME


def report(before: Mapping[str, Mapping[str, Any]], after: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the changes as text, by cells.

    First come the cells by their largest change, then the cells that need a reason.
    """
    by_cell: dict[str, list[Moved]] = {}
    for each in moved(before, after):
        by_cell.setdefault(each.cell, []).append(each)
    largest = {cell: max(each.relative for each in changes) for cell, changes in by_cell.items()}
    far = [cell for cell, change in largest.items() if change > REORDERED]
    grown = {cell for cell in far if starts_at_rounding(by_cell[cell])}
    unexplained = sorted((cell for cell in far if cell not in grown), key=lambda cell: -largest[cell])
    shared = len(before.keys() & after.keys())
    lines = [
        f"{shared} cells on both sides; {len(before) - shared} only before, {len(after) - shared} only after",
        f"{shared - sum(change > SAME for change in largest.values())} agree within {SAME:g}",
        f"{sum(SAME < change <= REORDERED for change in largest.values())} moved, all values within {REORDERED:g}",
        f"{len(grown)} moved further from a rounding difference at their first contact",
        f"{len(unexplained)} moved further for another reason:",
    ]
    for cell in unexplained:
        lines.append(f"  {cell}")
        changes = sorted(by_cell[cell], key=lambda each: -each.relative)
        lines += [f"    {each.relative:.1g}  {each.path}: {each.before} -> {each.after}" for each in changes[:LISTED]]
    return "\n".join(lines)


def read(file: Path) -> dict[str, dict[str, Any]]:
    """Return a collection."""
    with gzip.open(file, "rt") as stream:
        loaded: dict[str, dict[str, Any]] = json.load(stream)
    return loaded


def command(arguments: Sequence[str]) -> int:
    """Collect or compare."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    collecting = commands.add_parser("collect", help="run everything and keep its numbers")
    collecting.add_argument("--out", type=Path, required=True)
    collecting.add_argument("--jobs", type=int, default=2)
    collecting.add_argument("--every", type=int, default=1, help="keep every n-th cell, for a quick look")
    collecting.add_argument("--only", choices=("case", "matrix"))
    comparing = commands.add_parser("compare", help="list the numbers that moved")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    given = parser.parse_args(arguments)
    if given.command == "collect":
        cells = [cell for cell in (*case_cells(), *matrix_cells()) if given.only in (None, cell[0])][:: given.every]
        found = collect(cells, given.jobs)
        with gzip.open(given.out, "wt") as stream:
            json.dump(found, stream)
        print(f"{len(found)} cells in {given.out}")
    else:
        print(report(read(given.before), read(given.after)))
    return 0


if __name__ == "__main__":
    sys.exit(command(sys.argv[1:]))
