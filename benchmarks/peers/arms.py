"""Two arms that strike a stop, in impactlab and in Exudyn.

Compared are the impulses of the first two sub-impacts.

``two_link_arm`` and ``arm_on_stop`` are the cases of these names, up to the end of the second sub-impact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers.cases import Array
from benchmarks.peers.exudyn_peer import _item, engine
from benchmarks.peers.impactlab_peer import stepped
from benchmarks.peers.run import Run, Setting
from impactlab.casefile.case import Case, load_case
from impactlab.history import AbstractHistory

CASES = Path(__file__).parents[2] / "cases"
YOUNG, DENSITY, WIDTH, HEIGHT, HAND = 7.0e10, 2700.0, 0.02, 0.01, 0.1  # Pa, kg/m3, m, m, kg: of both arms
EXPONENT = 1.5


@dataclass(frozen=True)
class Arm:
    """A flexible link with a mass in its hand, turning onto a stop.

    It is behind a rigid link, or hinged to the ground.
    """

    name: str
    length: float  # m
    rate: float  # rad/s
    stiffness: float  # N/m^1.5, of the contact
    duration: float  # s
    upper: tuple[float, float, float] | None  # the rigid link: length m, mass kg, angle rad; it turns at 1 rad/s
    torque: float  # N m, at the root
    aim: float  # how much faster than Exudyn

    def case(self, setting: Setting) -> Case:
        """Return the case with shapes and step of a setting."""
        changes: dict[str, Any] = {
            "solve.model": {"kind": "modal", "elements": 160, "modes": setting["modes"]},
            "solve.step": {"dt": setting["dt"]},
            "solve.duration": self.duration,
        }
        if self.upper is not None:
            changes["mechanisms.robot.links.1.axial_modes"] = setting["axial_modes"]
        return load_case(CASES / f"{self.name}.yaml").with_settings(changes)


ARMS = {
    arm.name: arm
    for arm in (
        Arm("two_link_arm", 0.8, 1.0, 1.0e9, 1.1e-2, (0.5, 0.5, math.pi / 3.0), 0.0, 8.0),
        Arm("arm_on_stop", 1.0, 0.1, 3.0e9, 1.5e-2, None, 0.5, 5.0),
    )
}
FINEST: dict[str, Setting] = {
    "impactlab": {"modes": 48, "axial_modes": 12, "dt": 5e-7},
    "exudyn": {"elements": 96, "dt": 1e-6, "tolerance": 1e-6, "radius": 1.0, "linear": "EigenSparse"},
}


def settings(program: str, arm: Arm) -> list[dict[str, Any]]:
    """Return the settings that a scan tries."""
    steps = (4e-6, 6e-6, 8e-6, 1e-5, 1.25e-5, 1.6e-5, 2e-5)
    if program == "impactlab":
        axial = (0, 1, 2, 4, 6) if arm.upper is not None else (0,)
        names = ("modes", "axial_modes", "dt")
        return [dict(zip(names, each, strict=True)) for each in product((8, 10, 12, 14, 16, 18, 20, 24), axial, steps)]
    found: list[dict[str, Any]] = []
    for n, dt, radius in product((14, 16, 18, 20, 22, 24, 28, 32, 40), steps, (1.0, 0.5)):
        shared = {"elements": n, "dt": dt, "radius": radius}
        found += [shared | {"tolerance": size, "linear": "EigenSparse"} for size in (1e-6, 1e-4, 1e-3)]
    dense = product((16, 20, 24), (8e-6, 1e-5, 1.25e-5))
    found += [{"elements": n, "dt": dt, "radius": 1.0, "tolerance": 1e-6, "linear": "EXUdense"} for n, dt in dense]
    return found


def build(program: str, arm: Arm, setting: Setting, record: bool) -> Run[list[float]]:
    """Return a run whose outcome is the impulses of its sub-impacts [N s]."""
    if program == "exudyn":
        return exudyn(arm, setting, record)
    return stepped(arm.case(setting).simulation(), of_contacts)


def of_contacts(history: AbstractHistory) -> list[float]:
    """Return the impulses of a history [N s]."""
    return [contact.impulse for contact in history.contacts]


def exudyn(arm: Arm, setting: Setting, record: bool) -> Run[list[float]]:
    """Return a run of Exudyn.

    Cable elements in absolute nodal coordinates, their strain integrated at fewer points (impulses within 1e-5); the
    hand is a point mass on the last node. The contact is `ObjectContactCoordinate` with exponent 1.5. A hinge to the
    ground is two fixed coordinates, one between links a joint; the torque is a load on the first element. With
    ``record`` a sensor stores the place of the hand at every step.
    """
    exu = engine()
    container = exu.SystemContainer()
    system = container.AddSystem()
    n = int(setting["elements"])
    length, mass, angle = arm.upper or (0.0, 0.0, 0.0)
    root = length * np.array([math.cos(angle), math.sin(angle)])
    turning = np.array([-root[1], root[0]])  # m/s, of the root at 1 rad/s
    area = WIDTH * HEIGHT
    nodes, elements = [], []
    for x in np.linspace(0.0, arm.length, n + 1):
        place, velocity = [root[0] + x, root[1], 1.0, 0.0], [turning[0], turning[1] + arm.rate * x, 0.0, arm.rate]
        node = _item("NodePoint2DSlope1", referenceCoordinates=place, initialVelocities=velocity)
        nodes.append(system.AddNode(node))
    for pair in pairwise(nodes):
        cable = _item(
            "ObjectANCFCable2D",
            length=arm.length / n,
            massPerLength=DENSITY * area,
            nodeNumbers=list(pair),
            bendingStiffness=YOUNG * area * HEIGHT**2 / 12.0,
            axialStiffness=YOUNG * area,
            useReducedOrderIntegration=1,
        )
        elements.append(system.AddObject(cable))
    system.AddObject(_item("ObjectMassPoint2D", mass=HAND, nodeNumber=nodes[-1]))
    ground = system.AddNode(_item("NodePointGround"))

    def coordinate(node: Any, number: int) -> Any:
        return system.AddMarker(_item("MarkerNodeCoordinate", nodeNumber=node, coordinate=number))

    def hinge_to_ground(node: Any) -> None:
        for number in (0, 1):
            pair = [coordinate(ground, 0), coordinate(node, number)]
            system.AddObject(_item("ObjectConnectorCoordinate", markerNumbers=pair))

    if arm.upper is None:
        hinge_to_ground(nodes[0])
    else:
        node = system.AddNode(
            _item("NodeRigidBody2D", referenceCoordinates=[0.0, 0.0, angle], initialVelocities=[0.0, 0.0, 1.0])
        )
        inertia, centre = mass * length**2 / 3.0, [0.5 * length, 0.0]
        body = system.AddObject(
            _item("ObjectRigidBody2D", mass=mass, inertia=inertia, centerOfMass=centre, nodeNumber=node)
        )
        hinge_to_ground(node)
        end = system.AddMarker(_item("MarkerBodyPosition", bodyNumber=body, localPosition=[length, 0.0, 0.0]))
        start = system.AddMarker(_item("MarkerNodePosition", nodeNumber=nodes[0]))
        system.AddObject(_item("ObjectJointRevolute2D", markerNumbers=[end, start]))
    if arm.torque:
        section = system.AddMarker(_item("MarkerBodyRigid", bodyNumber=elements[0], localPosition=[0.0, 0.0, 0.0]))
        system.AddLoad(_item("LoadTorqueVector", markerNumber=section, loadVector=[0.0, 0.0, arm.torque]))
    gap = system.AddNode(_item("NodeGenericData", initialCoordinates=[1.0], numberOfDataCoordinates=1))
    system.AddObject(
        _item(
            "ObjectContactCoordinate",
            markerNumbers=[coordinate(nodes[-1], 1), coordinate(ground, 0)],
            nodeNumber=gap,
            contactStiffness=arm.stiffness,
            contactStiffnessExponent=EXPONENT,
        )
    )
    quantity = exu.OutputVariableType.Displacement
    kept = {"nodeNumber": nodes[-1], "storeInternal": True, "outputVariableType": quantity}
    sensor = system.AddSensor(_item("SensorNode", **kept)) if record else None
    system.Assemble()
    steps = math.ceil(arm.duration / setting["dt"] - 1e-9)
    given, solver = _simulation(exu, arm, setting, steps), exu.MainSolverImplicitSecondOrder()

    def solve() -> None:
        if not solver.SolveSystem(system, given):
            raise ArithmeticError("Exudyn did not converge")

    def outcome() -> list[float]:
        overlap: Array = np.maximum(np.asarray(system.GetSensorStoredData(sensor))[:, 2], 0.0)
        touching = np.flatnonzero(overlap)
        spans = np.split(touching, np.flatnonzero(np.diff(touching) > 1) + 1)
        force = arm.stiffness * overlap**EXPONENT
        return [float(force[span].sum() * arm.duration / steps) for span in spans if span.size]

    return Run(solve, outcome)


def _simulation(exu: Any, arm: Arm, setting: Setting, steps: int) -> Any:
    """Return the settings of a run.

    The size of the last correction decides when Newton's method ends: residuals of joints do not fall below rounding.
    """
    given = exu.SimulationSettings()
    given.solution.file.write = False
    given.solution.sensors.writePeriod = 0.5 * arm.duration / steps
    given.linearSolver.solverType = getattr(exu.LinearSolverType, setting["linear"])
    given.linearSolver.reuseAnalyzedPattern = True
    time = given.timeIntegration
    time.endTime, time.numberOfSteps = arm.duration, steps
    time.verboseMode = 0
    time.automaticStepSize = time.adaptiveStep = False
    time.minimumStepSize = 1e-6 * arm.duration / steps
    time.discontinuous.useRecommendedStepSize = False
    time.generalizedAlpha.spectralRadius = setting["radius"]
    time.newton.useModifiedNewton = True
    time.newton.residualMode = 1
    time.newton.relativeTolerance, time.newton.absoluteTolerance = setting["tolerance"], 1e-10
    return given


def errors_of(impulses: list[float], true: list[float]) -> float:
    """Return the larger relative error of the first two impulses; infinity where there are fewer."""
    if len(impulses) < 2:
        return math.inf
    return max(abs(found / right - 1.0) for found, right in zip(impulses, true, strict=False))
