"""A case with every default filled in and every value in SI: what `impactlab check` prints."""

from __future__ import annotations

from typing import Any

from impactlab.casefile.build import DEFAULT_INTEGRATOR
from impactlab.casefile.formula import Formula
from impactlab.casefile.parts import describe_part
from impactlab.casefile.schema import CaseBlock
from impactlab.scene import Body, End, Mass, Rod, Scene, Table


def resolve(case: CaseBlock, scene: Scene) -> dict[str, Any]:
    """Return the case in SI with its defaults, and under ``derived`` what follows from it."""
    solve: dict[str, Any] = {"duration": scene.duration, "records": scene.records}
    if scene.tolerance is not None:
        solve["tolerance"] = scene.tolerance
    else:
        solve |= _described(case, scene)
    return {
        "schema_version": 1,
        "title": case.title,
        "source": case.source,
        "bodies": {name: _body(body) for name, body in scene.bodies.items()},
        "contacts": [
            {
                "between": [contact.left.label, contact.right.label],
                "gap": contact.gap,
                **({"overlap": "allowed"} if contact.overlap_allowed else {}),
                **({} if block.law is None else {"law": describe_part(contact.law, block.law)}),
            }
            for contact, block in zip(scene.contacts, case.contacts, strict=True)
        ],
        "solve": solve,
        "gravity": scene.gravity,
        "probes": [{"body": probe.body, "at": probe.x, "quantity": probe.quantity} for probe in scene.probes],
        "snapshots": list(scene.snapshots),
        "methods": list(case.methods),
        "variants": list(case.variants),
        "derived": _derived(scene),
    }


def _described(case: CaseBlock, scene: Scene) -> dict[str, Any]:
    """Return the keys of ``solve`` that say how the scene is described and stepped."""
    solve: dict[str, Any] = {}
    models = {name: body.model for name, body in scene.bodies.items() if isinstance(body, Rod)}
    blocks = {name: case.solve.models.get(name, case.solve.model) for name in models}
    solve["models"] = {name: describe_part(model, blocks[name]) for name, model in models.items()}
    if scene.integrator is not None:
        solve["integrator"] = describe_part(scene.integrator, case.solve.integrator or DEFAULT_INTEGRATOR)
    rule = scene.step
    steps = {"points_per_period": rule.points_per_period, "dt": rule.dt, "courant": rule.courant}
    solve["step"] = {key: value for key, value in steps.items() if value is not None}
    solve["events"] = scene.events
    return solve


def _body(body: Body) -> dict[str, Any]:
    if isinstance(body, Mass):
        return {"kind": "mass", "mass": body.mass, "velocity": body.velocity}
    if not isinstance(body, Rod):
        return {"kind": "wall"}
    segments = [
        {
            "length": piece.length,
            "area": piece.area,
            "material": {"young": piece.young, "density": piece.density, "viscosity": piece.viscosity},
        }
        for piece in body.segments
    ]
    shape: dict[str, Any] = segments[0] if len(segments) == 1 else {"segments": segments}
    values = {"kind": "rod", **shape, "ends": {"left": _end(body.left), "right": _end(body.right)}}
    values["damping"] = {"mass": body.damping.mass, "stiffness": body.damping.stiffness}
    values["velocity"] = body.velocity
    if isinstance(body.displacement, Formula):
        values["displacement"] = body.displacement.text
    elif isinstance(body.displacement, Table):
        values["displacement"] = {"x": list(body.displacement.x), "u": list(body.displacement.u)}
    return values


def _end(end: End) -> Any:
    held = {} if end.kind in ("free", "clamped") else {end.kind: end.value}
    pushed = {"force": end.force} if end.force != 0.0 else {}
    return {**held, **pushed} or end.kind


def _derived(scene: Scene) -> dict[str, Any]:
    rods = {}
    for name, body in scene.bodies.items():
        if isinstance(body, Rod):
            rods[name] = {
                "mass": body.mass,
                "round_trip": body.round_trip,
                "wave_speed": [piece.wave_speed for piece in body.segments],
                "impedance": [piece.impedance for piece in body.segments],
            }
    return {"rods": rods, "contacts": [contact.name for contact in scene.contacts]}
