"""Modes of beams as a description of the automatic choice.

It sets their number in a run, and predicts the error of those left out. Two errors add up: that of the modes left out,
of order 3 in their number by bending and of order 1 by shear, and that of the steps across a contact, of order 2. As a
rule all runs of a scene have the same modes, and the error of the others follows from their flexibility
(`impactlab.refine.errors.left_out`). Where this needs too many modes, their number grows with the steps. Static shapes
at the contacts take the place of many modes.
"""

from __future__ import annotations

import functools
import math
from dataclasses import replace

from impactlab.bases.beams.modes import has_closed_form
from impactlab.history.base import AbstractHistory
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.continuous import Continuous
from impactlab.refine.descriptions import cost, meshed_modes
from impactlab.refine.descriptions.beams import MAX_DENSE_ELEMENTS, STEPS, modal_model, shortest_time
from impactlab.refine.descriptions.contact_times import times_of
from impactlab.refine.descriptions.cost import Cost
from impactlab.refine.descriptions.description import Description
from impactlab.refine.descriptions.rods import modelled_as, recorded
from impactlab.refine.errors import left_out
from impactlab.refine.errors.distances import counted
from impactlab.refine.errors.smooth_touch import are_soft, stated_alone
from impactlab.scene.bodies import Beam
from impactlab.scene.facts import beams_of, is_lossy
from impactlab.scene.method import Simulation, StepRule, laws_of
from impactlab.scene.problem import Scene

UNIT = "steps in the shortest time of the scene"
COARSEST = 3 * STEPS  # steps in the shortest time, at least: three in a rise of force
COARSEST_MODES, FEWEST_MESHED = 24, 18  # modes at `COARSEST` steps: in closed form, and of a mesh
COARSEST_KNOWN = 18  # the same where the stiffness of every contact is known, and so the error of the others
ELEMENTS_PER_MODE = 1.5  # of the mesh behind modes without a closed form
MESH_SHARE = 0.1  # of the tolerance: error by the mesh behind modes that the other margins cover
MIN_FEWER = 1.3  # ratio of the modes without and with static shapes, from which these are used
COARSER = 1.27  # longest step of a study, over the one predicted for the tolerance
SHAPES_IN_STEP = 1.9  # rad by which static shapes turn in that step, at most (`left_out.MAX_TURN` in 1.6 of it)
MAX_MODES = 1500  # in closed form; finding each takes some 0.1 ms
MAX_RAISED = 3  # times that the number of modes is raised; coarse runs may not show how much touches magnify an error
MAX_STEPS = 1_000_000  # in the shortest time
MISSING_SHARE = 0.3  # of the tolerance: error by modes left out, where their number grows with the steps
STATED_SHARE, STATED_SHARE_OF_SHEAR = 0.25, 0.28  # the same where all runs have the same modes: by bending, by shear
MAX_UNSEEN_SHARE = 0.5  # the same with the largest number of modes
POWER_MARGIN = 2.2  # on the predicted cost beside that of meshes: beams that shear are often touched longer, or again
CLOSED = 3.7  # rises of its force, for which a contact is closed as a ball strikes a beam once: measured, 3.7 to 4.4
# On the error by modes left out where a beam with shear is touched again: 254 random runs had at most 3.2 times it, and
# four of them more than twice. At a loose end 4 of 85 had more than four times it, 8.8 at most, and one other run 14.
TOUCHED_AGAIN, TOUCHED_AGAIN_AT_END = 3.2, 4.0
DEFAULT_TOLERANCE = 1e-3  # where a scene has none: for trials of the cost model
# Factors of predicted errors. The first two are those of a long run, fitted to random beams; where a wall or a force
# that jumps leaves the rise unknown, the first and the last are used, medians over the scenes of benchmarks/choice.py.
ERROR_OF_MODES, ERROR_OF_SPRINGS, ERROR_OF_SPRINGS_AT_WALLS = 0.15, 0.25, 0.04
LONG_RUN = 18.0  # rises of force: in a shorter run the error has less time to grow
ERROR_OF_IMPULSES = 0.2  # factor on these if only impulses count, in which errors of the force partly cancel
MISSING_MARGIN = 1.5  # on errors by modes left out: measured errors are 0.1 to 1.2 of `left_out.beside_contacts`
MISSING_MARGIN_OF_SHAPES = 2.5  # the same where static shapes stand for them: 99 % of random beams below 2.6


def counted_share(request: Simulation) -> float:
    """Return a factor on predicted errors: below 1 if only impulses count."""
    return ERROR_OF_IMPULSES if counted(request)[2] == ("impulses",) else 1.0


def rises(n: float) -> float:
    """Return the number of steps in a rise of force.

    The shortest time of the scene has ``n`` steps.
    """
    return n / STEPS


class BeamModesFamily:
    """Modes of beams under exact steps, or under Newmark's method where beams lose energy.

    Parameters
    ----------
    request : Simulation
        The scene and its tolerance.
    seen : AbstractHistory, optional
        A run with too few modes, from whose displacements their number follows.
    magnified : float
        Factor by which the touches of that run magnify an error
        (`impactlab.refine.errors.magnification.magnified_by_touches`).
    raised : int
        How often the number of modes was raised already.
    """

    def __init__(
        self, request: Simulation, seen: AbstractHistory | None = None, magnified: float = 1.0, raised: int = 0
    ) -> None:
        self.request, self.raised, self.beams = request, raised, beams_of(request.scene)
        self.touches_again = seen is not None and len(seen.contacts) > 1
        self.shortest = shortest_time(request)
        self.transit = min((0.5 * rod.round_trip for rod in request.scene.wave_bodies), default=math.inf)
        # The steps of a rod fit into its transit, so that only multiples of a number of steps differ: runs of unequal
        # fineness would otherwise have the same steps, and show no error.
        self.multiple = max(1, round(self.shortest / self.transit))
        if self.multiple > 1:
            self.shortest = self.multiple * self.transit
        self.lossy = any(is_lossy(beam) for beam in self.beams)
        self.sheared = any(beam.theory == "timoshenko" for beam in self.beams)
        self.meshed = [beam for beam in self.beams if not has_closed_form(beam)]
        self.closed_form = not self.meshed
        self.tolerance = request.method.tolerance.error if request.method.tolerance else DEFAULT_TOLERANCE
        rises = (times.rise for times in times_of(*request).values())
        self.rise = min((rise for rise in rises if not math.isnan(rise)), default=self.shortest / STEPS)
        self.factor = counted_share(request) * self._error_by_steps()
        self.steps_needed = STEPS * math.sqrt(3.0 * self.factor / self.tolerance)
        self.max_modes = MAX_MODES if self.closed_form else int(MAX_DENSE_ELEMENTS / ELEMENTS_PER_MODE)
        # A dashpot is stiff at its touch, however soft its spring: then the modes left out are not known to be few.
        self.stiffness_known = not any(math.isnan(times.tangent) for times in times_of(*request).values()) and not any(
            law.force_jumps for law in laws_of(*request)
        )
        self.fewest = COARSEST_KNOWN if self.stiffness_known else COARSEST_MODES
        self.longest_dt = COARSER * self._dt(math.ceil(self.steps_needed))
        # Static shapes are used if they replace many modes: all that are fast beside the force.
        self._leave_out(False, seen, magnified)
        if self.stiffness_known and are_soft(request) and not _meets_a_wall(request.scene):
            plain, alone = self._wanted(COARSEST) if self.same_modes else math.inf, dict(vars(self))
            if MIN_FEWER * math.ceil(self._few_with_shapes(max(self.steps_needed, COARSEST))) <= plain:
                self._leave_out(True, seen, magnified)
                if not self.same_modes or MIN_FEWER * self._wanted(COARSEST) > plain:
                    vars(self).update(alone)
        self.modes_of_all = self._wanted(COARSEST) if self.same_modes else None
        self.on_displacements = "displacements" in counted(request)[2]
        self.read: tuple[AbstractHistory, list[left_out.ModalError]] | None = None  # the last run, as of `beside`
        self.known_unseen: dict[int, float] = {}  # of that run, by fineness
        self.made: Simulation | None = None

    def _error_by_steps(self) -> float:
        """Return the predicted error by the steps, at one step in a rise of force.

        Errors of the force change the speeds at which bodies part, and displacements follow from these in time: up to
        `LONG_RUN` the error grows as the square of the duration over the rise; measured on random scenes. Under a power
        law on beams that shear it is predicted to grow with the duration alone: static shapes do not follow much longer
        steps, and more modes would be needed. The rise at a wall is not known, and that of a force that jumps is none.
        """
        springs = all(law.is_spring for law in laws_of(*self.request))
        if _meets_a_wall(self.request.scene) or not are_soft(self.request):
            return ERROR_OF_SPRINGS_AT_WALLS if springs else ERROR_OF_MODES
        grown = min(1.0, self.request.scene.duration / (LONG_RUN * self.rise))
        if springs:
            return grown**2 * ERROR_OF_SPRINGS
        return (grown if self.sheared else grown**2) * ERROR_OF_MODES

    def _leave_out(self, residual: bool, seen: AbstractHistory | None, magnified: float) -> None:
        """Set the errors by modes left out, and whether all runs have the same modes.

        The same modes are found once, and a run that differs only in its step is set up in a tenth of the time. If this
        needs too many modes, their number grows with the steps.
        """
        self.fastest = SHAPES_IN_STEP / self.longest_dt if residual else None
        self.places = list(left_out.left_out(self.request, self.fastest))
        self.margin = MISSING_MARGIN_OF_SHAPES if residual else MISSING_MARGIN
        self.again = self._again() if residual and self.sheared else 1.0
        self.missing = left_out.beside_contacts(self.places)
        if seen is not None:
            self.missing += left_out.beside_displacements(self.places, self.request.scene, seen)
        if self.touches_again:
            magnified *= self.again
        self.magnified = [error.magnified(magnified) for error in self.missing]
        self.stated = self._stated()
        least = self.margin * left_out.total(self.magnified, self.max_modes)
        enough = least <= MAX_UNSEEN_SHARE * self.tolerance or self.stated <= self.max_modes
        self.same_modes = self.stiffness_known and enough

    def _again(self) -> float:
        """Return the factor on the modal error where beams are touched again.

        The beams have shear, and the error is that by modes left out.
        """
        beams = {beam.name: beam for beam in self.beams}
        places = ((beams[point.body], point.x) for point in self.request.scene.faces if point.body in beams)
        return TOUCHED_AGAIN_AT_END if any(left_out.is_loose(*place) for place in places) else TOUCHED_AGAIN

    def _stated(self) -> float:
        """Return the number of modes that the tolerance needs.

        There the error of those left out has its share of the tolerance.
        """
        needed = 0.0
        for error in self.magnified:
            share = STATED_SHARE if error.power > 1.0 else STATED_SHARE_OF_SHEAR
            needed = max(needed, error.modes_for(share / self.margin * self.tolerance, self.longest_dt))
        return needed

    def wanted(self, n: int) -> int:
        """Return the modes required with n steps in the shortest time.

        The number is the same for all n where it is fixed.
        """
        return self._wanted(n) if self.modes_of_all is None else self.modes_of_all

    def _wanted(self, n: int) -> int:
        fine = max(self.steps_needed, COARSEST) if self.same_modes else n
        few = self.fewest * math.pow(fine / COARSEST, 2.0 / 3.0)
        if self.fastest is not None or not self.closed_form:
            few = self._few_with_shapes(fine)
        if self.same_modes:
            return math.ceil(max(few, self.stated))
        # The number of modes changes with the steps, from that of the predicted steps.
        grown, needed = n / self.steps_needed, few
        for error in self.magnified:
            modes = error.modes_for(MISSING_SHARE * self.tolerance)
            needed = max(needed, modes * math.pow(grown, 1.0 / min(error.power, 1.5)))
        return math.ceil(needed)

    @staticmethod
    def _few_with_shapes(n: float) -> float:
        """Return the least number of modes at so many steps.

        They are modes of a mesh, or have static shapes beside them.
        """
        return FEWEST_MESHED * math.pow(n / COARSEST, 1.0 / 3.0)

    def modes(self, n: int) -> int:
        """Return the modes of a run."""
        return min(self.wanted(n), self.max_modes)

    def steps(self, n: int) -> float:
        """Return the steps of a run."""
        return self.request.scene.duration / self._dt(n)

    def _dt(self, n: int) -> float:
        return min(self.shortest / n, self.transit)

    def beside(self, history: AbstractHistory) -> list[left_out.ModalError]:
        """Return the relative errors of displacements by modes left out of a run.

        The last result is kept.
        """
        if self.read is None or self.read[0] is not history:
            self.read = history, left_out.beside_displacements(self.places, self.request.scene, history)
            self.known_unseen = {}
        return self.read[1]

    def unseen(self, n: int, history: AbstractHistory | None = None) -> float:
        """Return the error by modes that all runs leave out.

        Differences between the runs do not show it.
        """
        if not self.same_modes and self.wanted(n) <= self.max_modes:
            return 0.0
        again = self.again if self.touches_again or (history is not None and len(history.contacts) > 1) else 1.0
        if history is None or not self.on_displacements:
            return again * self._unseen(n, [])
        beside = self.beside(history)
        key = 0 if self.same_modes and self.fastest is None else n  # the same modes: the same error at any fineness
        if key not in self.known_unseen:
            self.known_unseen[key] = again * self._unseen(n, beside)
        return self.known_unseen[key]

    def _unseen(self, n: int, beside: list[left_out.ModalError]) -> float:
        modes, dt = self.modes(n), self._dt(n)
        found = max(left_out.total(self.missing, modes, dt), left_out.total(beside, modes, dt))
        return self.margin * found + (self._by_mesh(n) if self.on_displacements else 0.0)

    def error(self, n: int) -> float:
        """Return the predicted error."""
        return self.factor / rises(n) ** 2 + (0.0 if self.same_modes else left_out.total(self.missing, self.modes(n)))

    def finding(self, n: int) -> float:
        """Return the predicted time of finding the modes [s]."""
        if self.closed_form:  # once for all runs that have the same modes: whichever is chosen needs them
            return 0.0 if self.same_modes else cost.CLOSED_FORM_S * self.modes(n)
        return sum(cost.of_eigenvectors(2.0 * self._elements(beam, n)) for beam in self.meshed)

    def _elements(self, beam: Beam, n: int) -> int:
        """Return the number of elements of the mesh behind a beam's modes.

        It suits their number and the length of the run.
        """
        error = MESH_SHARE * self.tolerance
        long = meshed_modes.elements_for(beam, error, self.rise, self.request.scene.duration)
        return min(max(math.ceil(ELEMENTS_PER_MODE * self.modes(n)), long), MAX_DENSE_ELEMENTS)

    def _by_mesh(self, n: int) -> float:
        """Return the error by the meshes behind modes, beyond margins.

        All runs share it; margins cover a part.
        """
        duration, share = self.request.scene.duration, MESH_SHARE * self.tolerance
        found = [meshed_modes.error_of(beam, self._elements(beam, n), self.rise, duration) for beam in self.meshed]
        return sum(max(0.0, error - share) for error in found)

    def simulation(self, n: int) -> Simulation:
        """Return the scene with its modes and steps."""
        step = StepRule(dt=self._dt(n))
        if self.made is not None:  # with the same modes
            return recorded(Simulation(self.made.scene, replace(self.made.method, step=step)), self.steps(n))
        rods = modelled_as(self.request, Continuous(), Newmark() if self.lossy else ExactModal(), step)
        models = {
            beam.name: modal_model(beam, self.modes(n), self._elements(beam, n), self.fastest) for beam in self.beams
        }
        made = Simulation(rods.scene, replace(rods.method, models={**rods.method.models, **models}))
        self.made = made if self.same_modes else None
        return recorded(made, self.steps(n))

    def work(self, n: int) -> tuple[float, float]:
        """Return the steps of a run and its modes, of all beams."""
        return self.steps(n), len(self.beams) * self.modes(n)

    def _cost(self) -> Cost:
        """Return the cost of a step, with iterations of power laws.

        These are counted while their contacts are closed.
        """
        found = cost.BEAM_DAMPED_MODES if self.lossy else cost.BEAM_MODES
        laws, times = self.request.method.laws, times_of(*self.request)
        closed = sum(CLOSED * each.rise for name, each in times.items() if not laws[name].is_spring)
        power_s = cost.POWER_S * min(1.0, closed / self.request.scene.duration)
        margin = POWER_MARGIN if closed and self.sheared and not self.lossy else found.margin
        return found._replace(step_s=found.step_s + power_s, margin=margin)

    def _alone(self) -> float:
        """Return the ratio of the stated to the predicted error of one run.

        It is inf where two runs are needed.
        """
        if not self.same_modes or self.touches_again:
            return math.inf
        return stated_alone(self.request) / counted_share(self.request)

    def _resolves(self) -> int:
        """Return the fineness of the coarsest steps that resolve the static shapes.

        With longer steps the error of the shapes is a part of that of the steps.
        """
        return 0 if self.fastest is None else math.ceil(self.shortest * self.fastest / left_out.MAX_TURN)

    def _finest(self) -> int:
        """Return the largest fineness whose modes may be taken.

        Finer runs would differ only in their steps.
        """
        low, high = COARSEST, MAX_STEPS
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self.wanted(middle) <= self.max_modes else (low, middle)
        return low

    def _with_more(self, seen: AbstractHistory, magnified: float) -> Description:
        """Return the description with more modes, from a run with too few."""
        return BeamModesFamily(self.request, seen, magnified, self.raised + 1).description()

    def description(self) -> Description:
        """Return the description that the automatic choice refines."""
        return Description(
            "modes under Newmark's method" if self.lossy else "modes under exact steps",
            UNIT,
            self.simulation,
            self._cost(),
            functools.cache(self.work),
            error=self.error,
            safety=2.0,
            min_fineness=COARSEST,
            max_fineness=self.multiple * max(1, (MAX_STEPS if self.same_modes else self._finest()) // self.multiple),
            multiple=self.multiple,
            unseen=self.unseen,
            alike=self.same_modes,
            alone=self._alone(),
            resolves=self._resolves(),
            otherwise=self._with_more if self.same_modes and self.raised < MAX_RAISED else None,
            detail=lambda n: f"{self.modes(n)} modes",
            finding=self.finding,
        )


def _meets_a_wall(scene: Scene) -> bool:
    """Return whether a body meets a wall.

    The time in which such a force rises is not known before the run.
    """
    return any(not scene.bodies[point.body].moves for contact in scene.contacts for point in contact.faces)
