"""Claims of Sections 4 and 5: the method and how it is simulated."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from impactlab.contact.modal_messengers import ModalMessengers
from impactlab.integrators.exact_modal import ExactModal
from impactlab.metrics import midpoints
from impactlab.models.modal import Modal
from impactlab.scene import Mass
from impactlab.types import Array
from studies.paper.claims import CONFIRMED, CORRECTED, REFUTED, REMARK, Finding, percent, row
from studies.paper.problem import (
    FACE,
    FORCE,
    MASS,
    PLAIN,
    SEGMENT,
    STRESS,
    TEN_POINTS,
    WAVE,
    T,
    Z,
    at,
    computed,
    error,
    event,
    exact,
    modal,
    peak,
    penetration,
    rod_of,
    scene_of,
    second_contact,
)
from studies.paper.variants import Equation15, Equation20

RUN = "impactlab run cases/axial_impact.yaml"


ANY = 1e9  # share of a miss: nothing is refused

# Section 4 ---------------------------------------------------------------------------------------------------------


@row(
    "4",
    "pp. 771, 773, 779",
    'The St. Venant solution is in "Section one", the method in "Section two".',
    "one, two, one",
    CORRECTED,
    "no run: see the headings on p. 767 and p. 771",
)
def section_numbers() -> Finding:
    return Finding("they are in Sections 3 and 4, as the plan on p. 767 says", {}, stands=True)


@row(
    "4",
    "Eqs. 18, 19, p. 772",
    "A messenger at $c\\,\\Delta t$ from the face tells the wave that arrives one step later.",
    "-",
    CONFIRMED,
)
def messenger_relation() -> Finding:
    distance = 0.00074  # m
    dt = distance / SEGMENT.wave_speed
    t = midpoints(2.9 * T, 777)
    history = exact()

    def wave_in(x: str, when: Array) -> Array:
        return 0.5 * (history.evaluate(when, f"stress:rod@{x}") / STRESS - history.evaluate(when, f"velocity:rod@{x}"))

    worst = float(np.abs(wave_in(f"{distance:g}", t) - wave_in("0", t + dt)).max())
    return Finding("in the continuous rod to rounding", {"worst": worst}, worst < 1e-11)


@row(
    "4",
    "Eqs. 14, 15, p. 771-772",
    "The balance of the mass in small steps gives the new wave.",
    "-",
    CONFIRMED,
)
def equation_15() -> Finding:
    def worst(steps: float) -> float:
        """Return the largest error of the stress over the first contact.

        The exact arriving wave is given.
        """
        dt = 1.0 / steps
        t = np.arange(0.0, 1.5, dt)
        coming = 0.5 * (exact().evaluate(t * T, "stress:rod@0") / STRESS - exact().evaluate(t * T, "velocity:rod@0"))
        going = np.ones_like(t)
        for i in range(1, t.size):
            going[i] = (coming[i] * (1.0 - 2.0 * dt) - coming[i - 1] + going[i - 1]) / (1.0 + 2.0 * dt)
        return float(np.abs(going + coming - exact().evaluate(t * T, FORCE) / Z).max())

    coarse, fine = worst(1000.5), worst(2000.5)
    return Finding(
        f"fed with the exact wave, the stress is right to {coarse:.1e} $s_0$ at $\\Delta t = T/1000$, and "
        "to half of that at half "
        "the step: first order",
        {"coarse": coarse, "fine": fine},
        1.8 < coarse / fine < 2.2 and coarse < 0.01,
    )


@row(
    "4",
    "Eq. 15, p. 772",
    "The same law in the form the package uses: $F = (V_\\text{left} - V_\\text{right})/(Y_\\text{left} + "
    "Y_\\text{right})$.",
    "-",
    CONFIRMED,
)
def same_law() -> Finding:
    ours, printed = computed(modal(10, 10, PLAIN)), computed(modal(10, 10, Equation15()))
    t = midpoints(ours.duration)
    apart = float(np.abs(ours.evaluate(t, FORCE) - printed.evaluate(t, FORCE)).max()) / Z
    return Finding(
        "Eq. 15 with its own memory gives the same force to rounding (10 of 10 modes)", {"apart": apart}, apart < 1e-9
    )


@row(
    "4",
    "Eq. 20, p. 772",
    "The old waves of Eq. 15 may be replaced by the velocity of the face at the previous step.",
    "-",
    CORRECTED,
)
def equation_20() -> Finding:
    wrong = {n: error(computed(modal(n, n, Equation20("modes"))), MASS) for n in (10, 40, 100)}
    right, ours = computed(modal(10, 10, Equation20("balance"))), computed(modal(10, 10, PLAIN))
    t = midpoints(ours.duration)
    apart = float(np.abs(ours.evaluate(t, FORCE) - right.evaluate(t, FORCE)).max()) / Z
    return Finding(
        "only by the velocity that the balance itself carries, $(s_I - s_{II})/(\\rho c)$: then it is Eq. 15 to "
        "rounding. "
        "With the face velocity read from the modes it fails: mass displacement wrong by "
        + ", ".join(percent(value, 3) for value in wrong.values())
        + " with 10, 40, 100 modes of as many elements",
        {"apart": apart} | {f"modes_{n}": value for n, value in wrong.items()},
        apart < 1e-9 and min(wrong.values()) > 0.3,
    )


@row(
    "4",
    "Eq. 22, p. 772",
    "On contact the new wave is $s_I = \\rho c v_0$.",
    "s0",
    CONFIRMED,
)
def equation_22() -> Finding:
    first = at(computed(modal(10, 10, PLAIN)), FORCE, 1e-6) / Z
    dt = (computed(modal(10, 10, PLAIN)).dt or 0.0) / T
    return Finding(
        f"as the value before the first step; the force of the first step is $s_0/(1 + 2\\,\\Delta t/T)$ = "
        f"{first:.4f} $s_0$ "
        "(10 modes)",
        {"first": first},
        abs(first - 1.0 / (1.0 + 2.0 * dt)) < 1e-9,
    )


@row(
    "4",
    "Section 4, p. 773",
    "The impact ends when the new wave $s_I$ turns negative.",
    "$s_I(t) < 0$",
    CORRECTED,
)
def ends_by_new_wave() -> Finding:
    history = exact()

    def new_wave(t: float) -> float:
        return 0.5 * (at(history, "stress:rod@0", t) / STRESS + at(history, "velocity:rod@0", t))

    zero = float(brentq(new_wave, 1.1, 1.5, xtol=1e-12))
    start, stop = event(history, 2) + 1e-9, event(history, 3) - 1e-9
    largest = max(new_wave(t) for t in np.linspace(start, stop, 50))
    whole = error(computed(modal(10, 10, Equation15("new_wave"))), MASS)
    literal = error(computed(modal(10, 10, Equation15("new_wave", "printed"))), MASS)
    kept = error(computed(modal(10, 10, Equation15())), MASS)
    return Finding(
        f"when the whole stress $s_I + s_{{II}}$ does (as Eqs. 10 and 13 say). $s_I$ alone is negative from "
        f"{zero:.3f} T on, and "
        f"all through the second contact (at most {largest:.2f} s0). With 10 of 10 modes the mass displacement is "
        f"wrong by {percent(kept)} with the stress, {percent(whole)} with $s_I$, and {percent(literal)} with $s_I$ "
        f"if each "
        "new touch also starts from Eq. 22 alone",
        {"zero": zero, "largest": largest, "stress": kept, "new_wave": whole, "literal": literal},
        zero < 1.3 and largest < 0.0 and whole > 5.0 * kept,
    )


@row(
    "4",
    "Section 4, p. 773",
    "Penetration does not occur, since mass and face get the same velocity.",
    "none",
    REFUTED,
)
def no_penetration() -> Finding:
    deepest = {n: penetration(computed(modal(n, n, PLAIN))) for n in (10, 40, 100)}
    touched = at(exact(), MASS, 0.5)
    return Finding(
        "small, but there: the law ties velocities, not positions, and the modes follow the balance only "
        "nearly. Deepest "
        + ", ".join(f"{value:.1e}" for value in deepest.values())
        + f" v0 T with 10, 40, 100 modes of as many elements (mass displacement at T/2: {touched / T:.2f} v0 T)",
        {f"modes_{n}": value for n, value in deepest.items()},
        all(value > 1e-4 for value in deepest.values()),
    )


@row(
    "4",
    "Section 4, p. 773",
    "Dispersive and transverse waves: as many points 1 as modes, each at its own distance.",
    "-",
    REMARK,
)
def messenger_per_mode() -> Finding:
    rod, dt = rod_of(scene_of().scene), T / 405.0
    model = Modal(None, 40).build(rod, 0.0)
    rng = np.random.default_rng(1)
    frequency = np.sqrt(model.operators().stiffness[0])
    u, v = rng.normal(size=40) / frequency, rng.normal(size=40)
    x = SEGMENT.wave_speed * dt
    read = model.row(x, "displacement") * v - model.row(x, "stress") * u / STRESS
    free = model.row(0.0, "displacement") * (v * np.cos(frequency * dt) - frequency * u * np.sin(frequency * dt))
    apart = float(np.abs(read - free).max() / np.abs(free).max())
    good = {d: computed(modal(None, d, ModalMessengers(accept=ANY), integrator=ExactModal())) for d in (10, 40)}
    bad = error(
        computed(modal(None, 40, ModalMessengers(balance="impedance", accept=ANY), integrator=ExactModal())), MASS
    )
    found = second_contact(good[10])
    return Finding(
        "the reading of one mode at its own distance is that mode's free evolution over the step (the same to "
        "rounding), so the arriving waves together are the free velocity of the face. That works if the balance "
        f"divides by what the same modes answer: mass displacement error {percent(error(good[10], MASS))} and "
        f"{percent(error(good[40], MASS))} with 10 and 40 analytic modes, second contact found with 10; dividing by "
        f"$1/(\\rho c A)$ it fails ({percent(bad, 3)}). An Euler-Bernoulli beam has no such impedance",
        {"apart": apart, "modes_10": error(good[10], MASS), "modes_40": error(good[40], MASS), "rod": bad},
        apart < 1e-12 and error(good[10], MASS) < 0.02 and found is not None and bad > 1.0,
    )


# Section 5 ---------------------------------------------------------------------------------------------------------


@row(
    "5",
    "Section 5, p. 774",
    "Data of the example; the mass is that of the rod.",
    "A = 9e-9 m2 (as our copy reads), m = 2.133 kg",
    CORRECTED,
    "impactlab check cases/axial_impact.yaml",
)
def constants() -> Finding:
    hammer = scene_of().scene.bodies["hammer"]
    assert isinstance(hammer, Mass)
    area = 2.133 / (7.9e3 * 0.3)
    return Finding(
        f"$A$ = {area:.0e} m2: only that gives $\\rho A L$ = 2.133 kg (the exponent may be our copy's). Then $c$ = "
        f"{SEGMENT.wave_speed:.4f} m/s, $T$ = {1e6 * T:.4f} us, $\\rho c A$ = {Z:.3f} N s/m, first force "
        f"{Z / 1e3:.5f} kN, "
        f"largest {1e-3 * Z * peak(exact()):.5f} kN",
        {"area": area, "wave_speed": SEGMENT.wave_speed, "T": T, "Z": Z, "peak": Z * peak(exact())},
        abs(area - SEGMENT.area) < 1e-12 and abs(SEGMENT.mass - 2.133) < 1e-9,
    )


@row(
    "5",
    "Eq. 24, p. 774",
    "Ten steps in the shortest period, $\\omega_\\text{max} = (2d + 1)\\,\\pi c/(2L)$.",
    "$T_\\text{min}/10$",
    REMARK,
)
def step_rule() -> Finding:
    values: dict[str, float] = {}
    for elements, modes in ((10, 10), (40, 40), (100, 70)):
        highest = Modal(elements, modes).build(rod_of(scene_of().scene), 0.0).operators().highest_frequency
        dt = computed(modal(elements, modes, PLAIN)).dt or 0.0
        values[f"steps_{modes}"], values[f"points_{modes}"] = T / dt, 2.0 * math.pi / highest / dt
    return Finding(
        f"$\\Delta t = T/{values['steps_10']:.0f}$, $T/{values['steps_40']:.0f}$, $T/{values['steps_70']:.0f}$ with "
        f"10, 40, 70 "
        "modes. $2d + 1$ is mode $d + 1$ of the clamped-free rod, a little on the safe side; but the mesh is stiffer "
        f"at its upper end: its own highest mode gets {values['points_10']:.1f}, {values['points_40']:.1f} points "
        f"(10/10, 40/40) and {values['points_70']:.1f} (70 of 100)",
        values,
        abs(values["steps_10"] - 105.0) < 1e-6 and values["points_40"] < 10.0 and values["points_70"] < 10.0,
    )


@row(
    "5",
    "Section 5, p. 773",
    "The clamped-free eigenvectors always give zero stress at the free section.",
    "0",
    REMARK,
)
def zero_stress() -> Finding:
    model = Modal(None, 40).build(rod_of(scene_of().scene), 0.0)
    analytic = float(np.abs(model.row(0.0, "stress")).max())
    t = np.linspace(0.2, 0.7, 2000) * T
    shares = {}
    for n in (10, 40):
        history = computed(modal(n, n, PLAIN))
        stress = float(np.mean(history.evaluate(t, "stress:rod@0"))) * SEGMENT.area
        shares[n] = stress / float(np.mean(history.evaluate(t, FORCE)))
    return Finding(
        "true of the eigenfunctions. Eigenvectors of a mesh have a constant stress in the first element, and with d "
        f"= n it carries {percent(shares[10])} and {percent(shares[40])} of the contact stress (10, 40 modes, mean "
        "over 0.2 to 0.7 T)",
        {"analytic": analytic, "modes_10": shares[10], "modes_40": shares[40]},
        analytic == 0.0 and min(shares.values()) > 0.8,
    )


@row(
    "5",
    "Sections 5 and 6, p. 773-774, 778",
    "The contact force may be obtained with the free-end eigenvectors, no change of modes is needed; Figs 8 to 10 "
    "use 70 modes of 100 elements.",
    "-",
    REMARK,
    f"{RUN} --set solve.model.modes=70 --set contacts.0.law.residual=false",
)
def free_end_modes() -> Finding:
    full, cut = computed(modal(100, 100, PLAIN)), computed(modal(100, 70, PLAIN))
    with_residual = computed(modal(100, 70, WAVE))
    values = {
        "mass_100": error(full, MASS),
        "face_100": error(full, FACE),
        "mass_70": error(cut, MASS),
        "mass_70_residual": error(with_residual, MASS),
        "face_70_residual": error(with_residual, FACE),
    }
    return Finding(
        f"true when all modes of the mesh are kept: 100 of 100 give {percent(values['mass_100'])} (mass) and "
        f"{percent(values['face_100'])} (face displacement). With 70 of 100 as printed the mass is wrong by "
        f"{percent(values['mass_70'])}; with the stress of the modes left out (residual) "
        f"{percent(values['mass_70_residual'])} and {percent(values['face_70_residual'])}",
        values,
        values["mass_100"] < 0.01 and values["mass_70"] > 0.3 and values["mass_70_residual"] < 0.01,
    )


@row(
    "5",
    "Section 4 with d < n",
    "How much of a steady contact stress the messenger sees through the free-end modes.",
    "all of it, silently",
    CORRECTED,
)
def messenger_share() -> Finding:
    def share(elements: int | None, modes: int) -> float:
        model = Modal(elements, modes).build(rod_of(scene_of().scene), 0.0)
        dt = TEN_POINTS.points_per_period
        assert dt is not None
        x = SEGMENT.wave_speed * 2.0 * math.pi / model.operators().rule_frequency / dt
        return 1.0 - model.left_out(x, "stress", 0.0) * SEGMENT.area

    phase = 2.0 * math.pi / 10.0  # w_max dt
    s = np.linspace(0.0, phase, 2001)
    sine_integral = float(np.trapezoid(np.sinc(s / np.pi), s))
    law = 2.0 / math.pi * sine_integral
    analytic, mesh, forty, whole = share(None, 70), share(100, 70), share(100, 40), share(100, 100)
    return Finding(
        f"through $d$ analytic modes $(2/\\pi)\\operatorname{{Si}}(\\omega_\\text{{max}}\\,\\Delta t)$ = {law:.2f} "
        f"of it, whatever $d$ "
        f"({analytic:.2f} with 70); "
        f"through 70 or 40 of 100 eigenvectors of a mesh {mesh:.2f} or {forty:.2f}; through all of them {whole:.2f}. "
        "The next step is short of as much again, so the force dies unless the residual is added",
        {"law": law, "analytic": analytic, "mesh_70": mesh, "mesh_40": forty, "whole": whole},
        abs(analytic - law) < 0.005 and max(mesh, forty) < 0.75 and abs(whole - 1.0) < 1e-9,
    )
