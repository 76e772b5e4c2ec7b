"""The families that serve scenes with beams: modes under exact steps, and beam elements under the midpoint rule.

Both refine space and time together. Their factors were measured on spheres and hammers on pinned beams and cantilevers;
as for rods they decide where trials begin, and never what error is stated.
"""

from __future__ import annotations

from impactlab.refine.families import FIXED_S, Family
from impactlab.refine.reference_beams import is_singular, ways
from impactlab.refine.ways import Way
from impactlab.scene.facts import beams_of
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Scene
from impactlab.simulate.body_sizes import MOST_BEAM_MODES

SETUP_S = 5e-3  # s, modes or a mesh with its rows
FACTOR = 0.3  # of n^-2 (n^-1 where a beam shears): the error of both families at fineness n
COARSEST = 12  # modes or elements


def serving(asked: Simulation) -> tuple[list[Family], str]:
    """Return the families that serve a scene with beams, and why there may be none."""
    if is_singular(asked):
        beam = beams_of(asked.scene)[0].name
        return [], (
            f"a hard contact on the Euler-Bernoulli beam '{beam}' has no answer that a finer description comes nearer "
            "to: its faces part and meet ever more often. Give the contact a law with a stiffness"
        )
    return [_family(asked.scene, way) for way in ways(asked)], ""


def _family(scene: Scene, way: Way) -> Family:
    sheared = any(beam.theory == "timoshenko" for beam in beams_of(scene))
    order = 1.0 if sheared else 2.0  # where a beam shears, a force leaves a kink that falls between nodes or modes
    name, _, unit = way.words.rstrip(":").partition(", ")
    return Family(
        name,
        unit or "modes",
        way.run,
        lambda n: FIXED_S + way.seconds(n),
        lambda n: FACTOR * float(n) ** -order,
        order=order,
        safety=3.0,
        setup_s=SETUP_S,
        doubt=1.5,
        coarsest=COARSEST,
        finest=MOST_BEAM_MODES if name.startswith("modes") else 10_000_000,
    )
