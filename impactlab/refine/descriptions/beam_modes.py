"""Modes of beams as a family of the automatic choice: their number in a run, and the error of those left out.

Two errors add up: the modes left out, of order 3 in their number where nothing shears, and the steps across a contact,
of order 2. Either all runs of a scene have the same modes, whose error is stated by the flexibility of the others, or
the modes grow with the steps. Where many modes would be left out by too few of them, their static shapes at the
contacts stand for them.
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
from impactlab.refine.descriptions.beams import MAX_DENSE_ELEMENTS, STEPS, is_lossy, modal_model, shortest_time
from impactlab.refine.descriptions.contact_times import times_of
from impactlab.refine.descriptions.cost import Cost
from impactlab.refine.descriptions.description import Description
from impactlab.refine.descriptions.rods import modelled_as, recorded
from impactlab.refine.errors import left_out
from impactlab.refine.errors.distances import counted
from impactlab.refine.errors.smooth_touch import are_soft, stated_alone
from impactlab.scene.bodies import Beam
from impactlab.scene.facts import beams_of, rods_of
from impactlab.scene.method import Simulation, StepRule, laws_of
from impactlab.scene.problem import Scene

UNIT = "steps in the shortest time of the scene"
COARSEST = 3 * STEPS  # steps in the shortest time: three in a rise of force
COARSEST_MODES, FEWEST_MESHED = 24, 18  # at that many steps; modes in closed form, of a mesh
COARSEST_KNOWN = 18  # modes at that many steps where the flexibility of the others is known at every contact
ELEMENTS_PER_MODE = 1.5  # of the mesh behind modes without a closed form
MESH_SHARE = 0.1  # of the tolerance, that the mesh behind modes may take: the other margins cover it
MIN_FEWER = 1.3  # times fewer modes, from which static shapes are taken in their place
COARSER = 1.27  # times the step that a tolerance needs: one that is twice as long still resolves static shapes
SHAPES_IN_STEP = 1.9  # rad in such a step, of the static shapes: 3 in twice the step
MAX_MODES = 1500  # in closed form, some 0.1 ms each to find
MAX_RAISED = 3  # times: touches may show how much they magnify an error in fine runs alone
MAX_STEPS = 1_000_000  # in the shortest time
MISSING_SHARE = 0.3  # of the tolerance, that modes left out may take
STATED_SHARE, STATED_SHARE_OF_SHEAR = 0.25, 0.45  # the same where it is stated: of errors of order 3 and of order 1
MAX_UNSEEN_SHARE = 0.5  # the same where no more modes may be taken, and their error is stated by their flexibility
POWER_MARGIN = 2.2  # times the predicted cost of a step under a power law: some 0.5 us in contact, none in a mesh
DEFAULT_TOLERANCE = 1e-3  # where a scene has none: for trials of the cost model
# Factors of predicted errors: medians over the scenes of benchmarks/choice.py.
ERROR_OF_MODES, ERROR_OF_SPRINGS = 0.15, 0.04
ERROR_OF_IMPULSES = 0.2  # of these where impulses alone count: a force that is wrong one way and the other has its sum
MISSING_MARGIN = 1.5  # on errors by modes left out: measured, 0.1 to 1.2 of the flexibility beside the contact's
MISSING_MARGIN_OF_SHAPES = 2.5  # the same where static shapes stand for them: 99 % of random beams below 2.6


def counted_share(request: Simulation) -> float:
    """Return the share of a predicted error that the quantities which count have."""
    return ERROR_OF_IMPULSES if counted(request)[2] == ("impulses",) else 1.0


def rises(n: float) -> float:
    """Return the steps in a rise of force, of so many in the shortest time."""
    return n / STEPS


class BeamModes:
    """Modes under Newmark's method where beams lose energy, else under exact steps.

    Parameters
    ----------
    request : Simulation
        The scene and its tolerance.
    seen : AbstractHistory, optional
        A run with too few modes, whose displacements say how many it takes.
    magnified : float
        By which the touches of that run magnify an error (`impactlab.refine.errors.level_errors.magnified_by_touches`).
    raised : int
        How often the number of modes was raised so.
    """

    def __init__(
        self, request: Simulation, seen: AbstractHistory | None = None, magnified: float = 1.0, raised: int = 0
    ) -> None:
        self.request, self.raised, self.beams = request, raised, beams_of(request.scene)
        self.shortest = shortest_time(request)
        self.transit = min((0.5 * rod.round_trip for rod in rods_of(request.scene)), default=math.inf)
        # The steps of a rod fit into its transit. Of so many steps in the shortest time a run has a multiple: runs of
        # unequal fineness would else have the same steps, and show no error.
        self.multiple = max(1, round(self.shortest / self.transit))
        if self.multiple > 1:
            self.shortest = self.multiple * self.transit
        self.lossy = any(is_lossy(beam) for beam in self.beams)
        self.meshed = [beam for beam in self.beams if not has_closed_form(beam)]
        self.closed = not self.meshed
        self.tolerance = request.method.tolerance.error if request.method.tolerance else DEFAULT_TOLERANCE
        springs = all(law.is_spring for law in laws_of(*request))
        self.factor = counted_share(request) * (ERROR_OF_SPRINGS if springs else ERROR_OF_MODES)
        self.enough = STEPS * math.sqrt(3.0 * self.factor / self.tolerance)
        self.most = MAX_MODES if self.closed else int(MAX_DENSE_ELEMENTS / ELEMENTS_PER_MODE)
        self.known = not any(math.isnan(times.tangent) for times in times_of(*request).values())
        self.coarsest = COARSEST_KNOWN if self.known else COARSEST_MODES
        self.coarse = COARSER * self._dt(math.ceil(self.enough))
        # Modes that are fast beside the force follow it: where these are many, their static shapes stand for them.
        self._leave_out(False, seen, magnified)
        rises = (times.rise for times in times_of(*request).values())
        self.rise = min((rise for rise in rises if not math.isnan(rise)), default=self.shortest / STEPS)
        if self.known and are_soft(request) and not _meets_a_wall(request.scene):
            plain = self._wanted(COARSEST) if self.fixed else math.inf
            self._leave_out(True, seen, magnified)
            if not self.fixed or MIN_FEWER * self._wanted(COARSEST) > plain:
                self._leave_out(False, seen, magnified)
        self.always = self._wanted(COARSEST) if self.fixed else None
        self.read: tuple[AbstractHistory, list[left_out.Share]] | None = None  # the last run, as of `beside`
        self.made: Simulation | None = None

    def _leave_out(self, residual: bool, seen: AbstractHistory | None, magnified: float) -> None:
        """Set the errors by modes left out, and whether all runs have the same modes.

        Then they are found once, and a run that differs in its step alone is set up in a tenth of the time. Where this
        would take too many modes, they grow with the steps.
        """
        self.fastest = SHAPES_IN_STEP / self.coarse if residual else None
        self.places = list(left_out.left_out(self.request, self.fastest))
        self.margin = MISSING_MARGIN_OF_SHAPES if residual else MISSING_MARGIN
        self.missing = left_out.beside_contacts(self.places)
        if seen is not None:
            self.missing += left_out.beside_displacements(self.places, self.request.scene, seen)
        self.asked_for = [share.magnified(magnified) for share in self.missing]
        least = self.margin * left_out.total(self.asked_for, self.most)
        self.fixed = self.known and (least <= MAX_UNSEEN_SHARE * self.tolerance or self._stated() <= self.most)

    def _stated(self) -> float:
        """Return the modes at which the error of those left out is the share of the tolerance that it may have."""
        shares = (
            (STATED_SHARE if share.power > 1.0 else STATED_SHARE_OF_SHEAR) / self.margin for share in self.asked_for
        )
        return max(
            (
                one.modes_for(share * self.tolerance, self.coarse)
                for one, share in zip(self.asked_for, shares, strict=True)
            ),
            default=0.0,
        )

    def wanted(self, n: int) -> int:
        """Return the modes that so many steps in the shortest time ask for: of all runs alike, where they are fixed."""
        return self._wanted(n) if self.always is None else self.always

    def _wanted(self, n: int) -> int:
        fine = (max(self.enough, COARSEST) if self.fixed else n) / COARSEST
        few = self.coarsest * math.pow(fine, 2.0 / 3.0)
        if self.fastest is not None or not self.closed:
            few = FEWEST_MESHED * math.pow(fine, 1.0 / 3.0)
        if self.fixed:
            return math.ceil(max(few, self._stated()))
        # As the steps that the tolerance is predicted to need grow finer or coarser, so do the modes.
        needed = [
            share.modes_for(MISSING_SHARE * self.tolerance) * math.pow(n / self.enough, 1.0 / min(share.power, 1.5))
            for share in self.asked_for
        ]
        return math.ceil(max([few, *needed]))

    def modes(self, n: int) -> int:
        """Return the modes of a run."""
        return min(self.wanted(n), self.most)

    def steps(self, n: int) -> float:
        """Return the steps of a run."""
        return self.request.scene.duration / self._dt(n)

    def _dt(self, n: int) -> float:
        return min(self.shortest / n, self.transit)

    def beside(self, history: AbstractHistory) -> list[left_out.Share]:
        """Return the errors of the displacements of a run by modes left out; those of the last run are kept."""
        if self.read is None or self.read[0] is not history:
            self.read = history, left_out.beside_displacements(self.places, self.request.scene, history)
        return self.read[1]

    def unseen(self, n: int, history: AbstractHistory | None = None) -> float:
        """Return the error by modes that all runs leave out, which no two of them show."""
        if not self.fixed and self.wanted(n) <= self.most:
            return 0.0
        by_mesh = self._by_mesh(n) if "displacements" in counted(self.request)[2] else 0.0
        found = left_out.total(self.missing, self.modes(n), self._dt(n))
        if history is not None and "displacements" in counted(self.request)[2]:
            found = max(found, left_out.total(self.beside(history), self.modes(n), self._dt(n)))
        return self.margin * found + by_mesh

    def error(self, n: int) -> float:
        """Return the predicted error."""
        return self.factor / rises(n) ** 2 + (0.0 if self.fixed else left_out.total(self.missing, self.modes(n)))

    def finding(self, n: int) -> float:
        """Return the predicted time of finding the modes [s]."""
        if self.closed:  # once for all runs that have the same modes: whichever is chosen needs them
            return 0.0 if self.fixed else cost.CLOSED_FORM_S * self.modes(n)
        return sum(cost.of_eigenvectors(2.0 * self._elements(beam, n)) for beam in self.meshed)

    def _elements(self, beam: Beam, n: int) -> int:
        """Return the elements of the mesh behind the modes of a beam: for these, and for the length of the run."""
        error = MESH_SHARE * self.tolerance
        long = meshed_modes.elements_for(beam, error, self.rise, self.request.scene.duration)
        return min(max(math.ceil(ELEMENTS_PER_MODE * self.modes(n)), long), MAX_DENSE_ELEMENTS)

    def _by_mesh(self, n: int) -> float:
        """Return the error by the meshes behind modes, which all runs have in common, beyond its share."""
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
        self.made = made if self.fixed else None
        return recorded(made, self.steps(n))

    def work(self, n: int) -> tuple[float, float]:
        """Return the steps of a run and its modes, of all beams."""
        return self.steps(n), len(self.beams) * self.modes(n)

    def _cost(self) -> Cost:
        """Return the cost of a step; beside explicit meshes with a margin for the iterations of a power law."""
        found = cost.BEAM_DAMPED_MODES if self.lossy else cost.BEAM_MODES
        beside = all(beam.theory == "timoshenko" and beam.rotation is None for beam in self.beams)
        springs = all(law.is_spring for law in laws_of(*self.request))
        return found if springs or self.lossy or not beside else found._replace(margin=POWER_MARGIN)

    def _finest(self) -> int:
        """Return the finest steps that the most modes serve: finer runs would differ in their steps alone."""
        low, high = COARSEST, MAX_STEPS
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self.wanted(middle) <= self.most else (low, middle)
        return low

    def _with_more(self, seen: AbstractHistory, magnified: float) -> Description:
        """Return the family with the modes that a run with too few asks for."""
        return BeamModes(self.request, seen, magnified, self.raised + 1).description()

    def description(self) -> Description:
        """Return the family."""
        return Description(
            "modes under Newmark's method" if self.lossy else "modes under exact steps",
            UNIT,
            self.simulation,
            self._cost(),
            functools.cache(self.work),
            error=self.error,
            safety=2.0,
            min_fineness=COARSEST,
            max_fineness=self.multiple * max(1, (MAX_STEPS if self.fixed else self._finest()) // self.multiple),
            multiple=self.multiple,
            unseen=self.unseen,
            alike=self.fixed,
            alone=stated_alone(self.request) / counted_share(self.request) if self.fixed else math.inf,
            otherwise=self._with_more if self.fixed and self.raised < MAX_RAISED else None,
            detail=lambda n: f"{self.modes(n)} modes",
            finding=self.finding,
        )


def _meets_a_wall(scene: Scene) -> bool:
    """Return whether a body meets a wall: the rise of such a force is that of the body's own motion, not known here."""
    return any(not scene.bodies[point.body].moves for contact in scene.contacts for point in contact.faces)
