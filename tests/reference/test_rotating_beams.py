"""Beams that turn: frequencies against power series, an ordinary differential equation and the literature; impacts."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Literal

import mpmath as mp
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from impactlab.bases.eigenvectors import Eigenvectors
from impactlab.bases.reduced import ReducedMesh
from impactlab.contact.power_law import Hertz
from impactlab.history import AbstractHistory
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.beams import BeamMesh
from impactlab.models.modal import Modal
from impactlab.scene.bodies import Beam, BeamSegment, End, Mass, Rotation
from impactlab.scene.method import StepRule
from impactlab.scene.problem import Contact, Point
from impactlab.simulate import run
from impactlab.testing.scenes import simulation

Plane = Literal["chord", "flap"]
CLAMPED, FREE = End("clamped"), End("free")
STEEL = BeamSegment(1.0, 1e-4, 2.1e11, 7850.0, inertia=0.02 * 0.005**3 / 12.0)
LINE, EI = 0.785, STEEL.bending_stiffness
SHEARED = replace(STEEL, inertia=3e-7, shear_stiffness=0.85 * 8e10 * 1e-4, rotary_inertia=7850.0 * 3e-7)


def turning(
    segment: BeamSegment, rate: float, plane: Plane, left: End = CLAMPED, right: End = FREE, axis: float = 0.0
) -> Beam:
    theory = "euler_bernoulli" if segment.rotary_inertia == 0.0 else "timoshenko"
    return Beam("beam", (segment,), left, right, theory=theory, rotation=Rotation(rate, axis, plane))


def frequencies(beam: Beam, elements: int = 160, count: int = 3, mass: Any = "consistent") -> np.ndarray:
    mesh = BeamMesh(beam, elements, mass, 0.0)
    return ReducedMesh(mesh, Eigenvectors().span(mesh, count, ()).shapes, True).frequencies


def by_power_series(gamma: float, guess: float) -> float:
    """Return the flap frequency of a cantilever in sqrt(EI/(rho A L^4)), at gamma = Omega sqrt(rho A L^4/EI).

    w = sum a_k x^k solves w'''' = (gamma^2/2) ((1 - x^2) w')' + lambda^2 w; two series begin with x^2 and x^3, and
    curvature and its slope are zero at the tip.
    """
    with mp.workdps(40):

        def fault(lam: Any) -> Any:
            ends = []
            for first in (2, 3):
                a = [mp.mpf(0)] * 124
                a[first] = mp.mpf(1)
                for k in range(120):
                    pulled = mp.mpf(gamma) ** 2 / 2 * ((k + 2) * (k + 1) * a[k + 2] - k * (k + 1) * a[k])
                    a[k + 4] = (pulled + lam**2 * a[k]) / ((k + 1) * (k + 2) * (k + 3) * (k + 4))
                ends.append(
                    (
                        sum(k * (k - 1) * v for k, v in enumerate(a)),
                        sum(k * (k - 1) * (k - 2) * v for k, v in enumerate(a)),
                    )
                )
            return ends[0][0] * ends[1][1] - ends[0][1] * ends[1][0]

        return float(mp.findroot(fault, (guess * 0.999, guess * 1.001), solver="anderson"))


TABLE = [
    (2.0, (4.1373, 22.6149, 62.2732), 5e-5),
    (6.0, (7.360, 26.809, 66.684), 5e-4),
    (12.0, (13.1702, 37.6031, 79.6145), 5e-5),
]


@pytest.mark.parametrize(("gamma", "table", "digits"), TABLE)
def test_cantilevers_have_the_tabulated_frequencies(gamma: float, table: tuple[float, ...], digits: float) -> None:
    """WrightSmithThresherWang1982, whose method of Frobenius is repeated here; the mesh agrees with it to 1e-7."""
    unit = math.sqrt(EI / LINE)
    found = frequencies(turning(STEEL, gamma * unit, "flap")) / unit
    series = [by_power_series(gamma, value) for value in table]
    assert_allclose(series, table, atol=digits)
    assert_allclose(found, series, rtol=1e-7)


def test_flap_and_chord_of_a_steel_cantilever() -> None:
    flap, chord = (frequencies(turning(STEEL, 60.0, plane)) / (2.0 * math.pi) for plane in ("flap", "chord"))
    assert_allclose(flap, (11.041035, 35.715161, 83.607532), rtol=1e-7)
    assert_allclose(chord, (5.542147, 34.414876, 83.060402), rtol=1e-7)
    assert_allclose(flap**2 - chord**2, (60.0 / (2.0 * math.pi)) ** 2, rtol=1e-6)


@pytest.mark.parametrize("elements", [40, 400])
def test_fine_meshes_keep_the_first_frequency(elements: int) -> None:
    """The eigenvalues of 400 elements are rounded to 1e-4; sums of squares are not."""
    first = frequencies(turning(STEEL, 60.0, "flap"), elements, 1)[0] / (2.0 * math.pi)
    assert first == pytest.approx(11.041035, rel=1e-7)


def test_meshes_converge_at_order_four() -> None:
    unit = math.sqrt(EI / LINE)
    exact = by_power_series(12.0, 37.6031)
    errors = [frequencies(turning(STEEL, 12.0 * unit, "flap"), n)[1] / unit / exact - 1.0 for n in (8, 16)]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.25)


def by_integration(beam: Beam, guess: float) -> float:
    """Return the frequency [rad/s] of a Timoshenko cantilever that turns, near a guess, by integration from the root.

    V = kGA (w' - theta) + N w', V' = -rho A (w^2 + Omega^2 of the chord) w; B = EI theta', B' = -kGA (w' - theta) -
    rho I (w^2 + Omega^2 of the flap) theta.
    """
    rotation, piece, tip = beam.rotation, beam.segments[0], beam.right.value
    moved, turned = (rotation.squared, 0.0) if rotation.plane == "chord" else (0.0, rotation.squared)
    line, shear = piece.density * piece.area, piece.shear_stiffness

    def fault(frequency: float) -> float:
        def rates(x: float, y: np.ndarray) -> np.ndarray:
            w, theta, bent, force = y
            pull = rotation.squared * (
                line * 0.5 * ((1.0 - rotation.axis_at) ** 2 - (x - rotation.axis_at) ** 2)
                + tip * (1.0 - rotation.axis_at)
            )
            slope = (force + shear * theta) / (shear + pull)
            inertia = piece.rotary_inertia * (frequency**2 + turned)
            return np.array(
                [
                    slope,
                    bent / piece.bending_stiffness,
                    -shear * (slope - theta) - inertia * theta,
                    -line * (frequency**2 + moved) * w,
                ]
            )

        ends = [
            solve_ivp(rates, (0.0, 1.0), start, rtol=1e-11, atol=1e-14).y[:, -1]
            for start in ([0, 0, 1.0, 0], [0, 0, 0, 1.0])
        ]
        (b1, v1), (b2, v2) = ((y[2], y[3] - tip * (frequency**2 + moved) * y[0]) for y in ends)
        return float(b1 * v2 - b2 * v1)

    return float(brentq(fault, 0.99 * guess, 1.01 * guess, rtol=1e-10))


@pytest.mark.parametrize("plane", ["chord", "flap"])
@pytest.mark.parametrize(("axis", "tip"), [(0.0, 0.0), (-0.3, 0.5)])
def test_a_sheared_beam_with_hub_and_tip_mass_satisfies_its_equations(plane: Plane, axis: float, tip: float) -> None:
    """Rotary inertia softens in the flap plane alone: there the fibres of a section move along the radius."""
    beam = turning(SHEARED, 500.0, plane, right=End("mass", tip) if tip else FREE, axis=axis)
    found = frequencies(beam, 400, 2)
    for number in range(2):
        assert found[number] == pytest.approx(by_integration(beam, found[number]), rel=2e-5)


def test_a_mirrored_beam_has_the_same_frequencies() -> None:
    here = frequencies(turning(STEEL, 60.0, "chord", right=End("mass", 0.2), axis=-0.1))
    there = frequencies(turning(STEEL, 60.0, "chord", End("mass", 0.2), CLAMPED, 1.1))
    assert_allclose(there, here, rtol=1e-9)


# --- impacts


def struck(
    rate: float, plane: Plane, model: Any, integrator: Any, dt: float, duration: float = 0.02
) -> AbstractHistory:
    """A sphere strikes a cantilever at three quarters of its length, from below."""
    beam = turning(STEEL, rate, plane) if rate else Beam("beam", (STEEL,), CLAMPED, FREE)
    sphere = Mass("sphere", 0.2, 1.0, rotation=Rotation(rate, 0.0, plane) if rate else None)
    contact = Contact(Point("sphere", 0.0, "sphere"), Point("beam", 0.75, "beam.at(0.75)"), 0.0)
    made = simulation(
        "sphere", {"beam": beam, "sphere": sphere}, (contact,), duration, integrator, StepRule(dt=dt), model=model,
        law=Hertz(1e8), round_trip=beam.round_trip,
    )  # fmt: skip
    return run(*made)


@pytest.mark.parametrize(
    ("rate", "plane", "first", "second", "leaves"),
    [
        (0.0, "flap", (948.171, 289.918, 0.131920), (3729.17, 4609.82, 110.839, 0.040414), 0.138326),
        (60.0, "flap", (956.411, 290.334, 0.132729), (3387.10, 4286.77, 133.218, 0.054098), 0.065869),
        (60.0, "chord", (956.726, 290.366, 0.132767), (3377.05, 4285.08, 133.662, 0.054755), 0.219646),
    ],
)
def test_a_sphere_on_a_beam_that_turns(
    rate: float, plane: Plane, first: tuple[float, ...], second: tuple[float, ...], leaves: float
) -> None:
    """Times in us, forces in N, impulses in N s: flap and chord differ little in the impact and much afterwards.

    In the chord plane the centrifugal force drives the sphere away from the line to the axis all along.
    """
    history = struck(rate, plane, Modal(elements=160, modes=36), ExactModal(), 2e-7)
    one, other = history.contacts
    assert_allclose((one.end * 1e6, one.peak_force, one.impulse), first, rtol=5e-5)
    assert_allclose((other.start * 1e6, other.end * 1e6, other.peak_force, other.impulse), second, rtol=5e-5)
    assert history.evaluate([0.02], "velocity:sphere")[0] == pytest.approx(leaves, rel=5e-5)
    assert history.energy.largest_gain < 1e-9


@pytest.mark.parametrize("plane", ["chord", "flap"])
def test_meshes_and_modes_agree_on_a_beam_that_turns(plane: Plane) -> None:
    """Explicit and implicit steps of a mesh, and its modes; energy stays within each scheme's bound."""
    modes = struck(60.0, plane, Modal(elements=80, modes=78), ExactModal(), 1e-6, 2e-3)
    implicit = struck(60.0, plane, FiniteElement(80), Midpoint(), 1e-6, 2e-3)
    explicit = struck(60.0, plane, FiniteElement(80, "lumped"), CentralDifference(), 1e-6, 2e-3)
    wanted = modes.contacts[0].impulse
    assert implicit.contacts[0].impulse == pytest.approx(wanted, rel=1e-3)
    assert explicit.contacts[0].impulse == pytest.approx(wanted, rel=2e-3)
    for history in (modes, implicit, explicit):
        assert history.energy.largest_gain < 1e-6
        assert history.energy.final_error < 1e-5
