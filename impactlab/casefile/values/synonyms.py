"""Names of keys in other programs and in a case: hints for unknown keys."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple


class Key(NamedTuple):
    """A key of a case, and how the value changes, if it does."""

    name: str
    note: str = ""


NAMES: Mapping[Key, str] = {
    Key("duration"): "time end_time t_end tend endtime t_final final_time tmax t_max total_time run_time",
    Key("dt"): "timestep time_step delta_t step_size stepsize",
    Key("velocity"): "v v0 v_0 speed initial_velocity initial_speed impact_velocity vel",
    Key("velocity", "sqrt(2 g h) after a fall from a height h"): "height drop_height fall_height",
    Key("density"): "rho",
    Key("young"): "e young_modulus youngs_modulus young's_modulus youngsmodulus elastic_modulus modulus",
    Key("poisson"): "nu poissons_ratio poisson_ratio",
    Key("length"): "l",
    Key("area"): "a cross_section cross_section_area",
    Key("diameter"): "d dia",
    Key("diameter", "twice the radius"): "r radius",
    Key("bore"): "inner_diameter diameter_inner inside_diameter di d_i",
    Key("bore", "diameter less twice the wall"): "wall wall_thickness thickness",
    Key("inertia"): "i second_moment moment_of_inertia",
    Key("mass"): "m",
    Key("elements", "their number"): "dx n_elements num_elements nelements element_size mesh_size mesh",
    Key("modes"): "n_modes num_modes nmodes",
    Key("ends"): "bc bcs boundary boundary_conditions supports",
    Key("stiffness"): "k kn contact_stiffness penalty",
    Key("restitution"): "cor coefficient_of_restitution",
    Key("gap"): "clearance initial_gap distance",
    Key("tolerance"): "tol rtol accuracy",
    Key("integrator"): "solver scheme time_integration",
    Key("courant"): "cfl courant_number",
    Key("gravity"): "g",
    Key("at"): "x position place location",
    Key("bodies"): "body objects",
}  # fmt: skip
HOMES = {
    "duration": "solve: {duration: ...}",
    "dt": "solve: {step: {dt: ...}}",
    "elements": "solve: {model: {kind: ..., elements: ...}}",
    "modes": "solve: {model: {kind: ..., modes: ...}}",
    "tolerance": "solve: {tolerance: ...}",
    "integrator": "solve: {integrator: {kind: ...}}",
    "courant": "solve: {step: {courant: ...}}",
    "gravity": "gravity: ..., beside bodies and solve",
}
"""Where keys are written that stand in one place of a case only."""
KEYS = {name: key for key, names in NAMES.items() for name in names.split()}


def key_of_synonym(name: str) -> Key | None:
    """Return the key of a case for another program's name, in letters of any size."""
    return KEYS.get(name.strip().lower().replace(" ", "_").replace("-", "_"))


def renamed(name: str, key: Key, allowed: Iterable[str], inside: str) -> str:
    """Return a sentence with the key that an unknown name stands for.

    It is empty where the key is not among those allowed, and its place is not clear. ``inside`` is the sentence on the
    block inside this one that has the key.
    """
    note = f" ({key.note})" if key.note else ""
    if key.name in allowed:
        return f" Did you mean {key.name!r}{note}?"
    if not inside and key.name in HOMES and len(name) > 1:  # a letter may stand for another quantity in each block
        inside = f" It stands elsewhere: write {HOMES[key.name]}."
    return f" In a case it is {key.name!r}{note}.{inside}" if inside else ""
