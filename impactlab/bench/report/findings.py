"""The findings of a table in sentences: fastest methods, uncertainty of references and times."""

from __future__ import annotations

import collections
import statistics
from collections.abc import Sequence

from impactlab.bench.report.automatic import choice_words
from impactlab.bench.report.method_styles import power
from impactlab.bench.report.ranking import CONVERGED, MET, best, comparable, median, ranking
from impactlab.bench.report.sheets import milliseconds, short
from impactlab.bench.report.summary_sheets import percent_of, spreads
from impactlab.bench.report.views import BOTH, TOLERANCES, SceneRows
from impactlab.bench.schema import COMPLETED, Row
from impactlab.printing import counted

MAX_NAMED = 3  # methods that a sentence names


def findings(scenes: Sequence[SceneRows]) -> list[str]:
    """Return a sentence on each of the fastest methods among runs that were timed."""
    found = [_exact(scenes), *(_at(scenes, tolerance) for tolerance in TOLERANCES), _steady(scenes)]
    return [*filter(None, found), *choice_words(scenes)]


def _exact(scenes: Sequence[SceneRows]) -> str:
    """Return a sentence on runs without steps: their scenes and times."""
    served = [scene for scene in scenes if any(row.stepless for row in scene.rows)]
    if not served:
        return ""
    times = [row.solve_s for scene in served for row in scene.rows if row.stepless and row.solve_s]
    leads = [[best(scene, BOTH, tolerance) for tolerance in TOLERANCES] for scene in served]
    wins = sum(all(lead is not None and lead.stepless for lead in found) for found in leads)
    several = len(scenes) > 1
    among = f" in {len(served)} of {counted(len(scenes), 'scene')}" if several else ""
    known, rest = f"A solution without steps exists{among}", ""
    if times:
        known += f", {'median ' if several else 'in '}{milliseconds(statistics.median(times))} ms"
        if several:
            rest = f"; it is the fastest at every tolerance in {wins} of them"
        elif wins:
            rest = "; it is the fastest at every tolerance"
    return f"{known}{rest}. The other findings compare methods with steps."


def _at(scenes: Sequence[SceneRows], tolerance: float) -> str:
    """Return as text the methods that are fastest most often.

    They are those at one tolerance, special grids left out; empty without times.
    """
    kept = comparable(scenes, BOTH, tolerance).scenes
    if not kept:
        return f"No scene has a reference certain enough for {power(tolerance)}."
    leads = [lead for scene in kept if (lead := best(scene, BOTH, tolerance, ordinary=True)) is not None]
    wins = collections.Counter(lead.method for lead in leads)
    if not wins:
        named = f"At {power(tolerance)} no method of the grid meets both norms with steps other than dt = h/c"
        among = f" in any of {counted(len(kept), 'scene')}" if len(kept) > 1 else ""
        return f"{named}{among}."
    if all(lead.solve_s is None for lead in leads):  # nothing was timed
        return ""
    if len(kept) == 1:
        return f"At {power(tolerance)} in displacement and impulse {next(iter(wins))} is fastest."
    named = ", ".join(f"{method} in {count}" for method, count in wins.most_common(MAX_NAMED))
    unmet = len(kept) - wins.total()
    missing = f"; none meets the tolerance in {unmet}" if unmet else ""
    fastest = f"the fastest method in {counted(len(kept), 'scene')} is {named}"
    return f"At {power(tolerance)} in displacement and impulse, {fastest}{missing}."


def _steady(scenes: Sequence[SceneRows]) -> str:
    """Return as text the most reliable stepped method, with its cost.

    It meets the middle tolerance most often off special grids.
    """
    tolerance = TOLERANCES[1]
    apart = {row.method for scene in scenes for row in scene.rows if row.stepless or row.special}
    table = [each for each in ranking(scenes, BOTH, tolerance) if each.method not in apart and each.count(MET)]
    if not table:
        return ""
    first = table[0]
    price = median(first.ratios_stepped)
    cost = f", in {short(price)} times the time of the fastest there (median)" if price is not None else ""
    several = len(first.results) > 1
    share = f", within it in {first.count(MET)} of {len(first.results)} scenes" if several else ""
    return f"Most reliable at {power(tolerance)}: {first.method}{share}{cost}."


def certainty_words(rows: Sequence[Row], scenes: Sequence[SceneRows]) -> list[str]:
    """Return the uncertainty of references and times, the scenes without reference, the runs without result."""
    converged = [scene for scene in scenes if scene.reference == CONVERGED]
    exact = sum(bool(scene.reference) for scene in scenes) - len(converged)
    none = [scene.name for scene in scenes if not scene.reference]
    words = [f"Errors are measured against the exact solution in {counted(exact, 'scene')}"]
    if converged:
        worst = max(scene.uncertainty for scene in converged)
        words[0] += f", against a converged one in {len(converged)} (of uncertainty {short(worst)} or less)"
    words[0] += "."
    if none:
        words.append(f"No reference, so not ranked: {', '.join(none)}.")
    spread = spreads(rows)
    if spread:
        repeats = sorted({row.repeats for row in rows if row.repeats})
        count = f"{repeats[0]}" if len(repeats) == 1 else f"{repeats[0]} to {repeats[-1]}"
        half, most = percent_of(statistics.median(spread)), percent_of(max(spread))
        words.append(
            f"Times are the least of {count} repeats; in half of the runs their median lies within {half} % above it, "
            f"in the worst {most} %. A ratio nearer to one than that is a tie."
        )
    counts = collections.Counter(row.status for row in rows)
    lost = "".join(f", {count} {status}" for status, count in counts.items() if status != COMPLETED)
    words.append(f"{len(rows)} runs: {counts[COMPLETED]} completed{lost}. All of them are listed.")
    places = sorted({row.machine for row in rows if row.machine})
    if places:
        words.append(f"Measured on {'; '.join(places)}.")
    if len(places) > 1:
        words.append("The table holds times of several machines: do not compare them.")
    codes = sorted({row.code for row in rows if row.code})
    if len(codes) > 1:
        words.append(f"The table holds rows of {len(codes)} versions of impactlab: {', '.join(codes)}.")
    return words
