"""The converged reference against answers that share nothing with it: delay equations, damped modes, transforms."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import impactlab as il
from impactlab import metrics, simulate
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz, HuntCrossley
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.refine.descriptions.suitable import stepped
from impactlab.refine.references import converged as converged_reference
from impactlab.refine.references import reference, reference_record
from impactlab.scene import Contact, End, Mass, Point, Rayleigh, Rod, Segment, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.testing.scenes import simulation
from impactlab.types import Relative
from tests.cases.support import CASES

E, RHO, A, L, M, V0 = 2.1e11, 7900.0, 9e-4, 0.3, 2.133, 1.0
C = math.sqrt(E / RHO)
Z, T = RHO * C * A, 2.0 * L / C
NONE = Rayleigh()


def struck(law, trips=3.0, far="clamped", damping=NONE, segments=None, viscosity=0.0) -> Simulation:
    """The paper's rod struck by the paper's mass."""
    segments = segments or (Segment(L, A, E, RHO, viscosity),)
    rod = Rod("rod", segments, End("free"), End(far), damping=damping)
    contact = Contact(Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left"), 0.0)
    bodies = {"hammer": Mass("hammer", M, V0), "rod": rod}
    return simulation(
        "struck", bodies, (contact,), trips * T, None, StepRule(dt=T / 200), round_trip=T, model=Continuous(), law=law
    )


def by_delay_equation(force, far, trips):
    """Return mass and face displacement as functions of t, by the method of steps, one round trip at a time.

    The wave p leaves the face, q arrives: q(t) = -p(t - T) from a clamped end and +p(t - T) from a free one (in
    velocities); the face moves with F/Z + 2 q and p = F/Z + q.
    """
    sign = -1.0 if far == "clamped" else 1.0
    pieces = []

    def rate_force(t, state):
        q = arriving(t)
        # The rate of the indentation feeds the damping: v_mass - F/Z - 2 q, solved for F where it is linear in F.
        return force(state[0] - state[2], state[1] - 2.0 * q), q

    def arriving(t):
        if t < T or not pieces:  # at T the solver looks a rounding beyond its own piece
            return 0.0
        state = pieces[min(int((t - T) / T), len(pieces) - 1)](t - T)
        f, q = rate_force(t - T, state)
        return sign * (f / Z + q)

    def rates(t, state):
        f, q = rate_force(t, state)
        return [state[1], -f / M, f / Z + 2.0 * q]

    state = [0.0, V0, 0.0]
    for number in range(math.ceil(trips)):
        span = (number * T, min(number + 1.0, trips) * T)
        found = solve_ivp(rates, span, state, "DOP853", rtol=1e-11, atol=1e-16, max_step=T / 40, dense_output=True)
        pieces.append(found.sol)
        state = found.y[:, -1]

    def at(t, which):
        number = np.minimum((t / T).astype(int), len(pieces) - 1)
        return np.concatenate([piece(t[number == i])[which] for i, piece in enumerate(pieces)])

    return (lambda t: at(t, 0)), (lambda t: at(t, 2))


@pytest.mark.parametrize("far", ["clamped", "free"])
@pytest.mark.parametrize("stiffness", [1e10, 1e13])
def test_hertz_on_a_uniform_rod_is_the_delay_equation_s(far, stiffness):
    scene = struck(Hertz(stiffness), trips=2.5, far=far)
    found = reference.find(*scene)
    assert found.name == "converged"
    assert found.uncertainty <= 1e-6
    mass, face = by_delay_equation(lambda d, rate: stiffness * max(d, 0.0) ** 1.5, far, 2.5)
    t = metrics.midpoints(scene.scene.duration)
    # DOP853 at 1e-11 leaves about 1e-9: what differs is the reference's own.
    assert metrics.relative_l2(found.history.evaluate(t, "position:hammer"), mass(t)) <= found.uncertainty + 1e-9
    assert metrics.relative_l2(found.history.evaluate(t, "displacement:rod@0"), face(t)) <= found.uncertainty + 1e-9


def test_a_hysteretic_law_on_a_uniform_rod_is_the_delay_equation_s():
    stiffness, e = 1e11, 0.5
    scene = struck(HuntCrossley(stiffness, restitution=e), trips=1.5, far="free")
    found = reference.find(*scene)
    damping = 1.5 * (1.0 - e) / V0  # over the approach speed

    def force(d, rate):  # F = K d^n (1 + a (rate - F/Z)), never pulling
        spring = stiffness * max(d, 0.0) ** 1.5
        return max(0.0, spring * (1.0 + damping * rate) / (1.0 + spring * damping / Z))

    mass, _ = by_delay_equation(force, "free", 1.5)
    t = metrics.midpoints(scene.scene.duration)
    assert found.uncertainty <= 1e-6
    assert metrics.relative_l2(found.history.evaluate(t, "position:hammer"), mass(t)) <= found.uncertainty + 1e-9


def damped_modes(alpha, b):
    """Return the displacement of a mass stuck to a clamped rod with C = b K, as a function of t.

    Modes sin(k x) from the clamped end with k L tan(k L) = alpha; the mass has no damping of its own and K none of the
    mass, so they stay uncoupled. Terms fall as n^-3: 3000 leave 1e-8.
    """
    roots = [
        brentq(lambda z: z * math.sin(z) - alpha * math.cos(z), n * math.pi + 1e-12, (n + 0.5) * math.pi)
        for n in range(3000)
    ]
    z = np.array(roots)
    w, tip = z * C / L, np.sin(z)
    modal = RHO * A * L * (0.5 - np.sin(2.0 * z) / (4.0 * z)) + M * tip**2
    decay = 0.5 * b * w**2
    root = np.sqrt((w**2 - decay**2).astype(complex))

    def at(t):
        # exp(-d t) sin(r t)/r, with the growing half of the sine of an overdamped mode folded into the decay
        waves = (np.exp((-decay + 1j * root) * t) - np.exp((-decay - 1j * root) * t)) / (2j * root)
        return float(np.sum(M * V0 * tip**2 / modal * waves.real))

    return lambda times: np.array([at(t) for t in times])


@pytest.mark.parametrize("way", ["rayleigh", "viscous"])
@pytest.mark.parametrize("b", [2e-7, 1e-5])
def test_a_stiffness_damped_rod_is_that_of_its_damped_modes(way, b):
    trips = 1.5  # it opens after 1.537 T, later with more damping
    damped = {"damping": Rayleigh(stiffness=b)} if way == "rayleigh" else {"viscosity": b * E}
    scene = struck(AdditionDeletion(), trips, **damped)
    found = reference.find(*scene, budget=1.0)
    assert not any(event.kind == "open" and event.time > 0.1 * T for event in found.history.events)
    t = (np.arange(100) + 0.5) * scene.scene.duration / 100
    wanted = damped_modes(RHO * A * L / M, b)(t)
    assert found.uncertainty <= 1e-5
    for channel in ("position:hammer", "displacement:rod@0"):
        assert metrics.relative_l2(found.history.evaluate(t, channel), wanted) <= found.uncertainty + 1e-7


@pytest.mark.slow
def test_a_mass_damped_rod_is_that_of_its_transform():
    """u(s) = M v0/(M s^2 + E A k coth(k L)), c k = sqrt(s^2 + a s), inverted by de Hoog away from the echoes' kinks."""
    mpmath = pytest.importorskip("mpmath")
    a = 2000.0
    scene = struck(AdditionDeletion(), 1.5, damping=Rayleigh(mass=a))
    found = reference.find(*scene)

    def transform(s):
        k = mpmath.sqrt(s * s + a * s) / C
        return M * V0 / (M * s * s + E * A * k * mpmath.coth(k * L))

    t = np.array([0.3, 0.6, 0.8, 1.25, 1.45]) * T
    wanted = np.array([float(mpmath.invertlaplace(transform, time, method="dehoog", degree=40)) for time in t])
    assert found.uncertainty <= 1e-6
    # De Hoog's own error near 1e-6, as degrees 40 and 80 show: the kinks of the echoes limit it.
    assert found.history.evaluate(t, "position:hammer") == pytest.approx(wanted, rel=1e-5)


def two_pieces():
    """A rod of two materials."""
    return (Segment(0.1, A, E, RHO), Segment(0.2, 5e-4, 7e10, 2700.0))


SCENES = {
    "hertz": lambda: struck(Hertz(1e12)),
    "hertz on two materials": lambda: struck(Hertz(1e11), segments=two_pieces()),
    "hard, mass damped": lambda: struck(AdditionDeletion(), damping=Rayleigh(mass=3000.0)),
    "hard, stiffness damped": lambda: struck(AdditionDeletion(), damping=Rayleigh(stiffness=5e-8)),
    "spring, viscous": lambda: struck(Penalty(stiffness=1e9), viscosity=2e4),
}


@pytest.mark.parametrize("name", SCENES)
def test_the_uncertainty_of_a_coarse_reference_holds_against_a_finer_one(name):
    scene = SCENES[name]()
    rough, fine = reference.find(*scene, 0.02), reference.find(*scene, 1.0)
    assert fine.uncertainty < 0.3 * rough.uncertainty or fine.uncertainty <= converged_reference.TARGET_UNCERTAINTY
    for metric in converged_reference.CONVERGED_BY:
        error = metrics.installed()[metric](rough.history, fine.history, scene.scene)
        assert error <= rough.uncertainties[metric] + fine.uncertainty
        assert rough.uncertainties[metric] <= rough.uncertainty


def test_refining_ends_where_costly_levels_no_longer_lower_the_uncertainty(monkeypatch):
    """Two levels after the last that did; cheap levels go on."""
    shown = []

    def stalled(*given):
        shown.append(1e-3)
        return dict.fromkeys(converged_reference.CONVERGED_BY, 1e-3)

    monkeypatch.setattr(converged_reference, "uncertainties", stalled)
    description = next(converged_reference.descriptions_of(SCENES["hertz"]()))
    converged_reference.refine(description, 1.0)
    cheap = len(shown)
    monkeypatch.setattr(converged_reference, "MAX_CHEAP_LEVEL_S", 0.0)
    shown.clear()
    found, spent = converged_reference.refine(description, 1.0)
    assert len(shown) == 3 < cheap
    assert found.uncertainty == 1e-3
    assert 0.0 < spent < 1.0


def test_a_scene_in_which_nothing_moves_is_not_refined():
    """Levels went on until the budget was spent, 7 s, and had no metric to compare."""
    case = il.load_case(CASES / "hard" / "zero_approach.yaml").variant("hertz_at_rest")
    for description in converged_reference.descriptions_of(Simulation(*case.simulation())):
        found, spent = converged_reference.refine(description, 1.0)
        assert found.uncertainty == math.inf
        assert spent == pytest.approx(converged_reference.least_s(description))
    assert reference.find(*case.simulation(), 1.0) is None


def test_costly_levels_are_refined_less_than_cheap_ones():
    steps = [converged_reference.target(seconds) for seconds in (0.01, 0.1, 1.0)]
    assert steps == [
        converged_reference.MIN_UNCERTAINTY,
        converged_reference.TARGET_UNCERTAINTY,
        converged_reference.COSTLY_UNCERTAINTY,
    ]
    assert steps == sorted(steps)


def test_the_others_take_no_longer_than_the_first_one(monkeypatch):
    """By predicted seconds, except for what any check may take."""
    spent, refine = [], converged_reference.refine

    def counting(*given, **named):
        found = refine(*given, **named)
        spent.append(found[1])
        return found

    monkeypatch.setattr(converged_reference, "refine", counting)
    reference.find(*SCENES["hard, stiffness damped"](), 0.05)
    assert len(spent) > 1
    assert sum(spent[1:]) <= max(converged_reference.MIN_CHECK_S, spent[0])


def test_a_first_description_that_does_not_converge_leaves_time_for_the_second(monkeypatch):
    given = []

    def failing(description, budget, enough, alone):
        given.append(budget)
        return None, budget

    monkeypatch.setattr(converged_reference, "refine", failing)
    budget, share = 0.9, converged_reference.FIRST_SHARE  # another budget than above: references are kept
    assert reference.find(*SCENES["hertz on two materials"](), budget) is None
    assert given[:2] == pytest.approx([share * budget, share * (1.0 - share) * budget])


def test_rigid_bodies_alone_converge():
    """A sphere on a wall: Hertz's duration 2.9432751843 d_max/v0, and it returns as it came."""
    stiffness, mass = 1e9, 2.0
    depth = (1.25 * mass * V0**2 / stiffness) ** 0.4
    contact = Contact(Point("ball", 0.0, "ball"), Point("wall", 0.0, "wall"), 0.0)
    bodies = {"ball": Mass("ball", mass, V0), "wall": Wall("wall")}
    scene = simulation("ball", bodies, (contact,), 5.0 * depth, None, StepRule(dt=1e-6), law=Hertz(stiffness))
    found = reference.find(*scene)
    assert found.name == "converged"
    assert found.uncertainty <= 1e-6
    span = found.history.contacts[0]
    assert span.end == pytest.approx(2.9432751843 * depth / V0, rel=1e-4)
    assert span.impulse == pytest.approx(2.0 * mass * V0, rel=1e-9)


def test_two_masses_in_hard_contact_have_no_reference():
    scene = struck(AdditionDeletion())
    heavy = dataclasses.replace(scene.scene.bodies["rod"], left=End("mass", 0.1))
    assert reference.find(*scene.but(bodies={**scene.scene.bodies, "rod": heavy})) is None


def test_an_overlap_at_the_start_has_no_reference_of_hard_contact():
    scene = struck(AdditionDeletion(), damping=Rayleigh(mass=100.0))
    overlapping = dataclasses.replace(scene.scene.contacts[0], gap=-1e-5, overlap_allowed=True)
    assert reference.find(*scene.but(contacts=(overlapping,))) is None


def test_a_stiffness_relative_to_a_mesh_stays_that_of_the_case():
    scene = struck(Penalty(Relative(1.0)), damping=Rayleigh(mass=500.0))
    scene = scene.but(model=FiniteElement(40))
    one = reference.find(*scene, 0.05)
    other = reference.find(*scene.but(law=Penalty(E * A / (L / 40))), 0.05)
    t = np.linspace(0.0, scene.scene.duration, 100)
    assert np.array_equal(*(found.history.evaluate(t, "position:hammer") for found in (one, other)))


def test_the_same_scene_is_refined_once():
    assert reference.find(*struck(Hertz(2e10)), 0.01) is reference.find(*struck(Hertz(2e10)), 0.01)


def test_no_budget_no_converged_reference():
    assert reference.find(*struck(Hertz(1e10)), 0.0) is None
    assert reference.find(*struck(AdditionDeletion()), 0.0).name == "st_venant"


def apart(coarse, middle, fine):
    """The differences of three levels whose metrics are off by these values, all to one side."""
    pairs = {(1, 2): (coarse, middle), (1, 4): (coarse, fine), (2, 4): (middle, fine)}
    return {pair: {name: abs(one[name] - other[name]) for name in fine} for pair, (one, other) in pairs.items()}


def test_the_uncertainty_of_each_metric_is_its_own():
    """An impulse that stands still is not known by displacements that converge fast."""
    levels = [{"mass_displacement": 1e-2 / n**2, "impulse": error} for n, error in ((1, 3e-4), (2, 1e-4), (4, 2e-4))]
    found = converged_reference.uncertainties(apart(*levels), (1, 2, 4), 2.0)
    assert found["mass_displacement"] == pytest.approx(converged_reference.SAFETY * 1e-2 / 16, rel=1e-3)
    assert found["impulse"] > 2e-4


def test_three_levels_that_agree_to_reading_claim_no_less_than_that():
    levels = [{"impulse": 1e-12 / n**2} for n in (1, 2, 4)]
    assert converged_reference.uncertainties(apart(*levels), (1, 2, 4), 2.0) == {
        "impulse": converged_reference.MIN_UNCERTAINTY
    }


def test_a_reference_that_a_second_description_contradicts_has_their_difference_as_uncertainty():
    """The wrong one here is that of a mass two per cent heavier, found by three levels that agree."""
    scene = struck(AdditionDeletion(), damping=Rayleigh(mass=500.0))
    heavier = scene.but(bodies=scene.scene.bodies | {"hammer": Mass("hammer", 1.02 * M, V0)})
    right, lucky = (simulate.run(*stepped(each)[0].simulation(400)) for each in (scene, heavier))
    assert right.method.step.courant == 1.0
    mesh = simulate.run(*stepped(scene)[1].simulation(200))
    told = dict.fromkeys(converged_reference.CONVERGED_BY, 1e-5)
    rough = dict.fromkeys(converged_reference.CONVERGED_BY, 3e-3)
    second = reference_record.Reference(reference_record.CONVERGED, mesh, 3e-3, rough)
    kept, doubted = (
        converged_reference.checked(reference_record.Reference(reference_record.CONVERGED, history, 1e-5, told), second)
        for history in (right, lucky)
    )
    assert kept.uncertainty == 1e-5
    difference = max(getattr(metrics, name)(lucky, right, scene.scene) for name in converged_reference.CONVERGED_BY)
    assert doubted.uncertainty == pytest.approx(difference, rel=0.3)


@pytest.mark.parametrize("share", [0.0, 0.31, 0.77])
def test_a_dashpot_that_is_touched_inside_a_step_does_not_fool_the_reference(share):
    """A ball on a wall with spring and dashpot: v(t) after the touch in closed form, zeta 0.6."""
    mass, stiffness, damping = 1.0, 1e6, 1200.0
    w0, zeta = math.sqrt(stiffness / mass), damping / 2.0 / math.sqrt(stiffness * mass)
    contact = Contact(Point("ball", 0.0, "ball"), Point("wall", 0.0, "wall"), 1e-4 * share)
    bodies = {"ball": Mass("ball", mass, V0), "wall": Wall("wall")}
    found = reference.find(
        *simulation("ball", bodies, (contact,), 5e-3, None, StepRule(dt=1e-6), law=Penalty(stiffness, damping))
    )
    e = math.exp(-zeta / math.sqrt(1.0 - zeta**2) * 2.0 * math.acos(zeta))
    impulse = sum(span.impulse for span in found.history.contacts)
    assert abs(impulse - (1.0 + e)) / (1.0 + e) <= found.uncertainties["impulse"]
    assert found.uncertainty < 1e-5
    assert "checked by" in found.found
    assert w0 * 5e-3 > 2.0 * math.acos(zeta)
