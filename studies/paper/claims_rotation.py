"""Claims of the introduction on bodies that turn steadily.

They are on waves, their meshes, and the first force of an impact.
"""

from __future__ import annotations

import math

import numpy as np

import impactlab as il
from impactlab import dispersion
from impactlab.bases.eigenvectors import Eigenvectors
from impactlab.bases.reduced import ReducedMesh
from impactlab.models.mesh.bar_elements import MassMatrix
from impactlab.models.mesh.bars import Mesh
from impactlab.models.mesh.beams import BeamMesh
from impactlab.scene import Beam, BeamSegment, End, Rod, Rotation
from studies.pages import CASES
from studies.paper.claims import CONFIRMED, REFUTED, REMARK, Finding, percent, row
from studies.paper.problem import SEGMENT, T, Z

RATE = 100.0  # rad/s, 955 turns a minute
LONGEST = math.pi / (2.0 * SEGMENT.length)  # 1/m, wave number of the first mode of the rod, clamped at the axis
BEAM = BeamSegment(1.0, 1e-4, 2.1e11, 7850.0, inertia=0.02 * 0.005**3 / 12.0)  # steel, 20 mm x 5 mm
WAVE = 2.0 * math.pi / 0.2  # 1/m, of a wave of 0.2 m on it
CLAMPED, FREE = End("clamped"), End("free")


def turning_rod(rate: float, elements: int) -> il.history.AbstractHistory:
    """Return the run of the case of a rod that turns.

    It turns at a rate [rad/s], on a lumped mesh with c dt = h.
    """
    case = il.load_case(CASES / "rotating_rod.yaml")
    return il.run(case.with_settings({"bodies.rod.rotation.rate": rate, "solve.model.elements": elements}))


@row(
    "1",
    "p. 767, of Gau and Shabana [2]",
    "The angular velocity is the only source of dispersion of the axial elastic waves.",
    "-",
    REMARK,
)
def rotation_alone_disperses() -> Finding:
    speed = SEGMENT.wave_speed
    still, turned = (float(dispersion.guided_rod(speed, rate).phase_speed(LONGEST)) / speed for rate in (0.0, RATE))
    tenth, lateral = 19.0 * LONGEST, 0.3 * math.sqrt(SEGMENT.area / (2.0 * math.pi))
    love = 1.0 - 1.0 / math.sqrt(1.0 + (lateral * tenth) ** 2)
    mesh = (tenth * SEGMENT.length / 100.0) ** 2 / 24.0
    return Finding(
        "in the theory of rods it is: $\\omega^2 = c^2k^2 - \\Omega^2$ for a guided rod, at rest none. It is the "
        "smallest one "
        f"in practice: at {RATE:g} rad/s the longest wave of the paper's rod is {percent(1.0 - turned)} slower, while "
        f"the lateral inertia of a round section ($\\nu = 0.3$) slows its tenth mode by {percent(love)}, and 100 "
        f"elements "
        f"by {percent(mesh)}. A rod that is free to bend has the other sign, phase speeds above $c$ "
        "([page](../rotation.md))",
        {"still": still - 1.0, "turned": 1.0 - turned, "lateral": love, "mesh": mesh},
        abs(still - 1.0) < 1e-15 and 6e-6 < 1.0 - turned < 8e-6 < 1e-3 * love,
    )


@row(
    "1",
    "p. 766, of Hsu and Shabana [4]",
    "The discrepancy between the wave velocity in the static and rotating cases increases as the angular velocity "
    "increases.",
    "-",
    CONFIRMED,
)
def grows_with_the_rate() -> Finding:
    def apart(plane: str, rate: float) -> float:
        if plane == "rod":
            waves, number = dispersion.guided_rod(SEGMENT.wave_speed, rate), LONGEST
            return abs(float(waves.phase_speed(number)) / SEGMENT.wave_speed - 1.0)
        beam = Beam("beam", (BEAM,), CLAMPED, FREE, rotation=Rotation(rate, 0.0, plane))  # type: ignore[arg-type]
        middle = float(beam.steady_beam(Rotation(rate)).tension(np.array([0.5]))[0])
        seen = dispersion.beam(BEAM, rate, plane, middle).phase_speed(WAVE)  # type: ignore[arg-type]
        return abs(float(seen / dispersion.beam(BEAM, 0.0, "flap").phase_speed(WAVE)) - 1.0)

    ratios = {plane: apart(plane, 20.0) / apart(plane, 10.0) for plane in ("rod", "flap", "chord")}
    sizes = {f"at_60_{plane}": apart(plane, 60.0) for plane in ratios}
    return Finding(
        "as $\\Omega^2$: twice the rate gives "
        + ", ".join(f"{value:.3f}" for value in ratios.values())
        + " times the discrepancy (guided rod; beam of steel, 1 m x 20 mm x 5 mm, in the flap and in the chord plane, "
        f"waves of 0.2 m in its middle). At 60 rad/s it is {percent(sizes['at_60_rod'])}, "
        f"{percent(sizes['at_60_flap'])} and {percent(sizes['at_60_chord'])}: bending waves are faster, as the tension "
        "stiffens the beam",
        ratios | sizes,
        all(3.9 < value < 4.1 for value in ratios.values()),
    )


def stiffened(elements: int, mass: MassMatrix) -> np.ndarray:
    """Return the rise of a beam mesh's frequencies by rotation [rad/s], (20,).

    It turns at 60 rad/s, in the chord plane.
    """
    found = []
    for rotation in (None, Rotation(60.0, 0.0, "chord")):
        mesh = BeamMesh(Beam("beam", (BEAM,), CLAMPED, FREE, rotation=rotation), elements, mass, 0.0)
        found.append(ReducedMesh(mesh, Eigenvectors().span(mesh, 20, ()).shapes, True).frequencies)
    return np.asarray(found[1] - found[0])


@row(
    "1",
    "p. 766, of Hsu and Shabana [4]",
    "The finite element wave velocity shows such a dispersion too, but a smaller value of it than the Fourier method.",
    "-",
    REMARK,
)
def elements_show_less() -> Finding:
    elements, rate = 20, 0.3 * SEGMENT.wave_speed / SEGMENT.length
    modes = np.arange(1, elements + 1)
    exact = (2 * modes - 1) * LONGEST * SEGMENT.wave_speed

    def shares(mass: MassMatrix) -> np.ndarray:
        """Return the discrepancy of each mesh mode over the rod's.

        The discrepancy is w0 - w.
        """
        found = []
        for rotation in (None, Rotation(rate)):
            mesh = Mesh(Rod("rod", (SEGMENT,), CLAMPED, FREE, rotation=rotation), elements, mass, 0.0)
            found.append(ReducedMesh(mesh, Eigenvectors().span(mesh, elements, ()).shapes, True).frequencies)
        return np.asarray((found[0] - found[1]) / (exact - np.sqrt(exact**2 - rate**2)))

    consistent, lumped = shares("consistent"), shares("lumped")
    beam, light = (stiffened(elements, mass) / stiffened(400, "consistent") for mass in ("consistent", "lumped"))
    return Finding(
        "of axial waves it is a matter of the mass matrix: $\\Omega^2\\mathbf M$ shifts $\\omega^2$ of each mode of "
        "a mesh by the very "
        "$\\Omega^2$ of the rod, so its frequency by $\\Omega^2/(2\\omega)$. A consistent mass makes $\\omega$ too "
        "large and the "
        f"dispersion too small, mode by mode: {consistent[0]:.4f}, {consistent[9]:.3f}, {consistent[19]:.3f} of the "
        f"exact one (modes 1, 10, 20 of 20 elements). A lumped mass does the reverse: {lumped[0]:.4f}, "
        f"{lumped[9]:.3f}, {lumped[19]:.3f}. In bending, where the tension stiffens short waves, both show less: modes "
        f"1, 10, 15 of a beam of 20 elements in the chord plane {beam[0]:.4f}, {beam[9]:.4f}, {beam[14]:.3f} with a "
        f"consistent mass and {light[0]:.3f}, {light[9]:.3f}, {light[14]:.3f} with a lumped one; at the upper end of "
        f"its spectrum the consistent one shows more ({beam[19]:.3f}, mode 20)",
        {
            "consistent_10": float(consistent[9]), "consistent_20": float(consistent[19]),
            "lumped_10": float(lumped[9]), "lumped_20": float(lumped[19]), "beam_10": float(beam[9]),
            "beam_15": float(beam[14]), "beam_20": float(beam[19]), "beam_lumped_10": float(light[9]),
        },
        bool(np.all(consistent < 1.0) and np.all(lumped > 1.0) and np.all(light < 1.0) and np.all(beam[2:18] < 1.0)),
    )  # fmt: skip


@row(
    "1",
    "p. 766, of Shao and others [10]",
    "The wave velocity that gives the contact pressure at first contact depends on the rotation of the solid.",
    "-",
    REFUTED,
)
def first_force_depends() -> Finding:
    forces, arrivals = [], []
    for rate in (0.0, RATE):
        history = turning_rod(rate, 1000)
        forces.append(float(history.evaluate([history.dt or 0.0], "force:rod.right|hammer")[0]) / Z)
        t = (np.arange(1, 2001) + 0.5) * (history.dt or 0.0)
        moved = np.abs(history.evaluate(t, "stress:rod@0")) > 0.0
        arrivals.append(float(t[np.argmax(moved)]) / T)
    return Finding(
        "phase and group speeds do, the front does not: it runs at $c$ and brings $Z v_0$ at every rate. The front "
        "reaches "
        f"the clamped end after {arrivals[0]:.4f} T at rest and {arrivals[1]:.4f} T at {RATE:g} rad/s, and after one "
        f"step the force is {forces[0]:.4f} and {forces[1]:.4f} $Z v_0$ (1000 lumped elements)",
        {"force": forces[1] / forces[0] - 1.0, "arrival": arrivals[1] - arrivals[0]},
        abs(forces[1] / forces[0] - 1.0) < 2e-4 and abs(arrivals[1] - arrivals[0]) < 1e-9,
    )


@row(
    "1",
    "p. 766",
    "That wave velocity is similar enough to the one in structural systems in most practical considerations.",
    "-",
    REMARK,
    "impactlab run cases/rotating_rod.yaml",
)
def similar_enough() -> Finding:
    slower = 1.0 - float(dispersion.guided_rod(SEGMENT.wave_speed, RATE).phase_speed(LONGEST)) / SEGMENT.wave_speed
    still, turned = (turning_rod(rate, 1000) for rate in (0.0, RATE))
    first = [history.contacts[0].end or math.nan for history in (still, turned)]
    again = [history.contacts[1].impulse / history.contacts[0].impulse for history in (still, turned)]
    gained = RATE**2 * SEGMENT.length * T
    return Finding(
        f"of the wave speed it is true: {percent(slower)} at {RATE:g} rad/s. Of the impact it is not: the centrifugal "
        f"force gives a striker at the tip {gained:.2f} v0 in a round trip, the first contact ends at "
        f"{first[1] / T:.3f} T instead of {first[0] / T:.3f} T, and the second one gives {again[1]:.2f} of the impulse "
        f"of the first instead of {again[0]:.3f}",
        {"slower": slower, "gained": gained, "first_still": first[0] / T, "first_turned": first[1] / T},
        slower < 1e-5 and gained > 0.3 and abs(first[1] / T - 0.953207) < 1e-5,
    )
