"""Faces pressed together at t = 0: schemes of second order start under the contact force, and stay of second order."""

import itertools
import math

import numpy as np
import pytest

import impactlab as il
from tests.solving import in_steps, mesh

MASS, STIFFNESS, OVERLAP = 1e-3, 1e6, 1e-5  # kg, N/m, m
OMEGA = math.sqrt(STIFFNESS / MASS)
END = 1.2 / OMEGA  # before the mass leaves, at pi/2


def pressed(integrator, dt, law=None, beads=1):
    """Return a run of masses in a row that a wall on the right presses by an overlap; they start at rest."""
    names = [*(f"bead_{i}" for i in range(1, beads + 1)), "wall"]
    law = law or {"kind": "penalty", "stiffness": STIFFNESS}
    case = il.Case(
        bodies={name: il.Wall() if name == "wall" else il.Mass(MASS) for name in names},
        contacts=[il.Contact(*pair, law, gap=-OVERLAP, overlap="allowed") for pair in itertools.pairwise(names)],
        solve={"duration": END, "integrator": {"kind": integrator}, "step": {"dt": dt}},
    )
    return il.run(case)


@pytest.mark.parametrize("integrator", ["central_difference", "generalised_alpha", "newmark"])
def test_the_error_of_a_pressed_mass_falls_as_the_square_of_the_step(integrator):
    exact = -OVERLAP * (1.0 - math.cos(OMEGA * END))  # k x of a spring that begins compressed by the overlap
    coarse, fine = (
        abs(pressed(integrator, END / steps).evaluate([END], "position:bead_1")[0] / exact - 1.0) for steps in (40, 80)
    )
    assert coarse < (1.2 / 40) ** 2  # (w dt)^2; the start without the force had w dt/1.8
    assert fine < coarse / 3.5


@pytest.mark.parametrize("beads", [1, 6])
def test_leapfrog_keeps_the_energy_of_a_pressed_row(beads):
    history = pressed("central_difference", END / 200, beads=beads)
    stored = beads * 0.5 * STIFFNESS * OVERLAP**2
    assert history.energy.total[0] == pytest.approx(stored, rel=(1.2 / 200) ** 2)
    # Linear springs between closed faces: leapfrog keeps its energy to rounding.
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def test_a_row_of_beads_starts_as_its_contacts_one_by_one_do():
    """Beads of a law without damping step as a row; a dashpot that gives next to nothing makes them single contacts."""
    row = pressed("central_difference", END / 50, beads=5)
    single = pressed("central_difference", END / 50, {"kind": "penalty", "stiffness": STIFFNESS, "damping": 1e-9}, 5)
    times = np.linspace(0.0, END, 51)
    for i in range(1, 6):
        one, other = (history.evaluate(times, f"position:bead_{i}") for history in (row, single))
        assert one == pytest.approx(other, abs=1e-9 * OVERLAP)


def test_a_precompressed_hertzian_chain_in_balance_rests():
    """Between two walls all forces are equal: no bead moves, whatever the masses."""
    n = 12
    gap = -2e-6
    masses = 1e-3 * 0.8 ** np.arange(n)
    names = ["left", *(f"bead_{i}" for i in range(n)), "right"]
    bodies = {"left": il.Wall(), **{f"bead_{i}": il.Mass(float(m)) for i, m in enumerate(masses)}, "right": il.Wall()}
    law = {"kind": "hertz", "stiffness": 1e9}
    case = il.Case(
        bodies=bodies,
        contacts=[il.Contact(*pair, law, gap=gap, overlap="allowed") for pair in itertools.pairwise(names)],
        solve={"duration": 1e-4, "integrator": {"kind": "central_difference"}, "step": {"dt": 1e-7}},
    )
    history = il.run(case)
    moved = [abs(history.evaluate([1e-4], f"position:bead_{i}")[0]) for i in range(n)]
    assert max(moved) < 1e-12 * abs(gap)


def test_the_velocity_at_the_start_is_that_of_the_case():
    history = pressed("central_difference", END / 40)
    assert history.evaluate([0.0], "velocity:bead_1")[0] == pytest.approx(0.0, abs=1e-6 * OVERLAP * OMEGA)


SPEED, SOIL = 0.1, {"kind": "smith", "capacity": 100.0, "quake": 1e-4}  # m/s; 1e6 N/m
DECAY = 0.1 * 100.0 / (2.0 * MASS)  # 1/s, of the dashpot J Ru beside it
RINGING = math.sqrt(OMEGA**2 - DECAY**2)


@pytest.mark.parametrize("integrator", ["central_difference", "generalised_alpha", "newmark"])
@pytest.mark.parametrize(
    ("law", "gap", "speed", "exact"),
    [
        # It unloads along k/e^2 = 4 k, from a force k times the overlap.
        (
            {"kind": "bilinear", "stiffness": STIFFNESS, "restitution": 0.5},
            -OVERLAP,
            0.0,
            lambda t: -0.25 * OVERLAP * (1.0 - math.cos(2.0 * OMEGA * t)),
        ),
        ({**SOIL, "set": OVERLAP}, 0.0, 0.0, lambda t: OVERLAP * (1.0 - math.cos(OMEGA * t))),
        (
            {**SOIL, "damping": 0.1, "rule": "viscous"},
            0.0,
            SPEED,
            lambda t: SPEED * math.exp(-DECAY * t) * math.sin(RINGING * t) / RINGING,
        ),
    ],
)
def test_laws_that_remember_act_from_the_start(integrator, law, gap, speed, exact):
    """A cushion under preload, soil with a set, a dashpot that moves: they began without their force, 2 % off here."""
    end = 0.7 / OMEGA
    contact = il.Contact("mass", "wall", law, **({"gap": gap, "overlap": "allowed"} if gap else {}))
    errors = []
    for steps in (40, 80):
        solve = {"duration": end, "integrator": {"kind": integrator}, "step": {"dt": end / steps}}
        bodies = {"mass": il.Mass(MASS, velocity=speed), "wall": il.Wall()}
        history = il.run(il.Case(bodies=bodies, contacts=[contact], solve=solve))
        errors.append(abs(history.evaluate([end], "position:mass")[0] / exact(end) - 1.0))
    assert errors[0] < (0.7 / 40) ** 2  # (w dt)^2
    assert errors[1] < errors[0] / 3.5


@pytest.mark.parametrize("integrator", ["central_difference", "generalised_alpha", "newmark"])
@pytest.mark.parametrize("stretch", [1e-5, -1e-5])
def test_a_joint_acts_from_the_start_on_a_rod_that_is_displaced(integrator, stretch):
    """One bar of lumped mass, displaced as a whole, between a wall and nothing: two masses and two springs."""
    length, area, young, density = 1.0, 1e-4, 2e11, 8000.0
    bar, mass = young * area / length, 0.5 * density * area * length
    stiffness = np.array([[bar + STIFFNESS, -bar], [-bar, bar]]) / mass
    squared, shapes = np.linalg.eigh(stiffness)
    end = 1.0 / math.sqrt(squared[1])
    exact = shapes @ (np.cos(np.sqrt(squared) * end) * (shapes.T @ np.full(2, stretch)))
    errors = []
    for steps in (40, 80):
        case = il.Case(
            bodies={
                "wall": il.Wall(),
                "rod": il.Rod(
                    length=length,
                    area=area,
                    material={"young": young, "density": density},
                    displacement=f"{stretch!r} + 0*x",
                ),
            },
            contacts=[il.Contact("wall", "rod.left", {"kind": "slack", "stiffness": STIFFNESS})],
            probes=[{"body": "rod", "at": 0.0, "quantity": "displacement"}],
            solve=in_steps(end, integrator, mesh(1, "lumped"), dt=end / steps),
        )
        moved = il.run(case).evaluate([end], "displacement:rod@0")[0] - stretch
        errors.append(abs(moved / (exact[0] - stretch) - 1.0))
    assert errors[0] < (1.0 / 40) ** 2
    assert errors[1] < errors[0] / 3.5


@pytest.mark.parametrize("model", [{"kind": "continuous"}, {"kind": "finite_element", "elements": 40}])
@pytest.mark.parametrize("kind", ["addition_deletion", "penalty"])
def test_a_face_at_a_zero_of_its_displacement_touches(kind, model):
    """The zero of sin(pi) is 1e-16: no overlap, and the run is that of faces which are apart by as little."""

    def force(gap):
        rod = il.Rod(length=0.12, area=1e-4, material="steel", displacement="1e-6*sin(pi*x/L)")
        law = {"kind": kind, **({"stiffness": 1e8} if kind == "penalty" else {})}
        case = il.Case(
            bodies={"rod": rod, "wall": il.Wall()},
            contacts=[il.Contact("rod.right", "wall", law, gap=gap)],
            solve={"duration": 2e-5, "model": model},
        )
        return il.run(case).evaluate(np.linspace(0.0, 2e-5, 50), "force:rod.right|wall")

    touching, apart = force(0.0), force(1e-19)
    assert apart.max() > 10.0
    assert touching == pytest.approx(apart, abs=1e-6 * apart.max())
