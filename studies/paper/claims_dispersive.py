"""Claims on transverse impact and dispersive waves.

They test the reports and proposals of Sections 1 to 4.
"""

from __future__ import annotations

import math

import numpy as np

from impactlab.contact.dispersive_identification import DispersiveIdentification
from impactlab.contact.modal_messengers import ModalMessengers
from impactlab.contact.power_law import Hertz
from impactlab.integrators.exact_modal import ExactModal
from impactlab.metrics import midpoints, relative_l2
from impactlab.models.messengers import wave_numbers
from impactlab.models.modal import Modal
from impactlab.scene import Mass
from impactlab.scene.method import StepRule
from studies.beams import bases, dispersive, scenes
from studies.paper.claims import CONFIRMED, CORRECTED, REMARK, Finding, percent, row
from studies.paper.problem import SEGMENT, TEN_POINTS, T, rod_of, scene_of

GENERAL, BARE = DispersiveIdentification(), DispersiveIdentification(residual=False)


# Section 1 ---------------------------------------------------------------------------------------------------------


@row(
    "1",
    "p. 767, of Lee and Yoon [7]",
    "Load-dependent Ritz vectors are a better basis than mode shapes for beams struck by a mass.",
    "-",
    CONFIRMED,
)
def ritz_vectors() -> Finding:
    ratios = {
        scene.name: bases.error(scene, "eigenvectors", 8) / bases.error(scene, "ritz", 8) for scene in bases.SCENES
    }
    return Finding(
        "with 8 coordinates the error of the contact force is "
        + ", ".join(f"{value:.0f}" for value in ratios.values())
        + " times smaller: sphere on a pinned beam; mass on the tip of a cantilever by Hertz's law; the same with that "
        "of Lankarani and Nikravesh ([page](../beam-bases.md))",
        {f"ratio_{number}": value for number, value in enumerate(ratios.values())},
        min(ratios.values()) > 1.5,
    )


@row(
    "1",
    "p. 766, of Wu and Haug [12]",
    "Only the area near the contact zone is initially excited, so that the modes of the struck substructure suffice.",
    "-",
    REMARK,
)
def near_the_contact() -> Finding:
    local = bases.early("mesh", 0)[1]
    errors = {name: bases.early(name, 40)[0] for name in ("eigenvectors", "substructured", "ritz")}
    later = {name: bases.error(bases.PINNED, name, 40) for name in ("eigenvectors", "substructured")}
    return Finding(
        f"for the first moments: of a hard mass on a long slender beam {percent(local)} of the motion lies outside "
        "the middle quarter when the mass has lost 38 % of its velocity, and 40 coordinates of which the struck "
        f"quarter gets most give its velocity to {percent(errors['substructured'])} of v0, 40 modes of the whole beam "
        f"to {percent(errors['eigenvectors'])}, 40 Ritz vectors to {percent(errors['ritz'])}. Later waves reach the "
        "other quarters: of a whole blow of a sphere the error of the force with 40 coordinates is "
        f"{later['substructured']:.1e}, by modes of the whole beam {later['eigenvectors']:.1e} "
        "([page](../beam-bases.md))",
        {"far": local} | errors | {f"later_{name}": value for name, value in later.items()},
        local < 0.1 and errors["substructured"] < 0.5 * errors["eigenvectors"],
    )


@row(
    "1",
    "p. 766-767, of Wu and Haug [12]",
    "The jump of the modal velocities by impulse and momentum would move the complete system at once.",
    "-",
    REMARK,
)
def whole_system_moves() -> Finding:
    few = bases.kick(5)
    return Finding(
        f"with few modes it does: with 5 modes of a pinned beam struck in the middle {percent(few.far)} of the motion "
        f"lies beyond a tenth of the beam, and velocities above a tenth of the peak over {few.reach:.2f} L. It is the "
        "truncation, see the next row",
        {"far": few.far, "reach": few.reach},
        few.far > 0.1 and few.reach > 0.8,
    )


@row(
    "1",
    "p. 767, of Palas and others [9]",
    "With an infinite set of modes the velocity jumps only at the contact area, and all else keeps at rest.",
    "-",
    REMARK,
)
def local_jump() -> Finding:
    some, many = bases.kick(40), bases.kick(320)
    checked = bases.first_kick_of_a_run(40) / some.impulse - 1.0
    return Finding(
        f"the width at half height falls from {some.width:.3f} L with 40 modes to {many.width:.4f} L with 320, and "
        f"the motion beyond $L/10$ from {percent(some.far)} to {percent(many.far)}: both as $1/N$. So do the impulse "
        f"({some.impulse / bases.KICKED.mass:.3f} to {many.impulse / bases.KICKED.mass:.4f} M v0) and the energy "
        "given: with all modes one kick moves one point and transfers nothing",
        {"width_40": some.width, "width_320": many.width, "far_40": some.far, "far_320": many.far, "run": checked},
        6.0 < some.width / many.width < 11.0 and 6.0 < some.far / many.far < 10.0 and abs(checked) < 1e-12,
    )


# Section 2 ---------------------------------------------------------------------------------------------------------


@row(
    "2",
    "Assumption 3, p. 768",
    "Lateral inertia due to Poisson's effect may be left out.",
    "-",
    REMARK,
)
def lateral_inertia() -> Finding:
    base = scene_of()
    hammer, body = base.scene.bodies["hammer"], rod_of(base.scene)
    assert isinstance(hammer, Mass)
    lateral = 0.3 * math.sqrt(SEGMENT.area / (2.0 * math.pi))
    step = StepRule(dt=T / 810.0)
    seen = [
        scenes.struck(body, model, BARE, hammer.mass, 3.0 * T, 0.0, step=step)
        for model in (Modal(None, 40), scenes.love_rod(40, lateral))
    ]
    t = midpoints(3.0 * T)
    mass, face = (
        relative_l2(seen[1].evaluate(t, channel), seen[0].evaluate(t, channel)) or 0.0
        for channel in ("position:hammer", "displacement:rod@0")
    )
    return Finding(
        f"in the example (round section, Poisson's ratio 0.3, $\\nu r$ = {1e3 * lateral:.2f} mm) Love's rod moves the "
        f"mass by {percent(mass)} and the face by {percent(face)} otherwise over 3 T, by 40 modes of each. A hard "
        f"mass then loses {percent(1.0 - 1.0 / (1.0 + lateral / SEGMENT.length))} of its velocity at once, to the "
        "mass $\\rho A\\,\\nu r$ of a Love rod's face, which Eq. 22 does not know",
        {"mass": mass, "face": face, "at_once": 1.0 - 1.0 / (1.0 + lateral / SEGMENT.length)},
        1e-4 < mass < 0.05,
    )


# Section 3 ---------------------------------------------------------------------------------------------------------


@row(
    "3",
    "p. 768",
    "In transverse impact on beams the surfaces join and separate several times before the impact is finished.",
    "several",
    CONFIRMED,
)
def succession_on_beams() -> Finding:
    held = scenes.beam(0.307, "pinned", "pinned")
    mass = 8.0 * bases.SPHERE  # radius 2 cm
    law = Hertz(stiffness=math.sqrt(2.0) * bases.STIFFNESS)
    runs = [
        scenes.struck(held, model, law, mass, 3e-3, 0.1535, velocity=0.01, step=StepRule(dt=2.5e-7))
        for model in (Modal(None, 40), Modal(120, 60))
    ]
    counts = [len(run.contacts) for run in runs]
    impulses = [sum(span.impulse for span in run.contacts) / (mass * 0.01) for run in runs]
    return Finding(
        f"a steel sphere of 2 cm on a pinned beam of 30.7 cm (Hertz) touches {counts[0]} times in 3 ms, total impulse "
        f"{impulses[0]:.4f} M v0, alike in analytic modes and in those of a mesh. Under a hard mass the count is not "
        "resolved: it follows modes and step ([page](../dispersive-waves.md))",
        {"contacts": counts[0], "contacts_mesh": counts[1], "impulse": impulses[0], "impulse_mesh": impulses[1]},
        counts[0] == counts[1] >= 2 and abs(impulses[0] - impulses[1]) < 1e-3,
    )


# Section 4 ---------------------------------------------------------------------------------------------------------


@row(
    "4",
    "Section 4, p. 773",
    "With dispersion there is no unique wave velocity: every mode has its own.",
    "-",
    CONFIRMED,
)
def own_velocities() -> Finding:
    segment = scenes.beam(0.3, "pinned", "pinned").segments[0]
    numbers = np.array([1.0, 10.0]) * np.pi / 0.3
    frequencies = numbers**2 * math.sqrt(scenes.BENDING / scenes.LINE)
    speeds = frequencies / wave_numbers(segment, 0.0, frequencies)
    return Finding(
        f"on a slender beam in proportion to the number of waves: {speeds[0]:.1f} and {speeds[1]:.0f} m/s for the "
        "first and the tenth mode of a pinned beam of 30 cm and 1 cm x 1 cm; the group travels twice as fast, and "
        "which of both velocities is meant the paper does not say",
        {"first": float(speeds[0]), "tenth": float(speeds[1])},
        abs(speeds[1] / speeds[0] - 10.0) < 1e-9,
    )


@row(
    "4",
    "Section 4, p. 773",
    "Dispersive waves are reflected with the same wave number and velocity of propagation.",
    "-",
    CORRECTED,
)
def reflection_with_near_field() -> Finding:
    # exp(i k x) comes in from x < 0; r exp(-i k x) goes back, b exp(k x) stays: u'' = u''' = 0 at the free end x = 0.
    conditions = np.array([[-1.0, 1.0], [1j, 1.0]])
    r, b = np.linalg.solve(conditions, np.array([1.0, 1j]))
    tip = abs(1.0 + r + b)
    return Finding(
        "and with a near field that does not travel: at the free end of a slender beam the reflected wave is of "
        f"equal size and a quarter turn late, the near field {abs(b):.3f} times the wave, the tip moves {tip:.3f} "
        "times as far as it (the face of a rod: 2). A messenger that knows two travelling waves mistakes the near "
        "field for them",
        {"reflected": abs(r), "near": abs(b), "tip": tip, "phase": float(np.angle(r) / np.pi)},
        abs(abs(r) - 1.0) < 1e-12 and abs(abs(b) - math.sqrt(2.0)) < 1e-12,
    )


@row(
    "4",
    "Section 4, p. 773",
    "A messenger for each mode serves dispersive axial waves.",
    "-",
    CONFIRMED,
)
def messengers_on_love_rod() -> Finding:
    lateral, body = dispersive.LATERAL, scenes.rod()
    place = next(each for each in dispersive.PLACES if each.name.startswith("Love"))
    missed = dispersive.missed(place, 10.0, "phase")
    t = T * (np.arange(60) + 0.5) / 60.0
    seen = scenes.struck(
        body, scenes.love_rod(100, lateral), ModalMessengers(), body.mass, T, 0.0, step=StepRule(dt=T / 4000.0)
    )
    error = float(np.sqrt(np.mean((seen.evaluate(t, "velocity:hammer") - scenes.love(body.mass, lateral, t)) ** 2)))
    return Finding(
        "on Love's rod each reading, at the phase speed of its mode and by the force that the wave carries, is that "
        f"mode's free motion to rounding; 100 modes give the velocity of the mass within {error:.1e} v0 (root mean "
        "square over T) of the inverted Laplace transform. By group speeds the readings miss "
        f"{percent(dispersive.missed(place, 10.0, 'group'))} of what the modes do in a step",
        {"missed": missed, "error": error, "group": dispersive.missed(place, 10.0, "group")},
        missed < 1e-11 and error < 1e-3,
    )


@row(
    "4",
    "Section 4, p. 773",
    "A messenger for each mode serves transverse waves.",
    "-",
    REMARK,
)
def messengers_on_beams() -> Finding:
    places = {each.name: each for each in dispersive.PLACES}
    inner = dispersive.missed(places["pinned slender beam, middle"], 10.0, "phase")
    tips = [dispersive.missed(places["slender cantilever, tip"], points, "phase") for points in (10.0, 40.0)]
    phase, group = (
        dispersive.steps_of(law, (10.0,))[0].energy.largest_gain for law in (dispersive.PHASE, dispersive.GROUP)
    )
    return Finding(
        "at inner points, read on both sides by velocity and shear force, to rounding (pinned beam). At a tip the "
        f"readings miss {percent(tips[0])} of what the modes do in a step, at four times smaller steps "
        f"{percent(tips[1])}; the law still converges, and gains energy in proportion to the step ({percent(phase)} "
        f"at ten points per period, by group speeds {percent(group)}). The local impedance that Eq. 15 divides by "
        "does not exist on a slender beam ([page](../dispersive-waves.md))",
        {"inner": inner, "tip_10": tips[0], "tip_40": tips[1], "gain_phase": phase, "gain_group": group},
        inner < 1e-11 and min(tips) > 0.5 and 0.005 < phase < 0.5 * group,
    )


@row(
    "4",
    "Section 4, p. 771",
    "The technique is applicable to dispersive axial or transverse waves.",
    "-",
    REMARK,
)
def general_form() -> Finding:
    errors = {}
    for theory, tip in ((dispersive.SLENDER, True), (dispersive.SLENDER, False), (dispersive.SHEARED, False)):
        problem = dispersive.long_beam(theory, tip)
        t = problem.end * (np.arange(60) + 0.5) / 60.0
        seen = scenes.struck(
            problem.body, Modal(None, 200), GENERAL, problem.mass, problem.end, problem.x, step=TEN_POINTS,
            integrator=ExactModal(),
        )  # fmt: skip
        errors[f"{theory}_{'tip' if tip else 'inner'}"] = float(
            np.sqrt(np.mean((seen.evaluate(t, "velocity:hammer") - problem.exact(t)) ** 2))
        )
    tip, inner, sheared = errors.values()
    return Finding(
        "in its general form: the free motion of the face for what arrives, the answer of the modes for the "
        f"impedance. With 200 modes a hard mass on a long beam slows as known in closed form within {tip:.1e} v0 "
        f"(slender, tip), {inner:.1e} v0 (slender, inner point), {sheared:.1e} v0 (Timoshenko, inner point)",
        errors,
        max(errors.values()) < 0.01,
    )
