"""Contact laws where a scheme or a face does not suit them: what a review found, named after the symptom."""

from __future__ import annotations

import math

import pytest

import impactlab as il
from impactlab.bases.craig_bampton import CraigBampton
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.energy_conserving import EnergyConserving
from impactlab.contact.impedance_residual import ImpedanceResidual
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.nitsche import Nitsche
from impactlab.contact.paoli_schatzman import PaoliSchatzman
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.contact.wave_initialised import WaveInitialised
from impactlab.errors import PairingError, StepError
from impactlab.history import AbstractHistory
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.contact_stabilised_newmark import ContactStabilisedNewmark
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.generalised_alpha import GeneralisedAlpha
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import Beam, BeamSegment, Contact, End, Mass, Point, Rod, Segment, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import CLAMPED, FREE, UNIT, in_a_row, simulation
from impactlab.types import Level, Port, Relative, Reply, SideFacts, Start
from tests.solving import in_steps, mesh, run_case, struck_rod
from tests.support import codes


def mass_on_wall(
    law: AbstractContactLaw, integrator: AbstractIntegrator, gap: float = 0.1055, dt: float = 1e-3
) -> Simulation:
    """Return 1 kg at 1 m/s towards a wall, which it meets halfway through a step."""
    bodies = Mass("m", 1.0, 1.0), Wall("w")
    return in_a_row(bodies, None, law, integrator, StepRule(dt=dt), gaps=gap, duration=1.0)


def mass_on_rod(law: AbstractContactLaw, integrator: AbstractIntegrator, end: End = FREE) -> Simulation:
    bodies = Mass("m", 1.0, 1.0), Rod("rod", (UNIT,), end, CLAMPED)
    return in_a_row(bodies, FiniteElement(20), law, integrator, StepRule(dt=0.02), gaps=0.0123)


def rod_between_walls(law: AbstractContactLaw, integrator: AbstractIntegrator, model: AbstractRodModel) -> Simulation:
    bodies = Wall("a"), Rod("rod", (UNIT,), FREE, FREE, velocity=1.0), Wall("z")
    return in_a_row(bodies, model, law, integrator, StepRule(dt=0.02), gaps=(0.5, 1.0), duration=12.0)


def velocity(history: AbstractHistory) -> float:
    return float(history.evaluate(history.duration, "velocity:m"))


@pytest.mark.parametrize("end", [None, End("mass", 10.0)])
def test_a_projection_does_not_pin_a_mass_that_goes_on_at_full_speed(end: End | None) -> None:
    """It stood at the wall with its velocity unchanged, and kept nine tenths of it on a rod's end mass; no warning."""
    law, scheme = AdditionDeletion(), ContactStabilisedNewmark()
    with pytest.raises(PairingError, match="their velocities would never meet"):
        run(*mass_on_wall(law, scheme) if end is None else mass_on_rod(law, scheme, end))


@pytest.mark.parametrize("law", [AdditionDeletion(), PaoliSchatzman()])
def test_masses_that_a_position_constraint_parts_by_chance_are_warned_of(law: AbstractContactLaw) -> None:
    """A mass returns from a wall with any restitution from 0 to 1, by where in the step they meet."""
    found = [run(*mass_on_wall(law, MoreauJean(), gap)) for gap in (0.1051, 0.1055)]
    assert velocity(found[0]) < velocity(found[1]) - 0.5
    assert all("heavy_faces" in codes(history) for history in found)
    assert "heavy_faces" not in codes(run(*mass_on_rod(AdditionDeletion(), MoreauJean())))
    assert "heavy_faces" not in codes(run(*mass_on_wall(law, CentralDifference())))


@pytest.mark.parametrize("integrator", [Newmark(), MoreauJean(), ExactModal()])
def test_a_restitution_of_two_steps_is_not_offered_where_it_throws_back_faster(integrator: AbstractIntegrator) -> None:
    """With e = 1 a mass came back from a wall at one to three times its speed."""
    with pytest.raises(PairingError, match="the restitution of law 'paoli_schatzman'"):
        run(*mass_on_wall(PaoliSchatzman(1.0), integrator))


def test_a_law_over_two_steps_is_not_cut_at_events() -> None:
    with pytest.raises(PairingError, match="needs a constant step"):
        run(*mass_on_wall(PaoliSchatzman(), Midpoint()).but(events="located"))


def test_hertz_is_of_second_order_where_the_force_acts_at_the_end_of_the_step() -> None:
    """It gained 7 % in eighty steps: the mean force of the step acted half a step late.

    Exact: the speed before. The scheme's error is of order (dt/contact)^2, 1/80^2 here, and falls with the square; what
    the instants of touch and release add is of the order of their share of a step's energy, below 1e-3.
    """
    for dt in (1e-3, 5e-4):
        history = run(*mass_on_wall(Hertz(1e4), GeneralisedAlpha(), dt=dt))
        assert abs(velocity(history) + 1.0) < 1.0 / 80**2
        assert history.energy.largest_gain < 1e-3


def test_energy_conserving_contact_books_its_loss_under_leapfrog() -> None:
    """The mass stopped at the wall and half a joule was gone without a word."""
    history = run(*mass_on_wall(EnergyConserving(), CentralDifference()))
    assert velocity(history) == pytest.approx(0.0, abs=1e-12)
    assert history.energy.booked["contact"][-1] == pytest.approx(0.5, rel=1e-12)
    assert history.energy.largest_loss < 1e-12


def test_impedance_residual_is_not_a_spring_of_the_flexibility_left_out() -> None:
    """A Craig-Bampton basis of a free rod leaves 3e-5 of an element's compliance: energy grew by 4e7."""
    model = Modal(40, 20, basis=CraigBampton())
    with pytest.raises(PairingError, match="leaves any out"):
        run(*rod_between_walls(ImpedanceResidual(), ExactModal(), model))


def test_impedance_residual_on_a_beam_names_the_bodies_and_laws_for_them() -> None:
    """It asked for fewer modes of a body that has no axial ones."""
    case = il.load_case("sphere_on_beam").with_("contacts.0.law", {"kind": "impedance_residual"})
    with pytest.raises(PairingError, match=r"'.*' is a mass, '.*' a beam") as refused:
        il.run(case)
    assert "dispersive_identification" in str(refused.value.remedy)


def test_a_coarse_contact_of_rigid_bodies_has_a_smaller_step_as_remedy() -> None:
    """It asked for more elements or modes, of a ball and a wall."""
    bodies = {"ball": il.Mass(1.0, velocity=1.0), "wall": il.Wall()}
    contacts = [il.Contact("ball", "wall", {"kind": "hertz", "stiffness": 1e9})]
    solve = {"duration": 5e-3, "integrator": {"kind": "midpoint"}, "step": {"dt": 1e-3}}
    (warned,) = il.run(il.Case(bodies=bodies, contacts=contacts, solve=solve)).warnings
    assert warned.code == "coarse_contact"
    assert warned.text.endswith("or more; give a smaller step")


def test_a_coarse_contact_of_a_delay_line_has_a_smaller_step_as_remedy() -> None:
    """It asked for more elements or modes, of a body that has none."""
    bodies = {"ball": il.Mass(0.005, velocity=1.0), "rod": il.Rod(length=1.0, area=1e-3, material="steel")}
    contacts = [il.Contact("ball", "rod.left", {"kind": "hertz", "stiffness": 1e11})]
    solve = {"duration": 1e-3, "model": {"kind": "continuous"}, "step": {"dt": 2e-5}}
    (warned,) = [each for each in il.run(il.Case(bodies=bodies, contacts=contacts, solve=solve)).warnings
                 if each.code == "coarse_contact"]  # fmt: skip
    assert warned.text.endswith("or more; give a smaller step")


def test_the_pushes_of_open_contacts_agree() -> None:
    """Two open Nitsche contacts on one rod took one sweep: their pushes depended on which was evaluated first."""
    rod = Rod("rod", (UNIT,), FREE, FREE, displacement=lambda x: 0.01 * (x - 0.5))
    scene = in_a_row(
        (Wall("a"), rod, Wall("z")), FiniteElement(2), Nitsche(), Newmark(), StepRule(dt=1.0), gaps=1.0, duration=20.0
    )
    history = run(*scene)
    left, right = (history.evaluate(20.0, f"gap:{contact.name}") for contact in scene.scene.contacts)
    # The rod swings about its middle, which stays: both gaps are the same, to the rounding of twenty steps.
    assert float(left) == pytest.approx(float(right), abs=1e-13)


@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_kicks_under_leapfrog_take_only_the_booked_energy(restitution: float) -> None:
    """Six tenths of the energy were gone with e = 1, and between two walls it grew 271 times.

    A kick I between half steps gives I times the mean of both rates, so with e = 1 nothing, else what the law books:
    rounding of some 300 steps and 150 kicks.
    """
    struck = mass_on_rod(ImpulseMomentum(restitution), CentralDifference()).but(model=FiniteElement(20, "lumped"))
    for case in (struck, rod_between_walls(ImpulseMomentum(restitution), CentralDifference(), Modal(None, 20))):
        history = run(*case)
        assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12
        assert (history.energy.booked["contact"][-1] > 0.0) == (restitution < 1.0)


class Careless(AbstractContactLaw):
    """Loses an energy that is no number."""

    needs = frozenset({Level.POSITION})
    compiled = False

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start()

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        if port.gap < 0.0:
            reply.dissipated = math.nan


def test_a_loss_that_is_no_number_ends_the_run() -> None:
    """It was told as gain 0 and loss 0."""
    with pytest.raises(StepError, match="balance of energy is not a finite number"):
        run(*mass_on_wall(Careless(), Newmark()))


class Boundless(Careless):
    """Stores an energy whose square no number holds."""

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        if port.gap < 0.0:
            reply.stored = 1e200


@pytest.mark.filterwarnings("error")
def test_a_run_that_diverged_ends_with_its_own_error_alone() -> None:
    """A warning of numpy about an overflow came before it."""
    with pytest.raises(StepError):
        run(*mass_on_wall(Boundless(), Newmark()))


BAR = Segment(0.5, 4.0, 1.0, 1.0)  # Z = 4 in half the length of UNIT's


@pytest.mark.parametrize(("x", "z"), [(0.0, 1.0), (0.3, 2.0), (1.0, 5.0), (1.2, 8.0), (1.5, 4.0)])
def test_the_impedance_of_a_rod_is_that_of_both_directions_inside(x: float, z: float) -> None:
    """It was no number inside, and laws that need it were refused there."""
    rod = Rod("rod", (UNIT, BAR), FREE, FREE)
    assert rod.side_facts(x, 0.1).impedance == pytest.approx(z, rel=1e-15)
    assert rod.impedance_at(x) == pytest.approx(z, rel=1e-15)


def test_the_impedance_of_a_timoshenko_beam_between_two_pieces_is_their_sum() -> None:
    pieces = [BeamSegment(1.0, area, 1.0, 1.0, inertia=1.0, shear_stiffness=area) for area in (1.0, 3.0)]
    beam = Beam("beam", tuple(pieces), FREE, FREE, theory="timoshenko")
    assert [beam.side_facts(x, 0.1).impedance for x in (0.0, 0.5, 1.0, 1.5, 2.0)] == [1.0, 2.0, 4.0, 6.0, 3.0]


def struck_inside(law: AbstractContactLaw, model: AbstractRodModel, integrator: AbstractIntegrator) -> AbstractHistory:
    """Return 1 kg at 1 m/s on a rod at 0.4 of its length; in theory the first force is 2 Z v."""
    hammer, rod = Mass("m", 1.0, 1.0), Rod("rod", (UNIT,), FREE, CLAMPED)
    contact = Contact(Point("m", 0.0, "m"), Point("rod", 0.4, "rod@0.4"), 0.0)
    step = StepRule(courant=0.5) if isinstance(integrator, CentralDifference) else StepRule(points_per_period=100.0)
    return run(
        *simulation("inside", {"m": hammer, "rod": rod}, (contact,), 1.0, integrator, step, model=model, law=law)
    )


def test_the_waves_of_modes_left_out_leave_an_inner_point_both_ways() -> None:
    """m v' = -2 Z v until the first end answers after 0.8 s."""
    history = struck_inside(ImpedanceResidual(), Modal(None, 160), ExactModal())
    assert float(history.evaluate(0.5 * history.dt, "force:m|rod@0.4")) == pytest.approx(2.0, rel=0.03)
    for t in (0.2, 0.5, 0.75):
        assert float(history.evaluate(t, "velocity:m")) == pytest.approx(math.exp(-2.0 * t), abs=5e-3)


def test_wave_initialised_begins_with_the_pressure_of_both_directions() -> None:
    history = struck_inside(WaveInitialised(), FiniteElement(100, "lumped"), CentralDifference())
    jump = 1.0 / (1.0 / 0.01 + 1.0) / history.dt  # of the struck node, an element, and the mass: held by F dt too
    assert float(history.evaluate(0.0, "force:m|rod@0.4")) == pytest.approx(2.0 + jump, rel=1e-12)
    assert float(history.evaluate(0.75, "velocity:m")) == pytest.approx(math.exp(-1.5), abs=0.02)


def test_a_damping_relative_to_the_impedance_counts_both_directions_inside() -> None:
    """It was no number."""
    rod = Rod("rod", (UNIT,), FREE, CLAMPED)
    found = Penalty(1.0, Relative(0.5)).spring(Mass("m", 1.0, 1.0).side_facts(0.0, 0.1), rod.side_facts(0.4, 0.1), 0.1)
    assert found == (1.0, 1.0)


def test_a_single_messenger_is_refused_inside() -> None:
    with pytest.raises(PairingError, match="at an inner point of the rod 'rod' waves arrive from both sides"):
        struck_inside(WaveIdentification(), Modal(None, 40), ExactModal())


@pytest.mark.parametrize("integrator", ["newmark", "midpoint", "central_difference"])
def test_a_step_longer_than_the_time_of_a_dashpot_is_warned_of(integrator: str) -> None:
    """A dashpot of c = 4e4 N s/m stops 1 kg in m/c = 25 us; the spring alone would take sqrt(m/k) = 1 ms.

    Of an overdamped contact, a < b the roots of s^2 - s c/m + k/m, the mass leaves where k x + c v = 0, so slowly that
    less than a thousandth of its speed is left. With steps of 100 us it left with a fifth of it, without a word.
    """
    for dt, resolved in ((1e-4, False), (2e-6, True)):
        history = run_case(
            bodies={"ball": il.Mass(1.0, velocity=1.0), "wall": il.Wall()},
            contacts=[il.Contact("ball", "wall", {"kind": "penalty", "stiffness": 1e6, "damping": 4e4}, gap=7.7e-5)],
            solve={"duration": 5e-3, "integrator": {"kind": integrator}, "step": {"dt": dt}},
        )
        speed = abs(float(history.evaluate(5e-3, "velocity:ball")))
        assert (speed < 1e-3) == resolved
        assert ("coarse_contact" in [each.code for each in history.warnings]) != resolved


@pytest.mark.parametrize("law", ["wave_initialised", "addition_deletion"])
def test_a_hard_constraint_that_gains_energy_names_the_lumped_mesh(law: str) -> None:
    """The advice was a softer contact, which a hard constraint does not have, or a smaller step."""
    case = struck_rod({"kind": law}, in_steps({"round_trips": 3}, "newmark", mesh(20), courant=0.5))
    with pytest.raises(StepError, match="mass: lumped"):
        il.run(case)
    assert il.run(case.with_("solve.model.mass", "lumped")).energy.largest_gain < 0.15
