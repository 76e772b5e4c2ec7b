"""Exudyn: flexible multibody dynamics in C++.

How it is set, and why:

- The fast build of the package (``sys.exudynFast``: no range checks), one thread, no files, no sensors while timed,
  nothing printed; fixed steps with ``useRecommendedStepSize=False``, else contact refines them.
- ``model``: ``items``: point masses and coordinate springs, its everyday way; ``matrix``: the same chain as one
  `ObjectGenericODE2` with sparse matrices, which spares thousands of items; ``reduced``: a few Craig-Bampton
  coordinates in one `ObjectGenericODE2`, component mode synthesis. An expert would take one of the last two.
- Contact: the limit stop of `CoordinateSpringDamperExt`, in C++, a spring and dashpot against penetration
  (`ObjectContactCoordinate` gives the same under fixed steps, in the same time). No user functions.
- Explicit: `VelocityVerlet` (one evaluation a step), `ExplicitMidpoint`, `RK44`; the mass matrix is factored once, for
  items inverted per body (`ObjectGenericODE2` cannot: version 1.13.6 refuses it, or is wrong in its fast build); no
  accelerations at the end of steps, no Lie group integration. Implicit: generalised-alpha with
  modified Newton that updates its Jacobian only where contact changes (``modifiedNewtonContractivity``). The sparse
  solver for chains; for reduced rods, whose mass matrix is an arrow, the sparse and the dense one.
- The solver object is called directly (`MainSolverExplicit.SolveSystem`): `SolveDynamic` adds 20 us.
"""

from __future__ import annotations

import contextlib
import io
import math
import sys
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from scipy import sparse

from benchmarks.peers.cases import Array, Case, Outcome
from benchmarks.peers.mesh import chain, reduced
from benchmarks.peers.run import Run, Setting, version_of

NAME = "Exudyn"
LIBRARY = "Exudyn"
version = partial(version_of, "exudyn")
EXPLICIT = ("ExplicitEuler", "ExplicitMidpoint", "RK33", "RK44", "VelocityVerlet")
FAR = 1e3  # m: the other limit stop, never reached


def settings(case: Case) -> list[dict[str, Any]]:
    """Return chains and reduced rods under explicit and implicit schemes.

    Stiffness is in E A/h, or in E A n/L if reduced.
    """
    found = []
    for n, stiffness in product((160, 240, 400), (1.0, 3.0)):
        found.append(_setting("matrix", n, "VelocityVerlet", 0.5, stiffness))
    for n in (100, 160):
        found.append(_setting("items", n, "VelocityVerlet", 0.5, 3.0))
    found.append(_setting("matrix", 240, "RK44", 0.8, 3.0))
    for n, courant, stiffness in product((100, 160, 240), (0.5, 1.0), (10.0, 30.0)):
        found.append(_setting("matrix", n, "GeneralizedAlpha", courant, stiffness, radius=0.5))
    sizes = (12, 16, 20, 24, 32, 48)
    for n, courant, stiffness, damping in product(sizes, (0.1, 0.15, 0.2, 0.3), (10.0, 30.0, 100.0), (0.3, 1.0)):
        # A stiffer contact shortens the stable step.
        if stiffness * courant**2 < 1.5:
            found += _solved(n, _setting("reduced", n, "VelocityVerlet", courant, stiffness, damping))
    for n, courant, stiffness, radius in product(sizes[1:], (0.15, 0.25, 0.5), (30.0, 100.0), (0.3, 0.5)):
        found += _solved(n, _setting("reduced", n, "GeneralizedAlpha", courant, stiffness, radius=radius))
    for n, courant in product((96, 128), (0.15, 0.25)):
        found += _solved(n, _setting("reduced", n, "GeneralizedAlpha", courant, 300.0, radius=0.3))
    for n in (16, 24):
        found += _solved(n, _setting("reduced", n, "RK44", 0.3, 30.0, 0.3))
    return found


def _solved(n: int, setting: dict[str, Any]) -> list[dict[str, Any]]:
    """Return a setting of a reduced rod with the quicker linear solvers.

    They depend on its size.
    """
    solvers = ["EXUdense"] if n < 32 else ["EXUdense", "EigenSparse"] if n < 64 else ["EigenSparse"]
    return [setting | {"linear": solver} for solver in solvers]


def _setting(
    model: str, n: int, scheme: str, courant: float, stiffness: float, damping: float = 0.0, radius: float | None = None
) -> dict[str, Any]:
    given = {"model": model, "coordinates": n, "scheme": scheme, "courant": courant, "contact_stiffness": stiffness}
    if damping:
        given["contact_damping"] = damping
    return given if radius is None else given | {"spectral_radius": radius}


def scales(case: Case, setting: Setting) -> tuple[float, float, float]:
    """Return step [s], contact stiffness [N/m] and contact damping [N s/m].

    They are those of a setting. ``courant`` is the step in h/c, of a reduced rod in two over its largest frequency (the
    stability limit without contact); ``contact_damping`` is in impedances of the face.
    """
    n, (_, area, young, density) = setting["coordinates"], case.segments[0]
    h = case.length / n
    stop = setting["contact_stiffness"] * young * area / h
    dashpot = setting.get("contact_damping", 0.0) * area * math.sqrt(young * density)
    if setting["model"] == "reduced":
        return setting["courant"] * 2.0 / reduced(case, n).highest, stop, dashpot
    return setting["courant"] * h / case.wave_speed, stop, dashpot


def engine() -> Any:
    """Return the module in its fast build, quiet."""
    sys.exudynFast = True  # type: ignore[attr-defined]
    with contextlib.redirect_stdout(io.StringIO()):
        import exudyn as exu
    exu.config.printToConsole = False
    return exu


def build(case: Case, setting: Setting, record: bool) -> Run:
    """Return a run; with ``record`` sensors store both displacements at every step."""
    exu = engine()
    dt, stop, dashpot = scales(case, setting)
    container = exu.SystemContainer()
    system = container.AddSystem()
    hammer, face, sensors = _bodies(exu, system, case, setting)
    markers = [system.AddMarker(_item("MarkerNodeCoordinate", nodeNumber=n, coordinate=0)) for n in (face, hammer)]
    states = system.AddNode(_item("NodeGenericData", initialCoordinates=[0.0] * 3, numberOfDataCoordinates=3))
    system.AddObject(
        _item(
            "ObjectConnectorCoordinateSpringDamperExt",
            markerNumbers=markers,
            nodeNumber=states,
            useLimitStops=True,
            limitStopsUpper=0.0,
            limitStopsLower=-FAR,
            limitStopsStiffness=stop,
            limitStopsDamping=dashpot,
        )
    )
    if record:
        quantity = exu.OutputVariableType.Coordinates
        sensors = [
            system.AddSensor(_item("SensorNode", nodeNumber=n, storeInternal=True, outputVariableType=quantity))
            for n in (hammer, face)
        ]
    system.Assemble()
    given = _simulation(exu, case, setting, case.steps_of(dt)[0])
    explicit = setting["scheme"] in EXPLICIT
    solver = exu.MainSolverExplicit() if explicit else exu.MainSolverImplicitSecondOrder()

    def solve() -> None:
        if not solver.SolveSystem(system, given):
            raise ArithmeticError("Exudyn did not converge")

    def outcome() -> Outcome:
        velocity = system.GetNodeOutput(hammer, exu.OutputVariableType.Coordinates_t)
        mass, rod = (np.asarray(system.GetSensorStoredData(sensor)) for sensor in sensors) if sensors else _nothing()
        return Outcome(mass[:, 0], mass[:, 1], rod[:, 1], float(np.ravel(velocity)[0]))

    return Run(solve, outcome)


def _nothing() -> tuple[Array, Array]:
    """Return the values of sensors at the start alone."""
    return np.zeros((1, 2)), np.zeros((1, 2))


def _item(kind: str, **options: Any) -> Any:
    from exudyn import itemInterface

    return getattr(itemInterface, kind)(**options)


def _bodies(exu: Any, system: Any, case: Case, setting: Setting) -> tuple[Any, Any, list[Any]]:
    """Add mass and rod; return their nodes and no sensors."""
    n = setting["coordinates"]
    hammer = system.AddNode(_item("Node1D", initialVelocities=[case.velocity]))
    system.AddObject(_item("ObjectMass1D", mass=case.striker, nodeNumber=hammer))
    if setting["model"] == "items":
        rod = chain(case, n)
        nodes = [system.AddNode(_item("Node1D")) for _ in rod.mass]
        for node, mass in zip(nodes, rod.mass, strict=True):
            system.AddObject(_item("ObjectMass1D", mass=float(mass), nodeNumber=node))
        ends = [*nodes, system.AddNode(_item("NodePointGround"))]
        markers = [system.AddMarker(_item("MarkerNodeCoordinate", nodeNumber=e, coordinate=0)) for e in ends]
        for i, spring in enumerate(rod.spring):
            pair = [markers[i], markers[i + 1]]
            kind = "ObjectConnectorCoordinateSpringDamper"
            system.AddObject(_item(kind, markerNumbers=pair, stiffness=float(spring)))
        return hammer, nodes[0], []
    mass, stiffness = exu.MatrixContainer(), exu.MatrixContainer()
    if setting["model"] == "reduced":
        small = reduced(case, n)
        mass.SetWithSparseMatrix(sparse.csr_matrix(small.mass))  # an arrow
        stiffness.SetWithSparseMatrix(sparse.csr_matrix(small.stiffness))
    else:
        rod = chain(case, n)
        diagonal = rod.spring.copy()
        diagonal[1:] += rod.spring[:-1]
        mass.SetWithSparseMatrix(sparse.diags([rod.mass], [0], format="csr"))
        bands = [-rod.spring[:-1], diagonal, -rod.spring[:-1]]
        stiffness.SetWithSparseMatrix(sparse.diags(bands, [-1, 0, 1], format="csr"))
    zero = [0.0] * n
    node = system.AddNode(
        _item(
            "NodeGenericODE2",
            referenceCoordinates=zero,
            initialCoordinates=zero,
            initialCoordinates_t=zero,
            numberOfODE2Coordinates=n,
        )
    )
    system.AddObject(_item("ObjectGenericODE2", nodeNumbers=[node], massMatrix=mass, stiffnessMatrix=stiffness))
    return hammer, node, []


def _simulation(exu: Any, case: Case, setting: Setting, steps: int) -> Any:
    """Return the settings of a run."""
    given = exu.SimulationSettings()
    given.solution.file.write = False
    given.solution.sensors.writePeriod = 0.5 * case.duration / steps
    given.linearSolver.solverType = getattr(exu.LinearSolverType, setting.get("linear", "EigenSparse"))
    time = given.timeIntegration
    time.endTime, time.numberOfSteps = case.duration, steps
    time.solverType = getattr(exu.DynamicSolverType, setting["scheme"])
    time.verboseMode = 0
    time.automaticStepSize = time.adaptiveStep = False
    time.minimumStepSize = 1e-6 * case.duration / steps
    time.discontinuous.useRecommendedStepSize = False
    time.explicit.computeEndOfStepAccelerations = False
    time.explicit.computeMassMatrixInversePerBody = setting["model"] == "items"
    time.explicit.useLieGroupIntegration = False
    time.newton.useModifiedNewton = True
    time.newton.modifiedNewtonContractivity = setting.get("contractivity", 1e-3)
    time.newton.relativeTolerance = setting.get("tolerance", 1e-6)
    time.newton.absoluteTolerance = 1e-12
    time.generalizedAlpha.spectralRadius = setting.get("spectral_radius", 1.0)
    return given
