"""Rows of hard masses with a restitution: several that collide in one step gain no energy, pairs collide exactly."""

import itertools

import numpy as np
import pytest

import impactlab as il

END = 4e-4  # s
LAWS = ["impulse_momentum", "velocity_complementarity"]


def row(masses, velocities, gaps, law, dt, integrator="central_difference"):
    """Return a run of masses along a line."""
    names = [f"m{i}" for i in range(len(masses))]
    bodies = {name: il.Mass(float(m), velocity=float(v)) for name, m, v in zip(names, masses, velocities, strict=True)}
    laws = law if isinstance(law, list) else [law] * len(gaps)
    contacts = [il.Contact(names[i], names[i + 1], laws[i], gap=float(gap)) for i, gap in enumerate(gaps)]
    solve = {"duration": END, "integrator": {"kind": integrator}, "step": {"dt": dt}}
    return il.run(il.Case(bodies=bodies, contacts=contacts, solve=solve))


def drawn(seed):
    """Return masses over three decades, speeds and small gaps, so that many collide in one step."""
    random = np.random.default_rng(seed)
    n = int(random.integers(3, 15))
    return 10.0 ** random.uniform(-4.5, -1.5, n), random.uniform(-1.0, 1.0, n), random.uniform(0.0, 1e-5, n - 1)


@pytest.mark.parametrize("restitution", [0.6, 1.0])
@pytest.mark.parametrize("kind", LAWS)
@pytest.mark.parametrize("integrator", ["central_difference", "newmark", "moreau_jean"])
def test_masses_that_collide_together_gain_no_energy(kind, restitution, integrator):
    """With one e, Moreau's rule loses (1 - e)/2 times the sum of P (approach before): no gain, nothing for e = 1."""
    for seed in range(4):
        history = row(*drawn(seed), {"kind": kind, "restitution": restitution}, 1e-6, integrator)
        book = history.energy
        kinetic = sum(book.bodies.values())
        assert np.diff(kinetic).max() <= 1e-11 * kinetic[0]  # of thousands of collisions, each to rounding
        assert max(book.largest_gain, book.largest_loss) < 1e-10  # the booked loss is the energy lost
        if restitution == 1.0:
            assert kinetic[-1] == pytest.approx(kinetic[0], rel=1e-10)


@pytest.mark.parametrize("kind", LAWS)
def test_a_gain_of_unequal_restitutions_is_not_booked_as_a_loss(kind):
    """The middle one of three masses that touch, of 1, 1/2 and 1 kg, flies from the left one into the right one.

    The right pair has e = 1, the left pair, which parts at 1 m/s, e = 0: its rate may not be negative afterwards. So
    0 = 1 + 3 P1 - 2 P2 and 1 = -1 - 2 P1 + 3 P2, P1 = 0.2 and P2 = 0.8 N s: -0.2, -0.2 and 0.8 m/s, 0.35 J for 0.25 J.
    In the frame of the centre of mass the energy was 0.2 J: half of it is gained.
    """
    laws = [{"kind": kind, "restitution": restitution} for restitution in (0.0, 1.0)]
    try:
        book = row((1.0, 0.5, 1.0), (0.0, 1.0, 0.0), (0.0, 0.0), laws, 1e-6).energy
    except il.StepError as failed:  # where the law declares less
        book = failed.history.energy
    assert sum(book.bodies.values())[-1] == pytest.approx(0.35, rel=1e-9)
    assert book.largest_gain == pytest.approx(0.5, rel=1e-9)
    assert np.diff(book.booked["contact"]).min() >= 0.0
    assert book.booked["contact"][-1] < 1e-15  # J: roundings of the left pair, which stays together


def one_by_one(masses, velocities, gaps, restitution):
    """Return the displacements at the end, from collision to collision of two masses."""
    start = np.concatenate(([0.0], np.cumsum(gaps)))
    x, v, left = start.copy(), np.array(velocities), END
    while True:
        gap, closing = np.maximum(np.diff(x), 0.0), -np.diff(v)
        wait = np.where(closing > 1e-14, gap / np.maximum(closing, 1e-14), np.inf)
        which = int(wait.argmin())
        if wait[which] > left:
            return x + v * left - start
        x, left = x + v * wait[which], left - wait[which]
        impulse = (1.0 + restitution) * closing[which] / (1.0 / masses[which] + 1.0 / masses[which + 1])
        v[which] -= impulse / masses[which]
        v[which + 1] += impulse / masses[which + 1]


@pytest.mark.parametrize("kind", LAWS)
@pytest.mark.parametrize("restitution", [0.9, 1.0])
def test_collisions_one_by_one_are_those_of_pairs(kind, restitution):
    """A step shifts a collision by a step at most: the error falls with it."""
    random = np.random.default_rng(5)
    masses = 10.0 ** random.uniform(-3.3, -2.7, 6)
    velocities, gaps = np.sort(random.uniform(-1.0, 1.0, 6))[::-1], random.uniform(5e-6, 5e-5, 5)
    exact = one_by_one(masses, velocities, gaps, restitution)
    errors = []
    for dt in (2e-7, 2e-8):
        history = row(masses, velocities, gaps, {"kind": kind, "restitution": restitution}, dt)
        found = np.array([history.evaluate([END], f"position:m{i}")[0] for i in range(6)])
        errors.append(np.abs(found - exact).max() / np.abs(exact).max())
    assert errors[0] < 0.05
    assert errors[1] < 0.2 * errors[0]


@pytest.mark.parametrize(
    ("masses", "velocities"),
    [
        ((22.5, 0.0856, 22.2, 0.273), (0.4, -0.5, 0.6, 0.4)),
        ((8.86, 0.341, 0.0431, 1.64, 0.0868), (0.5, 0.8, -1.4, 1.0, -0.6)),
        ((30.0, 0.123, 1.04, 0.126), (1.1, 1.4, 0.2, 1.2)),
    ],
)
def test_a_row_that_comes_to_rest_on_a_wall_stays_there(masses, velocities):
    """Once all faces rest, the rates that are left are rounding, and so are the impulses that would stop them.

    In every step, or in every second one, the wall gives the impulse of the weight.
    """
    names = [f"m{i}" for i in range(len(masses))]
    bodies = {name: il.Mass(m, velocity=v) for name, m, v in zip(names, masses, velocities, strict=True)}
    faces = [*names, "wall"]
    law = {"kind": "impulse_momentum", "restitution": 0.0}
    contacts = [il.Contact(left, right, law, gap=1e-3) for left, right in itertools.pairwise(faces)]
    solve = {"duration": 0.3, "integrator": {"kind": "central_difference"}, "step": {"dt": 1e-3}}
    history = il.run(il.Case(bodies=bodies | {"wall": il.Wall()}, contacts=contacts, gravity=9.81, solve=solve))
    given = sum(span.impulse for span in history.contacts if span.contact == f"{names[-1]}|wall")
    momentum = sum(m * v for m, v in zip(masses, velocities, strict=True)) + sum(masses) * 9.81 * 0.3
    assert given == pytest.approx(momentum, abs=sum(masses) * 9.81 * 1e-3)
    for name in names:
        assert abs(history.recorded[f"velocity:{name}"].values[-1]) < 1e-9


@pytest.mark.parametrize("integrator", ["midpoint", "newmark", "exact_modal"])
def test_masses_that_a_hard_constraint_joins_lose_the_energy_of_a_plastic_impact(integrator):
    """Of three masses of 1 kg that touch, the right one drives the middle one back into the left one.

    All end at (1 - 5)/3 = -4/3 m/s with 8/3 J of 13 J. Between the left two, which parted before, the impulse does
    work of its own sign: the loss is that of both contacts.
    """
    history = row((1.0, 1.0, 1.0), (0.0, 1.0, -5.0), (0.0, 0.0), {"kind": "addition_deletion"}, 1e-6, integrator)
    for name in ("m0", "m1", "m2"):
        assert history.recorded[f"velocity:{name}"].values[-1] == pytest.approx(-4.0 / 3.0, rel=1e-12)
    assert history.energy.booked["contact"][-1] == pytest.approx(13.0 - 8.0 / 3.0, rel=1e-12)


@pytest.mark.parametrize("integrator", ["moreau_jean", "midpoint", "central_difference"])
@pytest.mark.parametrize("kind", ["addition_deletion", "paoli_schatzman"])
def test_a_constraint_that_pushes_an_overlap_out_names_the_overlap_as_the_reason(kind, integrator):
    """It closes the gap in a step, with the speed overlap/dt = 10 m/s: a smaller step makes it worse."""
    overlapping = il.Contact("ball", "wall", {"kind": kind}, gap=-1e-5, overlap="allowed")
    solve = {"duration": 2e-5, "integrator": {"kind": integrator}, "step": {"dt": 1e-6}}
    bodies = {"ball": il.Mass(1.0, velocity=1.0), "wall": il.Wall()}
    with pytest.raises(il.StepError, match="energy grew") as failed:
        il.run(il.Case(bodies=bodies, contacts=[overlapping], solve=solve))
    assert "overlaps by 1e-05 m at t = 0" in failed.value.remedy
    assert "smaller step" not in failed.value.remedy
