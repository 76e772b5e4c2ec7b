"""Text for users: messages on standard error, summaries and listings as plain text."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from impactlab.history.advice import warning_lines
from impactlab.history.base import SERIOUS
from impactlab.history.units import UNITS
from impactlab.metrics.collision_texts import sentences
from impactlab.printing import plain
from impactlab.scene.method import Simulation, is_exact
from impactlab.startup.lazy import lazy

if TYPE_CHECKING:
    from impactlab.numerics import addresses
    from impactlab.report import choice, comparison
    from impactlab.simulate.stepping import loop
else:  # they load numba or the drivers, which `check` and the listings need not
    addresses = lazy("impactlab.numerics.addresses")
    choice, comparison = lazy("impactlab.report.choice"), lazy("impactlab.report.comparison")
    loop = lazy("impactlab.simulate.stepping.loop")

MAX_LINES = 12  # of events, contacts or collisions that are printed; an impulse law may have thousands
MAIN_ERRORS = (
    "mass_displacement",
    "face_displacement",
    "impulse",
    "peak_force",
    "force_away_from_jumps",
    "exit_velocity",
)
ROUNDING = 1e-11  # of a share: less is written as 0
UNITS_AT_END = {**UNITS, "angles": UNITS["angle"], "rates": UNITS["rate"]}
UNITS_DERIVED = {
    "stiffness": "N/m", "damping": "N s/m",
    "mass": "kg", "round_trip": "s", "wave_speed": "m/s", "impedance": "N s/m", "bending_stiffness": "N m2",
    "shear_speed": "m/s", "stretch": "m", "tip_radius": "m", "root_stress": "Pa", "rate": "rad/s", "radius": "m",
}  # fmt: skip
MAX_INTERVALS = 100_000  # of an exact run: seconds, where a run in steps takes hundredths
ADVICE_OF_STEP = (
    "for many runs: each joint of segments splits each front; with solve.step.dt the same "
    "rods are delay lines in steps, with wave_identification for hard contact"
)
MAX_NAMES = 4  # of bodies with one model that are printed
MAX_LAWS = 4  # from which the laws of contacts are counted by kind
STEADY = (
    ("rate", "rad/s", ""),
    ("tip_radius", "m", " tip radius"),
    ("stretch", "m", " steady stretch"),
    ("root_stress", "Pa", " root stress"),
    ("radius", "m", " from the axis"),
)
"""Facts of a steady rotation: key, unit and words."""
FIRST_LINES, LAST_LINES = 5, 2  # of a longer list
INDENT = 12 * " "  # of the second line of an entry


def say(text: str) -> None:
    """Print a message for people, on standard error."""
    print(text, file=sys.stderr, flush=True)


def print_json(document: Any) -> None:
    """Print one JSON document on standard output; a number that is not finite becomes null."""
    of_ascii = "utf" not in (sys.stdout.encoding or "utf-8").lower()  # others may lack a letter, and JSON escapes it
    text = json.dumps(plain(document), indent=1, allow_nan=False, ensure_ascii=of_ascii)
    # File names may hold bytes that are not text.
    print(text.encode("utf-8", "backslashreplace").decode("utf-8"), flush=True)


def _models(models: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the models of bodies in words, those that are alike together."""
    alike: dict[str, list[str]] = {}
    for name, model in models.items():
        alike.setdefault(comparison.model_words(model), []).append(name)
    return "; ".join(
        f"{', '.join(names) if len(names) <= MAX_NAMES else f'{len(names)} bodies'}: {words}"
        for words, names in alike.items()
    )


def summary_text(summary: Mapping[str, Any]) -> str:
    """Return the summary of a run for people."""
    method = summary["method"]
    models = _models(method["models"]) or "rigid bodies"
    kinds = [law["kind"] for law in method["laws"]]
    if len(kinds) > MAX_LAWS:
        kinds = [f"{count} {kind}" for kind, count in Counter(kinds).items()]
    laws = ", ".join(kinds) or "no contact"
    serious = [warned for warned in summary["warnings"] if warned["code"] in SERIOUS]
    instead = "no steps" if method["dt"] is None else method.get("stepping", "no integrator")
    integrator = method["integrator"]["kind"] if method["integrator"] else instead
    lines = [
        f"{summary['case']}: {summary['status']}",
        *(f"  warning   {line}" for line in warning_lines(serious)),
        f"  method    {models}; {laws}; {integrator}" + (f"; dt {method['dt']:.6g} s" if method["dt"] else ""),
    ]
    lines += _listed("events", summary["events"], _event)
    lines += _listed("contacts", summary["contacts"], _contact)
    lines += [_link(each) for each in summary.get("links", ())]
    together, met = sentences(summary["collisions"])
    if together:
        lines.append(f"{INDENT}{together} (each: --json)")
    lines += _shortened(met, lambda each: f"  collision {each}", lambda _: " collisions", INDENT)
    lines += _shortened([*summary.get("probes", {}).items()], _probe, lambda _: " probes", INDENT)
    lines += _at_end(summary["final"]["bodies"])
    lines += [_rotation(name, turn) for name, turn in summary.get("rotation", {}).items()]
    energy = summary["energy"]
    lines.append(
        f"  energy    {_number(energy['initial'])} J to {_number(energy['final'])} J, "
        f"largest gain {_percent(energy['largest_gain'])}, loss {_percent(energy['largest_loss'])}"
    )
    lines += _errors(summary)
    if summary.get("choice"):
        lines += choice.choice_lines(summary["choice"])
    cost = summary["cost"]
    exact = method["integrator"] is None and method["dt"] is None
    taken = "intervals between events" if exact else "steps"
    lines.append(f"  cost      {cost['steps']} {taken}, {cost['solve_s']:.3g} s to solve")
    if exact and cost["steps"] > MAX_INTERVALS:
        lines.append(f"{INDENT}{ADVICE_OF_STEP}")
    others = [warned for warned in summary["warnings"] if warned not in serious]
    lines += [f"  warning   {line}" for line in warning_lines(others)]
    return "\n".join(lines)


def _rotation(name: str, turn: Mapping[str, Any]) -> str:
    """Return the line of the steady state of a rotating body."""
    facts = [f"{_number(turn[key])} {unit}{words}" for key, unit, words in STEADY if key in turn]
    unchecked = "; its momentum, which the centrifugal force changes, is not checked"
    return f"  rotating  {name}: {', '.join(facts)}{unchecked if turn['momentum_unchecked'] else ''}"


def _errors(summary: Mapping[str, Any]) -> list[str]:
    """Return the line of the errors against the reference, or the reason why there are none."""
    errors = summary["errors"]
    if errors is None:
        return [f"  errors    {summary['reference']['text']}"]
    about = ("reference", "reference_uncertainty")
    shown = {key: value for key, value in errors.items() if key not in about and value is not None}
    if not shown:
        return []
    of_motion = max((value for key, value in shown.items() if key != "momentum_error"), default=None)
    if summary["method"]["dt"] is None and of_motion == 0.0:
        return ["  errors    none: this is the exact solution"]
    known = errors.get("reference_uncertainty")
    against = comparison.solution_words(errors["reference"]) + (f" (known to {known:.1g})" if known else "")
    main = [f"{key.replace('_', ' ')} {_percent(shown[key])}" for key in MAIN_ERRORS if key in shown]
    rest = ["more: --json"] if len(main) < len(shown) else []
    return [f"  errors    against {against}: " + ", ".join(main + rest)]


def wall_time(summary: Mapping[str, Any]) -> str:
    """Return the line with the wall time of a command by stage, and its sum."""
    spent = summary["cost"]["wall_time"]
    stages = ", ".join(f"{stage} {seconds:.3f}" for stage, seconds in spent.items())
    return f"  wall time {sum(spent.values()):.3f} s: {stages}"


def _link(link: Mapping[str, Any]) -> str:
    """Return the line of a link."""
    several = f" ({link['pieces']} pieces)" if link["pieces"] > 1 else ""
    moved = "" if link["set"] is None else f"set {_number(link['set'])} m, "
    forces = f"force {_number(link['smallest'])} to {_number(link['largest'])} N"
    return f"  link      {link['name']}{several}: {moved}{forces}, takes {_number(link['loss'])} J"


def verdict_text(document: Mapping[str, Any]) -> str:
    """Return the result of the check of a part, for people."""
    part = document["part"]
    lines = [f"{part['name']} [{part['distribution']}]: {part['description']}"]
    tried: Mapping[str, Any] | None = None
    for found in document["properties"]:
        if found["options"] != tried:
            tried = found["options"]
            lines.append(f"with {_options(tried)}")
        lines.append(f"  {'ok    ' if found['ok'] else 'FAILED'}  {found['property']}")
        if not found["ok"]:
            lines.append(f"          {found['reason']}")
    lines.append("measured")
    for figure in document["measured"]:
        unit = "" if figure["unit"] == "1" else f" {figure['unit']}"
        value = "none" if figure["value"] is None else f"{figure['value']:.4g}{unit}"
        declared = "" if figure["declared"] is None else f" (declared {figure['declared']:.4g})"
        remark = f"; {figure['remark']}" if figure["remark"] else ""
        lines.append(f"  {'ok    ' if figure['ok'] else 'FAILED'}  {figure['name']}: {value}{declared}{remark}")
    every = [*document["properties"], *document["measured"]]
    failed = sum(not found["ok"] for found in every)
    lines.append(f"{document['status']}: {failed} of {len(every)} checks failed" if failed else "ok")
    return "\n".join(lines)


def tree_text(tree: Any, indent: int = 0, derived: bool = False) -> str:
    """Return nested plain values, derived ones with units, as indented text."""
    pad = "  " * indent
    lines = []
    for key, value in tree.items():
        if isinstance(value, Mapping) and value:
            lines += [f"{pad}{key}:", tree_text(value, indent + 1, derived or key == "derived")]
        elif isinstance(value, (list, tuple)) and value and isinstance(value[0], Mapping):
            lines.append(f"{pad}{key}:")
            for item in value:
                lines.append(f"{pad}  -")
                lines.append(tree_text(item, indent + 2))
        else:
            unit = f"  # {UNITS_DERIVED[key]}" if derived and key in UNITS_DERIVED else ""
            lines.append(f"{pad}{key}: {_plain(value)}{unit}")
    return "\n".join(lines)


def _event(event: Mapping[str, Any]) -> str:
    return f"  {event['kind']:8}  {_number(event['time'])} s  {event['contact']}"


def _contact(span: Mapping[str, Any]) -> str:
    peak = "no force history" if span["peak_force"] is None else f"peak {_number(span['peak_force'])} N"
    kicks = f" in {span['kicks']} kicks" if span.get("kicks") is not None else ""
    open_end = "" if span["end"] is not None else "; closed when the run ends, so these are the values so far"
    return f"  contact   {span['contact']}: impulse {_number(span['impulse'])} N s{kicks}, {peak}{open_end}"


def _shortened(
    entries: Sequence[Any], line: Callable[[Any], str], more: Callable[[Sequence[Any]], str], indent: str = ""
) -> list[str]:
    """Return one line per entry, the first and last of many; ``more`` describes those between, on one line."""
    if len(entries) <= MAX_LINES:
        return [line(entry) for entry in entries]
    between = entries[FIRST_LINES : len(entries) - LAST_LINES]
    rest = f"{indent}... {len(between)} more{more(between)} (all of them: --json)"
    return [*map(line, entries[:FIRST_LINES]), rest, *map(line, entries[-LAST_LINES:])]


def few_of(names: Sequence[str]) -> list[str]:
    """Return names as they are, the first and last of many with the number of those between."""
    return _shortened(names, str, lambda _between: "")


def _listed(name: str, entries: Sequence[Mapping[str, Any]], line: Callable[[Mapping[str, Any]], str]) -> list[str]:
    """Return one line per entry; for those between the first and last of many, the range of their impulses."""

    def more(between: Sequence[Mapping[str, Any]]) -> str:
        impulses = [value for each in between if (value := each.get("impulse")) is not None]
        return f" {name}" + (f", impulses {_number(min(impulses))} to {_number(max(impulses))} N s" if impulses else "")

    return _shortened(entries, line, more, INDENT)


def _probe(entry: tuple[str, Mapping[str, float]]) -> str:
    """Return the range of a probe's channel in its unit."""
    channel, ranges = entry
    unit = UNITS.get(channel.partition(":")[0], "1")
    shown_unit = "" if unit == "1" else f" {unit}"
    return f"  probe     {channel}: {_number(ranges['min'])} to {_number(ranges['max'])}{shown_unit}"


def _at_end(bodies: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return one line per body; for those between the first and last of many, the range of each quantity."""

    def line(name: str) -> str:
        return f"  at end    {name}: " + ", ".join(_state(key, value) for key, value in bodies[name].items())

    def more(between: Sequence[str]) -> str:
        ranges = ""
        for key in dict.fromkeys(key for name in between for key in bodies[name]):
            values = [value for name in between if isinstance(value := bodies[name].get(key), float)]
            ranges += f", {key} {_number(min(values))} to {_number(max(values))}" if values else ""
        return f" bodies{ranges}"

    return _shortened(list(bodies), line, more, INDENT)


def _options(options: Mapping[str, Any]) -> str:
    return ", ".join(f"{key} {_plain(value)}" for key, value in options.items()) or "default options"


def _plain(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_plain(item) for item in value) + "]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_plain(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, str):
        return value or '""'
    return json.dumps(value)


def _state(key: str, value: Any) -> str:
    """Return a quantity of a body at the end, or those of its links."""
    unit = f" {UNITS_AT_END[key]}" if key in UNITS_AT_END else ""
    if isinstance(value, Mapping):
        return f"{key} " + ", ".join(f"{name} {_number(each)}{unit}" for name, each in value.items())
    return f"{key} {_number(value)}{unit}"


def _percent(share: float) -> str:
    """Return a share in per cent; one of rounding as 0."""
    return f"{100.0 * share:.3g} %" if abs(share) > ROUNDING else "0 %"


def _number(value: Any) -> str:
    return "none" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


def log_compiling(*simulations: Simulation) -> None:
    """Log, on standard error, that kernels are compiled first, if they are not on disk.

    Exact runs do not need the step loop; the march reports its own compilation.
    """
    if not simulations or not all(is_exact(*each) for each in simulations):
        addresses.log_compiling(loop.advance_dated)
