"""OpenSees through OpenSeesPy: finite elements for structures, in C++.

How it is set, and why:

- Truss elements in one dimension with elastic material and lumped nodal masses; contact is a `zeroLength` element with
  the no-tension material `ENT` between the mass and the first node, its stiffness scanned.
- Explicit: `NewmarkExplicit` with algorithm `Linear` and the system `Diagonal`, which lumped masses allow
  (`ExplicitDifference` gives the same in the same time; `CentralDifference` starts from rest whatever velocity is
  given). Implicit: `Newmark` (1/2, 1/4) and `HHT` with `Newton` and a loose test; `Linear` and `ModifiedNewton`
  diverge where contact changes the matrix.
- Equations numbered by `RCM`, constraints `Plain`; implicit schemes with `ProfileSPD` (`BandSPD` and `BandGen`
  take as long).
- No recorders; all steps in one call of `analyze`. Its model is global, so it is wiped before each run is built.
"""

from __future__ import annotations

import ctypes
import importlib.util
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers.cases import Case, Outcome
from benchmarks.peers.mesh import chain
from benchmarks.peers.run import Run, Setting, version_of

NAME = "OpenSees"
LIBRARY = "OpenSeesPy"
version = partial(version_of, "openseespy")
EXPLICIT = {"NewmarkExplicit": (0.5,)}
IMPLICIT = {"Newmark": (0.5, 0.25), "HHT": (0.7,)}


def engine() -> Any:
    """Return the module, also where its Linux build misses its own libraries.

    It brings these libraries and does not look for them there.
    """
    try:
        from openseespy import opensees
    except (ImportError, RuntimeError):
        found = importlib.util.find_spec("openseespylinux")
        if found is None or not found.submodule_search_locations:
            raise
        folder = Path(found.submodule_search_locations[0]) / "lib"
        for name in ("libquadmath.so.0", "libgfortran.so.4", "libblas.so.3", "liblapack.so.3"):
            if (folder / name).exists():
                ctypes.CDLL(str(folder / name), ctypes.RTLD_GLOBAL)
        from openseespy import opensees
    return opensees


def settings(case: Case) -> list[dict[str, Any]]:
    """Return meshes, schemes, steps [h/c] and contact stiffness [E A/h].

    Implicit schemes have solver and algorithm as well.
    """
    found = []
    meshes = (80, 120, 160, 200, 240)
    for n, scheme, courant, stiffness in product(meshes, EXPLICIT, (0.5, 0.7), (1.0, 3.0)):
        found.append(_setting(n, scheme, courant, stiffness))
    implicit = [("HHT", *each) for each in product(meshes, (0.5, 0.7, 1.0, 2.0), (10.0, 30.0))]
    implicit += [("Newmark", *each) for each in product(meshes, (0.5, 1.0), (10.0,))]
    for scheme, n, courant, stiffness in implicit:
        found.append(_setting(n, scheme, courant, stiffness) | {"algorithm": "Newton", "system": "ProfileSPD"})
    return found


def _setting(n: int, scheme: str, courant: float, stiffness: float) -> dict[str, Any]:
    return {"model": "chain", "coordinates": n, "scheme": scheme, "courant": courant, "contact_stiffness": stiffness}


def build(case: Case, setting: Setting, record: bool) -> Run:
    """Return a run; with ``record`` Python reads two displacements after every step."""
    ops = engine()
    n, rod = setting["coordinates"], chain(case, setting["coordinates"])
    steps, dt = case.steps_of(setting["courant"] * rod.h / case.wave_speed)
    hammer = n + 2
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    for i in range(n + 1):
        ops.node(i + 1, i * rod.h)
    ops.node(hammer, 0.0)
    ops.fix(n + 1, 1)
    for i, mass in enumerate(rod.mass):
        ops.mass(i + 1, float(mass))
    ops.mass(hammer, case.striker)
    for i, spring in enumerate(rod.spring):
        if i == 0 or spring != rod.spring[i - 1]:
            tag = i + 2
            ops.uniaxialMaterial("Elastic", tag, float(spring * rod.h))
        ops.element("Truss", i + 1, i + 1, i + 2, 1.0, tag)
    ops.uniaxialMaterial("ENT", 1, float(setting["contact_stiffness"] * rod.spring[0]))
    ops.element("zeroLength", n + 1, hammer, 1, "-mat", 1, "-dir", 1)
    ops.setNodeVel(hammer, 1, case.velocity, "-commit")
    _analysis(ops, setting)
    kept = np.zeros((steps + 1 if record else 1, 3))

    def solve() -> None:
        if not record:
            if ops.analyze(steps, dt) != 0:
                raise ArithmeticError("OpenSees did not converge")
            return
        for step in range(1, steps + 1):
            ops.analyze(1, dt)
            kept[step] = step * dt, ops.nodeDisp(hammer, 1), ops.nodeDisp(1, 1)

    def outcome() -> Outcome:
        return Outcome(kept[:, 0], kept[:, 1], kept[:, 2], float(ops.nodeVel(hammer, 1)))

    return Run(solve, outcome)


def _analysis(ops: Any, setting: Setting) -> None:
    """Choose the scheme, the solver and how nonlinear steps are solved."""
    scheme = setting["scheme"]
    explicit = scheme in EXPLICIT
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system("Diagonal" if explicit else setting["system"])
    if not explicit:
        ops.test("NormUnbalance", 1.0, 20, 0)  # N, of forces near 1e5
    ops.algorithm("Linear" if explicit else setting["algorithm"])
    ops.integrator(scheme, *(EXPLICIT[scheme] if explicit else IMPLICIT[scheme]))
    ops.analysis("Transient")
