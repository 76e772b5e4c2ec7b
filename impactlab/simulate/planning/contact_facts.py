"""Facts of the contacts of a plan, by scene, method and step, that its runs' checks read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import final

from impactlab.scene.facts import impedance_of, striker_of
from impactlab.scene.method import Method, dashpot_of, is_relative, stiffness_of
from impactlab.scene.problem import Contact, Scene
from impactlab.simulate.planning.preparation import BuiltBody
from impactlab.startup.cached import cached_property


@final
class ContactFacts:
    """Facts of one contact; each is found when it is first read.

    Parameters
    ----------
    scene, method : Scene, Method
    built : mapping
        Bodies in their coordinates, by name.
    dt : float or None
        Step [s]; None of an adaptive run.
    contact : Contact
    """

    def __init__(
        self, scene: Scene, method: Method, built: Mapping[str, BuiltBody], dt: float | None, contact: Contact
    ) -> None:
        self._scene, self._method, self._built, self._dt, self._contact = scene, method, built, dt, contact

    @cached_property
    def is_relative(self) -> bool:
        """Whether its law refers to the elements of the bodies."""
        return is_relative(self._method.laws[self._contact.name])

    @cached_property
    def stiffness(self) -> float | None:
        """Stiffness [N/m]: inf of a hard contact, None without a constant spring."""
        return stiffness_of(self._scene, self._method, self._contact)

    @cached_property
    def dashpot(self) -> float:
        """Damping of its constant dashpot [N s/m]; 0 without one."""
        return dashpot_of(self._scene, self._method, self._contact)

    @cached_property
    def impedance(self) -> float:
        """Impedance of its rods in series [N s/m]; inf without one."""
        return impedance_of(self._scene, self._contact)

    @cached_property
    def striker(self) -> float:
        """Reduced mass of its rigid bodies [kg]; inf without one."""
        return striker_of(self._scene, self._contact)

    @cached_property
    def resolution(self) -> float:
        """Time resolution: the step or half the shortest period of rods [s].

        For beams the step alone counts.
        """
        return self._resolution(beams=False)

    @cached_property
    def resolution_of_all(self) -> float:
        """Time resolution [s]: step or half the shortest period of its rods and beams."""
        return self._resolution(beams=True)

    def _resolution(self, *, beams: bool) -> float:
        times = [self._dt or 0.0]
        for point in self._contact.faces:
            body, highest = self._scene.bodies[point.body], self._built[point.body].system.highest_frequency
            if (body.waves is not None or (beams and body.bends)) and highest > 0.0:
                times.append(math.pi / highest)
        return max(times)

    @cached_property
    def delay(self) -> float:
        """Time by which a spring in a hard contact delays its force [s].

        It is impedance over stiffness. A spring given in N/m is physics, and so is its delay: it is 0 here.
        """
        if not self.is_relative:
            return 0.0
        return self.impedance / self.stiffness if self.stiffness and self.impedance < math.inf else 0.0
