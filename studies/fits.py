"""Fits of noisy signals of known numbers: success and coverage.

They count how often fits reach the noise, and how often their intervals hold. ``python -m studies.fits [--trials 100]``
writes the table of docs/fits.md. Starts lie 25 % off (standard deviation of the logarithm 0.22), the noise is 2 % of
the largest value, the trigger time is unknown.
"""

from __future__ import annotations

import argparse
import math
import warnings
from concurrent.futures import ProcessPoolExecutor
from typing import Any, NamedTuple

import numpy as np

import impactlab as il
from impactlab.fits.model import Means
from impactlab.types import Array
from studies.pages import DOCS

SAMPLES, NOISE, OFF, LATE = 300, 0.02, 0.22, 40.0
START, END = "<!-- trials -->", "<!-- end -->"
HEAD = (
    "| scene | noise | trials | reach the noise | loss above the truth | no estimate moved | intervals that hold |",
    "|" + "---|" * 7,
)


class Scene(NamedTuple):
    """A case, the channel that is measured, and the numbers that are fitted."""

    name: str
    case: il.Case
    channel: str
    parameters: tuple[str, ...]


def scenes() -> list[Scene]:
    """Return the four scenes."""
    rod = {"kind": "rod", "length": 0.3, "area": 9e-4, "material": {"young": 2.1e11, "density": 7900.0}}
    hammer = {"kind": "mass", "mass": 2.133, "velocity": 1.0}
    hit = {"between": ["hammer", "rod.left"], "law": {"kind": "addition_deletion"}}
    solve = {"duration": {"round_trips": 3}, "model": {"kind": "continuous"}}

    def struck(law: dict[str, Any], **rod_keys: Any) -> il.Case:
        bodies = {"hammer": hammer, "rod": {**rod, **rod_keys}}
        return il.Case.from_dict(
            {"schema_version": 1, "bodies": bodies, "contacts": [{**hit, "law": law}], "solve": solve}
        )

    hard = {"kind": "addition_deletion"}
    bar = {"kind": "rod", "length": 1.0, "area": 2e-4, "material": {"young": 2e11, "density": 7800.0}}
    hopkinson = il.Case.from_dict({
        "schema_version": 1,
        "bodies": {
            "striker": {**bar, "length": 0.2, "velocity": 10.0},
            "bar": {**bar, "ends": {"right": {"dashpot": 4e3}}},
        },
        "contacts": [{"between": ["striker.right", "bar.left"], "law": hard}],
        "solve": {"duration": 6e-4, "model": {"kind": "continuous"}},
        "probes": [{"body": "bar", "at": 0.5, "quantity": "strain"}],
    })  # fmt: skip
    cushion = {"kind": "penalty", "stiffness": 2e8, "damping": 2000.0}
    force, mass = "force:hammer|rod.left", "bodies.hammer.mass"
    law, toe, young = "contacts.0.law", "bodies.rod.ends.right.dashpot", "bodies.rod.material.young"
    return [
        Scene("cushion", struck(cushion, ends={"right": "clamped"}), force,
              (f"{law}.stiffness", f"{law}.damping", mass)),
        Scene("hard contact", struck(hard, ends={"right": "clamped"}), force, (mass, young)),
        Scene("pile with a dashpot toe", struck(cushion, ends={"right": {"dashpot": 1.5e4}}), force,
              (f"{law}.stiffness", toe)),
        Scene("strain gauge on a Hopkinson bar", hopkinson, "strain:bar@0.5",
              ("bodies.striker.velocity", "bodies.bar.ends.right.dashpot", "bodies.bar.material.young")),
    ]  # fmt: skip


def number(case: il.Case, path: str) -> float:
    """Return the number at a path, in SI."""
    found: Any = case.resolved()
    for key in path.split("."):
        found = found[int(key)] if isinstance(found, list) else found[key]
    return float(found)


class Count(NamedTuple):
    """Counts of some trials and of the intervals that hold.

    Counted are those at the noise, and those with a loss above that of the truth. Of trials with outliers those, too,
    in which no estimate moves by more than half of its interval.
    """

    reached: int
    above: int
    still: int
    held: dict[str, int]


def noise_of(kind: str, generator: np.random.Generator) -> Array:
    """Return noise of standard deviation 1; ``ar1`` correlates by 0.9 from sample to sample."""
    noise = generator.standard_normal(SAMPLES)
    if kind == "ar1":
        for k in range(1, SAMPLES):
            noise[k] = 0.9 * noise[k - 1] + math.sqrt(1.0 - 0.81) * noise[k]
    return noise


def trials(scene: Scene, kind: str, count: int, seed: int) -> Count:
    """Fit noisy signals; ``kind`` is white, ar1 or outliers."""
    generator = np.random.default_rng(seed)
    history = il.run(scene.case)
    width = 1.15 * history.duration / SAMPLES
    times: Array = np.asarray((np.arange(SAMPLES) + 0.5) * width, dtype=float)
    edges = il.Signal(scene.channel, times, 0.0 * times).edges
    means = Means(history, scene.channel)
    reached = above = still = 0
    held = dict.fromkeys(scene.parameters, 0)
    truth = {path: number(scene.case, path) for path in scene.parameters}
    bounds = {path: (value / 5.0, 5.0 * value) for path, value in truth.items()}
    for _ in range(count):
        clean = means.over(edges, generator.uniform(0.0, LATE) * width)
        size = NOISE * np.max(np.abs(clean))
        noise: Array = size * noise_of(kind, generator)
        start = scene.case.with_settings(
            [(path, value * math.exp(generator.normal(0.0, OFF))) for path, value in truth.items()]
        )
        model = "ar1" if kind == "ar1" else "white"
        found = plain = il.fit(start, il.Signal(scene.channel, times, clean + noise), bounds, shift="free", noise=model)
        if kind == "outliers":
            wild = generator.random(SAMPLES) < 0.05
            outliers = 10.0 * size * wild * generator.choice([-1.0, 1.0], SAMPLES)
            signal = il.Signal(scene.channel, times, clean + noise + outliers)
            found = il.fit(start, signal, bounds, shift="free", loss="huber")
            still += all(
                abs(found[path].value - plain[path].value) <= 0.5 * (plain[path].upper - plain[path].lower)
                for path in truth
            )
        loss = float(np.sum(np.concatenate(found.residuals) ** 2)) * float(np.var(clean + noise))
        if kind == "white":
            reached += loss < 1.1 * float(noise @ noise)
            above += loss > float(noise @ noise)
        for path, value in truth.items():
            held[path] += found[path].lower <= value <= found[path].upper
    return Count(reached, above, still, held)


def line(scene: Scene, kind: str, count: int, found: Count) -> str:
    """Return a line of the table."""
    held = ", ".join(f"{path.rpartition('.')[2]} {number}" for path, number in found.held.items())
    white = (found.reached, found.above) if kind == "white" else ("", "")
    still = found.still if kind == "outliers" else ""
    return f"| {' | '.join(map(str, (scene.name, kind, count, *white, still, held)))} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--kinds", default="white,ar1,outliers")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--scene", default="", help="scenes whose name holds this")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    chosen = [(scene, kind) for scene in scenes() if given.scene in scene.name for kind in given.kinds.split(",")]
    found = {}
    with ProcessPoolExecutor(given.workers) as pool:
        waiting = [pool.submit(trials, scene, kind, given.trials, given.seed) for scene, kind in chosen]
        for (scene, kind), each in zip(chosen, waiting, strict=True):
            found[scene.name, kind] = line(scene, kind, given.trials, each.result())
            print(found[scene.name, kind], flush=True)
    write(found)


def write(found: dict[tuple[str, str], str]) -> None:
    """Write lines of the table by scene and noise.

    Lines that were not made again stay.
    """
    page = DOCS / "fits.md"
    before, _, rest = page.read_text(encoding="utf-8").partition(START)
    table, _, after = rest.partition(END)
    known = {
        (row[1].strip(), row[2].strip()): "|".join(row)
        for row in (each.split("|") for each in table.splitlines())
        if len(row) > 2
    }
    order = [(scene.name, kind) for scene in scenes() for kind in ("white", "ar1", "outliers")]
    lines = [(known | found)[key] for key in order if key in known or key in found]
    page.write_text(before + "\n".join([START, *HEAD, *lines, END]) + after, encoding="utf-8")


if __name__ == "__main__":
    main()
