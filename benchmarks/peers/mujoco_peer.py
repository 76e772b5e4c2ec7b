"""MuJoCo: dynamics in minimal coordinates with soft constraints, in C.

How it is set, and why:

- ``model``: ``chain``: one slide joint per node of a lumped mesh, each on a body of its own so that the mass matrix is
  diagonal, springs as fixed tendons; ``modes``: one slide joint per mode of a Craig-Bampton rod, its spring in the
  joint, so that only the contact couples coordinates. The latter spares n tendons; an expert would take it.
- Contact: the limit of a fixed tendon whose length is the gap, ``solreflimit`` in its direct form: with an impedance
  near one the constraint's acceleration is -b v - k r. ``b dt = 1`` brings the approach to rest within one step,
  ``k dt dt`` takes the penetration back; both are scanned in these units.
- Integrators: `Euler`, which is semi-implicit, the central difference of an undamped chain; `implicitfast`, which is
  the same here, and `RK4`.
- A dense Jacobian: version 4.0.0 has a wrong sparse factor (fixed in 4.0.1), and with one constraint a dense one is
  the quicker. One constraint needs no factor at all: the solver `PGS` beats `Newton`, both are scanned.
- Collision, gravity, damping, actuation, sensors and warm start are off; `mj_step` takes all steps in one call of C.
"""

from __future__ import annotations

from functools import partial
from itertools import product
from typing import Any

import numpy as np

from benchmarks.peers.cases import Array, Case, Outcome
from benchmarks.peers.mesh import chain, modes
from benchmarks.peers.run import Run, Setting, version_of

NAME = "MuJoCo"
LIBRARY = "MuJoCo"
version = partial(version_of, "mujoco")
IMPEDANCE = 0.9999  # the largest it takes

MODEL = """<mujoco>
<option timestep="{dt!r}" integrator="{scheme}" jacobian="{jacobian}" solver="{solver}" iterations="20"
 tolerance="1e-14" gravity="0 0 0">
<flag contact="disable" gravity="disable" actuation="disable" sensor="disable" eulerdamp="disable"
 warmstart="disable" refsafe="disable"/></option>
<compiler autolimits="false" inertiafromgeom="false" boundmass="0" boundinertia="0"/>
<worldbody>
{bodies}
</worldbody>
<tendon>
<fixed name="gap" limited="true" range="0 1e6" solreflimit="{spring!r} {damper!r}"
 solimplimit="{impedance} {impedance} 1 0.5 1">
{gap}
</fixed>
{springs}
</tendon>
</mujoco>"""


def settings(case: Case) -> list[dict[str, Any]]:
    """Return modes and chains, their steps and stabilisations."""
    found = []
    springs = (0.1, 0.5, 1.0)
    for n, courant, spring in product((12, 16, 20, 24, 32, 48), (0.2, 0.3, 0.5, 0.7), springs):
        found.append(_setting("modes", n, "Euler", courant, 1.0, spring) | {"solver": "PGS"})
    for n, spring in product((16, 24), springs):
        found.append(_setting("modes", n, "Euler", 0.3, 1.0, spring))
        found.append(_setting("modes", n, "Euler", 0.3, 0.5, 0.2 * spring))
        found.append(_setting("modes", n, "RK4", 0.6, 1.0, spring))
        found.append(_setting("modes", n, "implicitfast", 0.3, 1.0, spring))
    for n, courant, spring in product((50, 60, 80, 100, 120, 160, 240), (0.7, 0.9, 1.0), springs):
        found.append(_setting("chain", n, "Euler", courant, 1.0, spring) | {"solver": "PGS"})
    return found


def _setting(model: str, n: int, scheme: str, courant: float, damper: float, spring: float) -> dict[str, Any]:
    given = {"model": model, "coordinates": n, "scheme": scheme, "courant": courant}
    return given | {"damper_per_step": damper, "spring_per_step": spring}


def step_of(case: Case, setting: Setting) -> float:
    """Return the step [s].

    ``courant`` is in h/c, of modes in two over the largest frequency.
    """
    n = setting["coordinates"]
    if setting["model"] == "modes":
        return float(setting["courant"] * 2.0 / modes(case, n).frequency[-1])
    return float(setting["courant"] * case.length / n / case.wave_speed)


def document(case: Case, setting: Setting, dt: float) -> tuple[str, Array]:
    """Return the model as XML, and the weights of joints in the face.

    The weights give its displacement; the last joint is the mass.
    """
    n = setting["coordinates"]
    if setting["model"] == "modes":
        rod = modes(case, n)
        masses, held, face, springs = np.ones(n), rod.frequency**2, rod.face, []
    else:
        mesh = chain(case, n)
        masses, held, face = mesh.mass, np.zeros(n), np.eye(n)[0]
        held[-1] = mesh.spring[-1]
        springs = [
            f'<fixed stiffness="{float(k)!r}" springlength="0"><joint joint="j{i}" coef="1"/>'
            f'<joint joint="j{i + 1}" coef="-1"/></fixed>'
            for i, k in enumerate(mesh.spring[:-1])
        ]
    bodies = [
        f'<body><inertial pos="0 0 0" mass="{float(m)!r}" diaginertia="1 1 1"/>'
        f'<joint name="j{i}" type="slide" axis="1 0 0" stiffness="{float(k)!r}"/></body>'
        for i, (m, k) in enumerate(zip([*masses, case.striker], [*held, 0.0], strict=True))
    ]
    face = np.append(face, 0.0)
    gap = [f'<joint joint="j{i}" coef="{float(part)!r}"/>' for i, part in enumerate(face) if part]
    text = MODEL.format(
        dt=dt,
        scheme=setting["scheme"],
        jacobian=setting.get("jacobian", "dense"),
        solver=setting.get("solver", "Newton"),
        # The direct form is divided by the impedance and its square inside; so what acts is what is given here.
        spring=-max(setting["spring_per_step"], 1e-9) * IMPEDANCE**2 / dt**2,
        damper=-max(setting["damper_per_step"], 1e-9) * IMPEDANCE / dt,
        impedance=IMPEDANCE,
        bodies="\n".join(bodies),
        gap="\n".join([*gap, f'<joint joint="j{n}" coef="-1"/>']),
        springs="\n".join(springs),
    )
    return text, face


def build(case: Case, setting: Setting, record: bool) -> Run:
    """Return a run; with ``record`` Python reads the state after every step."""
    import mujoco

    steps, dt = case.steps_of(step_of(case, setting))
    text, face = document(case, setting, dt)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qvel[-1] = case.velocity
    kept = np.zeros((steps + 1 if record else 1, 3))

    def solve() -> None:
        if not record:
            mujoco.mj_step(model, data, nstep=steps)
            return
        for step in range(1, steps + 1):
            mujoco.mj_step(model, data)
            kept[step] = data.time, data.qpos[-1], data.qpos @ face

    def outcome() -> Outcome:
        return Outcome(kept[:, 0], kept[:, 1], kept[:, 2], float(data.qvel[-1]))

    return Run(solve, outcome)
