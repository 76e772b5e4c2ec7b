"""A case with all defaults filled in and values in SI.

`impactlab check` prints it. Blocks made from one are gathered into one block again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from impactlab.casefile.blocks.origins import Origin, Origins
from impactlab.casefile.build import DEFAULT_INTEGRATOR
from impactlab.casefile.contacts import faces_of
from impactlab.casefile.instruments import instrument_keys
from impactlab.casefile.mechanisms import direction
from impactlab.casefile.parts import describe_part
from impactlab.casefile.schema import CaseBlock, Frames
from impactlab.contact.relative import relative_options
from impactlab.mechanisms.part_mechanism import PartMechanism
from impactlab.scene.bodies import Beam, Link, Mechanism, MechanismBody
from impactlab.scene.facts import steady_facts
from impactlab.scene.method import Method, models_of, sides
from impactlab.scene.problem import Scene


def resolve(
    case: CaseBlock, scene: Scene, method: Method, written: Mapping[str, Any], origins: Origins
) -> dict[str, Any]:
    """Return the case in SI with its defaults, and derived values under ``derived``.

    Blocks made from one stand as one, with the number of them and every value that differs (`gathered_again`);
    ``written`` is the case as it was given.
    """
    resolved = _resolved(case, scene, method)
    return gathered_again(resolved, written, origins) if origins else resolved


def _resolved(case: CaseBlock, scene: Scene, method: Method) -> dict[str, Any]:
    solve: dict[str, Any] = {"duration": scene.duration, "records": scene.records}
    if case.solve.round_trips_of is not None:
        solve["round_trips_of"] = case.solve.round_trips_of
    if method.tolerance is not None:
        solve |= {"tolerance": method.tolerance.error, "tolerance_on": list(method.tolerance.on)}
    else:
        solve |= _described(case, scene, method)
    mechanisms = [body for body in scene.bodies.values() if isinstance(body, MechanismBody)]
    links = {link.name: link for each in mechanisms if isinstance(each, Mechanism) for link in each.links}
    return {
        "schema_version": 1,
        "title": case.title,
        "source": case.source,
        "bodies": {name: each.described(scene.bodies[name]) for name, each in case.bodies.items() if name not in links}
        | {name: _link(link, case.bodies[name]) for name, link in links.items()},
        **({"mechanisms": {each.name: _mechanism(each, case) for each in mechanisms}} if mechanisms else {}),
        "contacts": _contacts(case, scene, method),
        "solve": solve,
        "gravity": list(mechanisms[0].gravity) if mechanisms else scene.gravity,
        "probes": [
            {"body": block.body, "at": block.at, "quantity": block.quantity} | instrument_keys(block)
            for block in case.probes
        ],
        "snapshots": case.snapshots.model_dump(exclude_none=True)
        if isinstance(case.snapshots, Frames)
        else list(scene.snapshots),
        **({"metrics": list(scene.metrics)} if scene.metrics else {}),
        "methods": list(case.methods),
        "variants": list(case.variants),
        "derived": _derived(scene) | _relative_options(scene, method),
    }


def _contacts(case: CaseBlock, scene: Scene, method: Method) -> list[dict[str, Any]]:
    """Return the contacts as the case gives them.

    All pieces along a body are one block, with the totals of its law.
    """
    found, at = [], 0
    for number, block in enumerate(case.contacts):
        contact = scene.contacts[at]
        at += block.pieces or 1
        labels = [face.point.label for face in faces_of(case, number)] if block.pieces else None
        entry: dict[str, Any] = {"between": labels or [contact.left.label, contact.right.label], "gap": contact.gap}
        entry |= {} if block.along is None else {"along": list(direction(block.along))}
        entry |= {} if block.lever_arm is None else {"lever_arm": block.lever_arm}
        entry |= {key: value for key in ("pieces", "name") if (value := getattr(block, key)) is not None}
        entry |= {"overlap": "allowed"} if contact.overlap_allowed else {}
        if block.law is not None:
            law = method.laws[contact.name]
            entry["law"] = describe_part(law if block.pieces is None else law.divided(1.0 / block.pieces), block.law)
        found.append(entry)
    return found


def _described(case: CaseBlock, scene: Scene, method: Method) -> dict[str, Any]:
    """Return the keys of ``solve`` for the description of the scene and its steps."""
    solve: dict[str, Any] = {}
    blocks = {name: case.solve.models.get(name, case.solve.model) for name in method.models}
    solve["models"] = {name: describe_part(model, blocks[name]) for name, model in models_of(scene, method).items()}
    if method.integrator is not None:
        solve["integrator"] = describe_part(method.integrator, case.solve.integrator or DEFAULT_INTEGRATOR)
    rule = method.step
    steps = {"points_per_period": rule.points_per_period, "dt": rule.dt, "courant": rule.courant}
    solve["step"] = {key: value for key, value in steps.items() if value is not None}
    solve["events"] = method.events
    return solve


def _link(link: Link, block: Any) -> dict[str, Any]:
    if link.beam is None:
        return dict(block.described(link))
    pieces = block.described_pieces(link.beam.segments)
    return {"kind": "beam", **(pieces[0] if len(pieces) == 1 else {"segments": pieces})}


def _mechanism(mechanism: MechanismBody, case: CaseBlock) -> dict[str, Any]:
    if isinstance(mechanism, PartMechanism):
        return describe_part(mechanism.part, case.mechanisms[mechanism.name])  # type: ignore[arg-type] # a part's block
    if not isinstance(mechanism, Mechanism):
        raise TypeError(f"a case gives no {type(mechanism).__name__}")
    links = []
    for link in mechanism.links:
        values = {"body": link.name, "joint": link.joint, "angle": link.angle, "rate": link.rate}
        values |= {"torque": link.torque, "end_mass": link.end_mass, "axial_modes": link.axial_modes}
        if link.drive is not None:
            values["drive"] = {"rate": link.drive.rate, **({"within": link.drive.within} if link.drive.within else {})}
        links.append(values)
    return {"links": links, "end": "free" if mechanism.slide is None else {"slide": mechanism.slide}}


def _relative_options(scene: Scene, method: Method) -> dict[str, Any]:
    """Return the options of laws that are relative to rods, in SI.

    They are under ``laws``; there is no key where there are none.
    """
    if method.tolerance is not None:  # the elements are not chosen yet
        return {}
    of_contacts = ((each, method.laws[each.name]) for each in scene.contacts if each.name in method.laws)
    found = {each.name: relative_options(law, *sides(scene, method, each)) for each, law in of_contacts}
    given = {name: options for name, options in found.items() if options}
    return {"laws": given} if given else {}


def _derived(scene: Scene) -> dict[str, Any]:
    derived: dict[str, dict[str, Any]] = {"rods": {}, "beams": {}}  # of other kinds where there are some
    for name, body in scene.elastic.items():
        known = {
            "mass": body.mass,
            "round_trip": body.round_trip,
            "wave_speed": [piece.wave_speed for piece in body.segments],
        }
        if isinstance(body, Beam):
            known["bending_stiffness"] = [piece.bending_stiffness for piece in body.segments]
            if body.theory == "timoshenko":
                known["shear_speed"] = [piece.shear_speed for piece in body.segments]
        else:
            known["impedance"] = [piece.impedance for piece in body.segments]
        derived.setdefault(f"{body.kind}s", {})[name] = known
    if steady := steady_facts(scene):
        derived["rotation"] = dict(steady)
    return {**derived, "contacts": [contact.name for contact in scene.contacts]}


def gathered_again(resolved: Mapping[str, Any], written: Mapping[str, Any], origins: Origins) -> dict[str, Any]:
    """Return a resolved case with repeated blocks gathered; the scene is the same.

    Values that differ stand as ``{each: [...]}``; faces and bodies as the case names them.
    """
    gathered = dict(resolved)
    gathered["bodies"] = _bodies(resolved["bodies"], origins.bodies)
    for key in ("contacts", "probes"):
        if key in origins.lists:
            gathered[key] = _blocks(resolved[key], written[key], origins.lists[key])
    return gathered


def _bodies(bodies: Mapping[str, Any], origins: Mapping[str, Origin]) -> dict[str, Any]:
    made: dict[str, list[Any]] = {}
    for name, block in bodies.items():
        origin = origins.get(name)
        made.setdefault(name if origin is None else origin.block.partition(".")[2], []).append(block)
    counts = {origin.block.partition(".")[2]: origin.count for origin in origins.values()}
    return {
        name: {**_one(blocks), "repeat": counts[name]} if name in counts else blocks[0] for name, blocks in made.items()
    }


def _blocks(blocks: Sequence[Any], written: Sequence[Mapping[str, Any]], origins: Sequence[Origin | None]) -> list[Any]:
    made: dict[str, list[Any]] = {}
    for block, origin in zip(blocks, origins, strict=True):
        if origin is not None:
            made.setdefault(origin.block, []).append(block)
    found = []
    for each, block in zip(made.values(), written, strict=True):
        named = {key: block[key] for key in ("chain", "between", "body", "name") if key in block}
        if "chain" in block:
            others = {key: value for key, value in _one(each).items() if key != "between" and key not in named}
            found.append({**named, **others})
        elif "repeat" in block:
            found.append({**_one(each), **named, "repeat": len(each)})
        else:
            found.append(each[0])
    return found


def _one(blocks: Sequence[Any]) -> Any:
    """Return the one value of several, a block, or ``{each: [...]}``.

    Blocks with the same keys make a block.
    """
    first = blocks[0]
    if all(block == first for block in blocks):
        return first
    if isinstance(first, dict) and all(isinstance(block, dict) and block.keys() == first.keys() for block in blocks):
        return {key: _one([block[key] for block in blocks]) for key in first}
    return {"each": list(blocks)}
