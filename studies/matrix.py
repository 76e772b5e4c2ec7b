"""Every law under every scheme on every model: matrix.md.

Nothing is listed here: laws, schemes, models and bases are those that impactlab registers, so that a new part joins by
itself. The cells run in processes of their own, which are killed where one hangs.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import os
import platform
import re
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache, partial
from typing import Any, NamedTuple

import impactlab as il
from impactlab import metrics, simulate
from impactlab.api import reference_of
from impactlab.errors import CaseError, ImpactlabError, PluginError, StepError
from impactlab.history import AbstractHistory
from impactlab.integrators.base import AbstractIntegrator, AbstractScheme
from impactlab.jobs.process_pool import outcomes
from impactlab.metrics.norms import face_channels
from impactlab.models.base import AbstractRodModel
from impactlab.plugins import BASES, INTEGRATORS, LAWS, MODELS, Group, kind_of, registry
from impactlab.scene import Rod, Scene
from impactlab.scene.method import Simulation, StepRule, laws_of
from impactlab.testing.verdict import options_to_try, required
from studies.pages import CASES, DOCS, Study

ROD, BEAM, TURNING, CRANK = "", "beam: ", "turning beam: ", "slider-crank: "  # before the name of a model: its body
BEAM_ELEMENTS, BEAM_MODES = 20, 20  # of the models of beams
LINK_ELEMENTS, LINK_MODES = 40, 6  # of the connecting rod of the slider-crank
FINE_STEP = 2.5e-7  # s, of the solution of the slider-crank
YIELD = 1.0e5  # N, of joints on the slider-crank
SLOW = 0.1  # Courant number of an explicit scheme on beams, whose bending waves outrun axial ones on short elements
LIMIT = 300.0  # s, after which a cell counts as hung; the first ones compile
ELEMENTS, MODES = 100, 40  # of every model that needs them; nodes where the order is higher
NOTED = 1e-3  # energy gain over the initial energy from which a cell states it
AGAIN = 0.2  # s; a run that is shorter is timed twice


Cell = tuple[str, str, str]  # model, law, scheme


class Scheme(NamedTuple):
    """An integrator and how it treats events."""

    integrator: AbstractScheme
    events: str


class Subject(NamedTuple):
    """A case whose body some models describe."""

    file: str
    duration: float | None = None  # s, of three trips; None: that of the case
    spring: float = math.nan  # N/m, 3 F/(2 d) of Hertz's law at the largest force of the case
    changes: Mapping[str, Any] = {}  # of the case: dotted path to value


SUBJECTS = {
    ROD: Subject("axial_impact.yaml"),
    BEAM: Subject("sphere_on_beam.yaml", spring=1.6e7),
    TURNING: Subject("rotating_beam.yaml", 5.0e-3, 2.1e6),
    CRANK: Subject("slider_crank.yaml", 1.5e-3, 2.7e7, {"contacts.0.gap": 1.0e-3}),
}


class Outcome(NamedTuple):
    """Outcome of one cell."""

    status: str  # completed; refused, before the first step; failed, with the reason of a run; broken: a fault of ours
    mass: float | None = None  # errors against the exact hard contact
    face: float | None = None
    second: bool | None = None  # whether the second contact was found; None for a law of kicks
    gain: float | None = None  # of energy, over the initial energy
    solve_ms: float | None = None
    error: str = ""  # class of the error
    text: str = ""
    remedy: str = ""
    path: str = ""
    written: str = ""  # cell of a page that was read


def label(name: str, options: Mapping[str, Any]) -> str:
    """Return a part's name and options in few letters."""
    shown = [value if isinstance(value, str) else f"{key} {value}" for key, value in options.items() if value]
    return ", ".join([name, *(text.lower() if text.isupper() else text for text in shown)])


def variants(group: Group, name: str) -> dict[str, Any]:
    """Return a part by default, and with its other choices.

    A choice is a word or a yes among its examples. Options that have no default come from the first of its examples.
    """
    kind = registry().load(group, name)
    first = options_to_try(kind)[0]
    base = {key: first[key] for key in required(kind)}
    try:
        made = {name: kind(**base)}
    except CaseError:  # it needs one of several options
        base = dict(first)
        made = {name: kind(**base)}
    for options in options_to_try(kind):
        choice = {k: v for k, v in options.items() if isinstance(v, str | bool) and v != getattr(made[name], k)}
        if choice:
            made.setdefault(label(name, choice), kind(**{**base, **choice}))
    return made


@cache
def laws() -> dict[str, Any]:
    """Return every registered law."""
    names = registry().only("impactlab").names(LAWS)
    return {title: part for name in names for title, part in variants(LAWS, name).items()}


@cache
def schemes() -> dict[str, Scheme]:
    """Return every registered integrator; one that can cut a step also with located events."""
    made = {}
    for name in registry().only("impactlab").names(INTEGRATORS):
        part = next(iter(variants(INTEGRATORS, name).values()))
        made[name] = Scheme(part, "dated")
        if isinstance(part, AbstractIntegrator) and part.any_dt:
            made[f"{name}, located"] = Scheme(part, "located")
    return made


@cache
def models() -> dict[str, AbstractRodModel]:
    """Return every registered model with its examples and bases.

    Every basis is used where a model has a choice of them.
    """
    ours = registry().only("impactlab")
    made: dict[str, AbstractRodModel] = {}
    for name in ours.names(MODELS):
        kind = ours.load(MODELS, name)
        # With static shapes for the modes left out, modes are those of another row with a coordinate more.
        tried = [sized(kind, options) for options in options_to_try(kind) if not options.get("residual")]
        fields = {field.name: field for field in dataclasses.fields(kind)}
        if "basis" in fields:
            size = {"elements": ELEMENTS, "modes": MODES}
            tried += [size | {"basis": ours.load(BASES, basis)()} for basis in ours.names(BASES)]
        for options in tried:
            part = kind(**options)
            if part not in made.values():
                made[model_label(name, options)] = part
    return made | beam_models()


def beam_models() -> dict[str, AbstractRodModel]:
    """Return the models of the beams and of the crank.

    They are meshes of both masses, modes of a mesh and analytic ones; modes of the crank.
    """
    mesh = {"elements": BEAM_ELEMENTS}
    modes = {**mesh, "modes": BEAM_MODES}
    tried: list[tuple[str, str, dict[str, Any]]] = [
        (BEAM, "finite_element", mesh),
        (BEAM, "finite_element", {**mesh, "mass": "lumped"}),
        (BEAM, "modal", modes),
        (BEAM, "modal", {"modes": BEAM_MODES}),
        (TURNING, "finite_element", mesh),
        (TURNING, "modal", modes),
        (CRANK, "modal", {"elements": LINK_ELEMENTS, "modes": LINK_MODES}),
    ]
    ours = registry().only("impactlab")
    return {body + model_label(name, options): ours.load(MODELS, name)(**options) for body, name, options in tried}


def sized(kind: type[Any], options: Mapping[str, Any]) -> dict[str, Any]:
    """Return a model's options with the sizes of this page.

    Every order has as many nodes.
    """
    size = {"elements": ELEMENTS // options.get("order", 1), "modes": MODES}
    defaults = {field.name for field in dataclasses.fields(kind)}
    return {key: size.get(key, value) if key in defaults else value for key, value in options.items()}


def model_label(name: str, options: Mapping[str, Any]) -> str:
    """Return a model in few letters: ``modal 100/40, ritz``."""
    sizes = "/".join(str(options[key]) for key in ("elements", "modes") if key in options)
    words = [str(options["mass"])] if "mass" in options else []
    words += [f"order {options['order']}"] if "order" in options else []
    words += [kind_of(options["basis"])] if "basis" in options else []
    return ", ".join([f"{name} {sizes}".strip(), *words])


def step_of(integrator: AbstractScheme, model: AbstractRodModel, courant: float = 0.5) -> StepRule:
    """Return ten points per period, or a Courant number.

    The latter is for an explicit scheme on a mesh.
    """
    explicit = isinstance(integrator, AbstractIntegrator) and integrator.load_point == 0.0
    if explicit and model.has_mesh:
        return StepRule(courant=courant)
    return StepRule(points_per_period=10.0)


def body_of(model: str) -> str:
    """Return the body that a model describes, a key of SUBJECTS."""
    return next((body for body in (BEAM, TURNING, CRANK) if model.startswith(body)), ROD)


@cache
def case(body: str, trips: float) -> tuple[Simulation, AbstractHistory]:
    """Return the case of a body, and its solution.

    It runs over some round trips, or a share of its duration. The solution is exact for the rod, converged for beams,
    and a fine run where nothing else serves the scene.
    """
    subject = SUBJECTS[body]
    written = il.load_case(CASES / subject.file).with_("snapshots", []).with_settings(subject.changes)
    duration = {"round_trips": trips} if body == ROD else (subject.duration or written.scene().duration) * trips / 3.0
    scene = written.with_("solve.duration", duration).simulation()
    found = reference_of(*scene) if body != CRANK else None
    if found is not None:
        return scene, found[1]
    fine = dataclasses.replace(scene.method.models["rod"], modes=4 * LINK_MODES)  # type: ignore[call-arg]
    return scene, simulate.run(*scene.but(model=fine, step=StepRule(dt=FINE_STEP)))


def case_of(model: str, trips: float) -> tuple[Simulation, AbstractHistory]:
    """Return the case that a model describes, and its solution."""
    return case(body_of(model), trips)


def law_on(model: str, law: str, given: Simulation) -> Any:
    """Return a law with the stiffness of a case.

    On beams a power law has that stiffness, a spring the tangent of that at its peak.
    """
    part, body = laws()[law], body_of(model)
    fields = {field.name for field in dataclasses.fields(part)}
    if body == ROD or "stiffness" not in fields:
        return part
    if body == CRANK and "yield_force" in fields:
        # A joint starts stretched by the gap, here with 27 kN: its yield force lies above that.
        part = dataclasses.replace(part, yield_force=YIELD)
    hertz: float = laws_of(*given)[0].stiffness  # type: ignore[attr-defined] # the law of the case
    return dataclasses.replace(part, stiffness=hertz if "exponent" in fields else SUBJECTS[body].spring)


def scene_of(model: str, law: str, scheme: str, trips: float = 3.0) -> Simulation:
    """Return the scene of one cell."""
    base, part, chosen = case_of(model, trips)[0], models()[model], schemes()[scheme]
    return base.but(
        model=part,
        law=law_on(model, law, base),
        integrator=chosen.integrator,
        events=chosen.events,  # type: ignore[arg-type]
        step=step_of(chosen.integrator, part, 0.5 if body_of(model) == ROD else SLOW),
        probes=() if part.exact else base.scene.probes,
    )


def outcome(model: str, law: str, scheme: str, trips: float = 3.0, timed: bool = True) -> Outcome:
    """Return the outcome of one cell; ``timed``: a short run is repeated, for its time."""
    try:
        scene = scene_of(model, law, scheme, trips)
        history = simulate.run(*scene)
        if timed and history.cost.solve_s < AGAIN:
            history = min(history, simulate.run(*scene), key=lambda each: each.cost.solve_s)
        return judged(history, scene.scene, case_of(model, trips)[1])
    except Exception as error:  # noqa: BLE001 - whatever a part raises belongs on the page
        ours = isinstance(error, ImpactlabError) and not isinstance(error, PluginError)
        status = ("failed" if isinstance(error, StepError) else "refused") if ours else "broken"
        text = error.text if isinstance(error, ImpactlabError) else f"{type(error).__name__}: {error}"
        remedy, path = (error.remedy, error.path) if isinstance(error, ImpactlabError) else ("", "")
        return Outcome(status, error=type(error).__name__, text=text, remedy=remedy, path=path)


def judged(history: AbstractHistory, scene: Scene, reference: AbstractHistory) -> Outcome:
    """Return the figures of a run that ended.

    One that is no finite number makes the cell broken.
    """
    mass = metrics.mass_displacement(history, reference, scene)
    face = metrics.face_displacement(history, reference, scene)
    second = None
    law = laws_of(history.scene, history.method)[0]
    if law.answers_force and any(isinstance(body, Rod) for body in scene.bodies.values()):
        second = any(span.start > 1.8 * scene.round_trip for span in history.contacts)
    gain = history.energy.largest_gain
    figures = (mass, face, gain, history.cost.solve_s)
    expected = [value for value in figures if value is not None or face_channels(scene)]  # a link is no face of a rod
    if not all(value is not None and math.isfinite(value) for value in expected):
        return Outcome("broken", text=f"mass, face, gain, time are {figures}")
    return Outcome("completed", mass, face, second, gain, 1e3 * history.cost.solve_s)


def cells() -> list[Cell]:
    """Return model, law and scheme of every cell."""
    return [(model, law, scheme) for model in models() for law in laws() for scheme in schemes()]


def run_all(
    wanted: Sequence[Cell], trips: float = 3.0, limit: float = LIMIT, timed: bool = True
) -> dict[Cell, Outcome]:
    """Return the outcome of each cell, run by two processes.

    One that hangs is killed after ``limit`` [s].
    """
    found = {}
    for cell, status, value in outcomes(partial(outcome_of, trips=trips, timed=timed), wanted, workers=2, limit=limit):
        found[cell] = value if status == "done" else Outcome("broken", text=f"{status}: {value}")
        if len(found) % 100 == 0:
            print(f"{len(found)} of {len(wanted)}", file=sys.stderr, flush=True)
    return {cell: found[cell] for cell in wanted}


def outcome_of(cell: Cell, trips: float, timed: bool) -> Outcome:
    """Return the outcome of one cell."""
    return outcome(*cell, trips, timed)


def percent(share: float) -> str:
    """Return a share of one in percent, two digits."""
    value = 100.0 * share
    return "0" if value < 1e-6 else f"{float(f'{value:.2g}'):g}"


def alike(text: str) -> str:
    """Return a reason without names and numbers.

    Names are of laws and integrators; they differ cell by cell.
    """
    names = sorted({kind_of(each) for each in (*laws().values(), *(s.integrator for s in schemes().values()))})
    text = re.sub(rf"(law|integrator|under) '(?:{'|'.join(names)})'", r"\1 '...'", text)
    text = re.sub(r" \(t = .*?\)$", "", text)
    return re.sub(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w])", "#", text)


class Legend:
    """Codes of reasons, in order; the same reasons share one."""

    def __init__(self) -> None:
        self.codes: dict[tuple[str, str], str] = {}
        self.examples: dict[str, Outcome] = {}
        self.counts: Counter[str] = Counter()

    def code(self, found: Outcome) -> str:
        """Return the code of an outcome that did not complete."""
        key = found.status, alike(found.text)
        letter = {"refused": "r", "failed": "F"}.get(found.status, "BROKEN ")
        number = 1 + sum(status == found.status for status, _ in self.codes)
        code = self.codes.setdefault(key, f"{letter}{number}")
        self.examples.setdefault(code, found)
        self.counts[code] += 1
        return code

    def lines(self, status: str) -> list[str]:
        """Return the meaning of the codes of a status, with the remedy of one cell."""
        found = [(code, text) for (kind, text), code in self.codes.items() if kind == status]
        return [
            f"- **{code}** ({self.counts[code]} cells, at `{self.examples[code].path or 'run'}`): {text}."
            + (f" *{alike(self.examples[code].remedy)}*" if self.examples[code].remedy else "")
            for code, text in found
        ]


def text_of(found: Outcome, legend: Legend) -> str:
    """Return a cell of the page."""
    if found.status != "completed":
        return legend.code(found)
    if found.written:
        return found.written
    assert found.mass is not None
    assert found.gain is not None
    assert found.solve_ms is not None
    text = percent(found.mass) + ("" if found.face is None else f" / {percent(found.face)}")
    if found.second is not None:
        text += ", 2nd" if found.second else ", -"
    if found.gain > NOTED:
        text += f", **+{percent(found.gain)}**"
    return f"{text}, {float(f'{found.solve_ms:.2g}'):g} ms"


def page(found: Mapping[Cell, Outcome]) -> str:
    """Return the page."""
    legend = Legend()
    counts = Counter(each.status for each in found.values())
    tables = []
    for model in models():
        tables += ["", f"## {model}", "", "| law | " + " | ".join(schemes()) + " |", "|---|" + "---|" * len(schemes())]
        for law in laws():
            row = [text_of(found[model, law, scheme], legend) for scheme in schemes()]
            tables.append(f"| {law} | " + " | ".join(row) + " |")
    told = ", ".join(f"{number} {status}" for status, number in counts.items())
    head = HEAD.format(cells=len(found), told=told, machine=machine(), laws=len(laws()), schemes=len(schemes()))
    failed = [
        f"{failure_of(cell)}{each.text}"
        for cell, each in sorted(found.items())
        if each.status not in ("completed", "refused")
    ]
    parts = [head, "## Refused before the first step", "", *legend.lines("refused"), "", "## Failed on the way", ""]
    parts += legend.lines("failed") or ["None."]
    parts += ["", *failed] if failed else []
    return "\n".join([*parts, *tables]) + "\n"


def failure_of(cell: Cell) -> str:
    """Return how the line of a failed cell begins."""
    return f"- {', '.join(cell)}: "


REASON = re.compile(r"^- \*\*(\w+)\*\* \(\d+ cells, at `(.*?)`\): (.*?)\.(?: \*(.*)\*)?$", re.MULTILINE)


def read(page: str) -> tuple[dict[Cell, Outcome], dict[Cell, str]]:
    """Return the outcomes on a page, and the texts of its cells, which are codes where no run completed."""
    told = {
        code: Outcome("failed" if code.startswith("F") else "refused", text=text, remedy=remedy or "", path=path)
        for code, path, text, remedy in REASON.findall(page)
    }
    listed = [line for line in page.splitlines() if line.startswith("- ")]
    found, shown, model, columns = dict[Cell, Outcome](), dict[Cell, str](), "", list[str]()
    for line in page.splitlines():
        if line.startswith("## "):
            model = line.removeprefix("## ")
        elif line.startswith("| law |"):
            columns = line.strip("| ").split(" | ")[1:]
        elif line.startswith("| "):
            law, *cells_of_law = line.strip("| ").split(" | ")
            for scheme, text in zip(columns, cells_of_law, strict=True):
                cell = model, law, scheme
                shown[cell] = text
                found[cell] = told.get(text, Outcome("completed", written=text))
                if found[cell].status == "failed":
                    own = failure_of(cell)
                    (whole,) = (line.removeprefix(own) for line in listed if line.startswith(own))
                    found[cell] = found[cell]._replace(text=whole)
    return found, shown


def machine() -> str:
    """Return the kind of machine."""
    return f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"


HEAD = """# Every law under every scheme on every model

Written by `python -m studies matrix`: {laws} laws, {schemes} schemes, all models and bases that impactlab registers; a
law with a choice of kinds counts once for each, a scheme that cuts steps at events also as *located*.
{cells} cells: {told}.

Does a law work with a scheme on a model, and how accurate is the result? Each cell is one combination. It runs
`cases/axial_impact.yaml` (a mass on a clamped rod, alpha = 1, three round trips), or is refused before its first step.

- **Steps:** ten points per shortest period; a Courant number of 1/2 for an explicit scheme on a mesh; `adaptive`
  chooses its own. *located* cuts steps at events, the others interpolate the times of events within the step.
- **Stiffnesses:** the defaults, relative to EA/h; 1e13 N/m^1.5 for the power laws.
- **The continuous model** solves hard contacts and constant springs from event to event, without a step. Under other
  laws it is a delay line, which is stepped and needs no scheme.

Models whose names begin as follows run another case:

- *beam:* runs `cases/sphere_on_beam.yaml` (a sphere, one contact). The explicit scheme on a mesh has a Courant number
  of 0.1, power laws the stiffness of the case, springs 1.6e7 N/m. Errors are relative to the converged result with
  Hertz's law, also those of other laws. A hard contact on this beam has no convergent force.
- *turning beam:* runs `cases/rotating_beam.yaml` over 5 ms, two contacts, springs 2.1e6 N/m.
- *slider-crank:* runs `cases/slider_crank.yaml`, whose connecting rod strikes a block after 1 mm, over 1.5 ms, springs
  2.7e7 N/m. Errors of block and slider are relative to the same mechanism with 24 modes at 0.25 us.

A cell reads `mass / face, 2nd, +gain, time`:

- *mass / face*: relative L2 errors of the displacements of mass and face against the exact hard contact [%], also for
  compliant laws;
- *2nd* if the second contact was found, *-* if it was missed (not given for laws that return impulses);
- *+gain*: the gain of energy [% of the initial energy], if it is above 0.1;
- *time*: the time of the steps [ms], the lower of two runs.

Times are of one machine ({machine}), which did other work too: compare them only
within a table.

A code stands for a refusal (r) or a failure (F), explained below; # stands for a number, ... for the part's name.
"""


def command(arguments: Sequence[str]) -> int:
    """Run some cells and print their outcomes; fail where one is broken."""
    parser = argparse.ArgumentParser(prog="python -m studies matrix", description="Run some cells of the matrix.")
    parser.add_argument("--trips", type=float, default=3.0, help="round trips that each cell runs")
    parser.add_argument("--only", default="", help="regular expression for 'model; law; scheme'")
    parser.add_argument(
        "--again", default="", help="codes of reasons, as r11,r22, or refused for all: run their cells, write the page"
    )
    options = parser.parse_args(arguments)
    if options.again:
        write_again(options.again.split(","))
        return 0
    found = run_all([cell for cell in cells() if re.search(options.only, "; ".join(cell))], options.trips)
    for cell, each in found.items():
        print("; ".join(cell), *each)
    return int(any(each.status == "broken" for each in found.values()))


def write_again(codes: Sequence[str]) -> None:
    """Run the cells of some codes again, and those that are new; write the page with the others as they stand."""
    path = DOCS / "matrix.md"
    found, shown = read(path.read_text(encoding="utf-8"))
    wanted = [cell for cell in cells() if cell not in found or shown[cell] in codes or found[cell].status in codes]
    path.write_text(page({cell: found.get(cell, Outcome("")) for cell in cells()} | run_all(wanted)), encoding="utf-8")


def text(_: str) -> str:
    """Return the page; a broken cell stops the study."""
    found = run_all(cells())
    broken = [f"{'; '.join(cell)}: {each.text}" for cell, each in found.items() if each.status == "broken"]
    if broken:
        raise SystemExit("\n".join(broken))
    return page(found)


STUDY = Study({"matrix.md": text}, command=command)
