"""Construction of scene and method of a checked case.

Both are plain frozen records in SI, with the parts that the case names.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from impactlab.casefile.blocks.shafts import ShaftBlock
from impactlab.casefile.blocks.shared import ElasticBlock
from impactlab.casefile.check import reference_rod
from impactlab.casefile.contacts import AllContacts, CaseContact, lever_arm_of, marks_of
from impactlab.casefile.infinite_ends import check_rest
from impactlab.casefile.instruments import probe_of
from impactlab.casefile.joined import points_of
from impactlab.casefile.mechanism_parts import chains_of, parts_of, placed
from impactlab.casefile.mechanisms import gravity_of, gravity_vector, links_of, mechanism_body
from impactlab.casefile.parts import read_part
from impactlab.casefile.schema import CaseBlock, Frames, MassBlock, RoundTrips
from impactlab.casefile.turning import turning
from impactlab.casefile.values.loads import settled
from impactlab.contact.base import AbstractContactLaw
from impactlab.errors import CaseError, ImpactlabError, PairingError, PluginError
from impactlab.mechanisms.part_mechanism import PartMechanism
from impactlab.models.base import AbstractRodModel
from impactlab.plugins import INTEGRATORS, LAWS, MECHANISMS, METRICS, MODELS, Registry, kind_of
from impactlab.scene.bodies import Body, ElasticBody, Mass, Wall
from impactlab.scene.method import Method, Simulation, StepRule, Tolerance
from impactlab.scene.problem import Contact, Scene
from impactlab.scene.ranges import check_scales
from impactlab.scene.sizes import default_records
from impactlab.types import Relative

DEFAULT_INTEGRATOR = {"kind": "newmark"}
HARD_CONTACT = {"kind": "addition_deletion"}  # of a contact without a law, under a tolerance

BY_STEPS = (
    "model, integrator and step in place of the tolerance, as model: {kind: continuous}, step: {dt: ...} for rods; "
    "errors are then measured."
)


def build(case: CaseBlock, all_contacts: AllContacts, name: str, registry: Registry) -> Simulation:
    """Return the scene and the method of a checked case.

    Raises
    ------
    PluginError
        If a part is not installed or broken.
    CaseError
        If a parameter of a part is wrong, or a snapshot lies outside the run.
    """
    models = _models(case, registry)
    parts = parts_of(case, gravity_vector(case.gravity), registry)
    by_block = [_contacts(contact, parts) for contact in all_contacts.contacts]
    contacts = tuple(contact for each in by_block for contact in each)
    gravity = gravity_of(case)
    bodies = _bodies(case, contacts, parts, gravity)
    laws = _laws(case, by_block, registry)
    round_trip = _round_trip(case, bodies)
    given = case.solve.duration
    duration = given.round_trips * round_trip if isinstance(given, RoundTrips) else float(given)
    bodies = {label: settled(body, duration) for label, body in bodies.items()}
    snapshots, frames = _field_times(case, duration)
    _check_metrics(case, registry)
    scene = Scene(
        name=name,
        bodies=bodies,
        contacts=contacts,
        duration=duration,
        records=case.solve.records,
        gravity=gravity,
        probes=tuple(probe_of(block, case.bodies[block.body]) for block in case.probes),
        snapshots=snapshots,
        frames=frames,
        metrics=tuple(dict.fromkeys(case.metrics)),
        round_trip=round_trip,
    )
    if "records" not in case.solve.model_fields_set:
        scene = dataclasses.replace(scene, records=default_records(scene, scene.records))
    check_scales(scene)
    return Simulation(scene, _method(case, laws, models, registry))


def _bodies(
    case: CaseBlock, contacts: tuple[Contact, ...], parts: Mapping[str, PartMechanism], gravity: float
) -> dict[str, Body]:
    """Return all bodies by name, under a gravity [m/s2].

    Mechanisms take the place of their links; those of plugins are added.
    """
    links = links_of(case)
    bodies = turning(case, {label: _body(case, label) for label in case.bodies if label not in links}, contacts)
    chains = {label: mechanism_body(case, label, marks_of(case, label)) for label in chains_of(case)}
    bodies = {**bodies, **chains, **parts}
    for body in bodies.values():
        if body.elastic is not None and body.name in case.bodies:
            check_rest(case, body.elastic, gravity)
    return bodies


def _laws(case: CaseBlock, by_block: Sequence[list[Contact]], registry: Registry) -> dict[str, AbstractContactLaw]:
    """Return the law of each contact by its name; contacts from one block share it."""
    laws: dict[str, AbstractContactLaw] = {}
    read: dict[tuple[int, int | None], AbstractContactLaw] = {}
    for number, contacts in enumerate(by_block):
        key = id(case.contacts[number].law), case.contacts[number].pieces
        if key not in read:
            read[key] = _law(case, number, registry)
        laws.update(dict.fromkeys((contact.name for contact in contacts), read[key]))
    return laws


def _round_trip(case: CaseBlock, bodies: Mapping[str, Body]) -> float:
    """Return the round trip T of the reference body [s].

    It is the body by which round trips are counted; NaN without one.
    """
    name = reference_rod(case)
    body = bodies[name] if name is not None else None
    return body.round_trip if isinstance(body, ElasticBody) else float("nan")


def _field_times(case: CaseBlock, duration: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the times of snapshots, and those of equal frames [s].

    Raises `CaseError` for one beyond the run.
    """
    if isinstance(case.snapshots, Frames):
        return (), case.snapshots.times(duration)
    for number, time in enumerate(case.snapshots):
        if time > duration:
            raise CaseError(
                f"{time:g} s lies after the end of the run. Allowed: 0 to {duration:g} s",
                remedy="Take the snapshot earlier, or run longer.",
                path=f"snapshots.{number}",
            )
    return tuple(case.snapshots), ()


def _check_metrics(case: CaseBlock, registry: Registry) -> None:
    """Raise `PluginError` for a metric that is not installed or broken."""
    for number, metric in enumerate(case.metrics):
        try:
            registry.load(METRICS, metric)
        except PluginError as error:
            error.path = f"metrics.{number}"
            raise


def _method(
    case: CaseBlock, laws: Mapping[str, AbstractContactLaw], models: Mapping[str, AbstractRodModel], registry: Registry
) -> Method:
    if case.solve.tolerance is not None:
        counted: Any = tuple(dict.fromkeys(case.solve.tolerance_on))
        return Method(laws, tolerance=Tolerance(case.solve.tolerance, counted))
    step = case.solve.step
    return Method(
        laws,
        models,
        integrator=_integrator(case, models, registry),
        step=StepRule(points_per_period=step.points_per_period, dt=step.dt, courant=step.courant),
        events=case.solve.events,
    )


def part_faults(data: Mapping[str, Any], registry: Registry) -> list[ImpactlabError]:
    """Return the faults of all models, laws and integrators that a document names."""
    contacts, solve, mechanisms = data.get("contacts"), data.get("solve"), data.get("mechanisms")
    laws = enumerate(contacts if isinstance(contacts, list) else ())
    named = [(block.get("law"), f"contacts.{number}.law", LAWS) for number, block in laws if isinstance(block, dict)]
    given = mechanisms.items() if isinstance(mechanisms, dict) else ()
    named += [(block, f"mechanisms.{name}", MECHANISMS) for name, block in given]
    if isinstance(solve, dict) and solve.get("tolerance") is None:
        named += [(solve.get("model"), "solve.model", MODELS)]
        named += [(solve.get("integrator"), "solve.integrator", INTEGRATORS)]
        models = solve.get("models")
        named += [
            (block, f"solve.models.{name}", MODELS)
            for name, block in (models if isinstance(models, dict) else {}).items()
        ]
    found = []
    seen = set[int]()
    for block, path, group in named:
        if isinstance(block, dict) and isinstance(block.get("kind"), str) and id(block) not in seen:
            seen.add(id(block))  # one for all contacts made from a block
            try:
                read_part(block, path, group, registry)
            except ImpactlabError as error:
                found.append(error)
    return found


def _models(case: CaseBlock, registry: Registry) -> dict[str, AbstractRodModel]:
    """Return the models of rods and beams by name; none under a tolerance, which finds them."""
    if case.solve.tolerance is not None:
        return {}
    models = {}
    for name, block in case.bodies.items():
        if isinstance(block, ElasticBlock):
            path = f"solve.models.{name}" if name in case.solve.models else "solve.model"
            models[name] = read_part(case.solve.models.get(name, case.solve.model), path, MODELS, registry)
    return models


def _body(case: CaseBlock, name: str) -> Body:
    block = case.bodies[name]
    if isinstance(block, MassBlock):
        return Mass(name, block.mass, block.velocity)
    if not isinstance(block, ElasticBlock):
        return Wall(name)
    return block.body(name, lever_arm_of(case, name) if isinstance(block, ShaftBlock) else 1.0)


def _contacts(contact: CaseContact, parts: Mapping[str, PartMechanism]) -> list[Contact]:
    """Return the contact of a block, or those of its pieces along a body."""
    block, faces = contact.block, contact.faces
    paths = [f"contacts.{contact.number}.between.{side}" for side in (0, 1)]
    group = block.name or ("|".join(face.point.label for face in faces) if block.pieces is not None else "")
    found = []
    for points in points_of(*faces, block.pieces or 1):
        left, right = (placed(point, parts, path) for point, path in zip(points, paths, strict=True))
        found.append(Contact(left, right, block.gap, block.overlap is not None, group))
    return found


def _law(case: CaseBlock, number: int, registry: Registry) -> AbstractContactLaw:
    """Return the law of a contact; under a tolerance one without a law is hard."""
    block = case.contacts[number]
    path = f"contacts.{number}.law"
    law: AbstractContactLaw = read_part(block.law or HARD_CONTACT, path, LAWS, registry)
    if case.solve.tolerance is not None:
        _refuse_relative(law, block.law or HARD_CONTACT, path)
        if law.two_sided and law.branches() is None:
            raise CaseError(
                "the automatic choice supports only bilateral contacts with an exact solution, and law "
                f"{kind_of(law)!r} with these options has none",
                remedy=f"{law.exact_remedy}, or {BY_STEPS}" if law.exact_remedy else f"Give {BY_STEPS}",
                path=path,
            )
    if block.pieces is None:
        return law
    try:
        return law.divided(block.pieces)
    except PairingError as error:
        error.path = path
        raise


def _refuse_relative(law: Any, given: Mapping[str, Any], path: str) -> None:
    """Raise `CaseError` where an option of a law is relative to elements.

    They are those of a mesh; the option may be given or a default.
    """
    for field in dataclasses.fields(law):
        if not isinstance(getattr(law, field.name), Relative):
            continue
        if field.name in given:
            raise CaseError(
                f"{field.name} is relative to the elements of a mesh, and the tolerance leaves the mesh open",
                remedy="Give it in SI, or leave the law out for hard contact.",
                path=f"{path}.{field.name}",
            )
        kind, unit = given["kind"], field.metadata["unit"]
        raise CaseError(
            f"law {kind!r} needs {field.name} in {unit} here: its default is relative to the elements "
            "of a mesh, and the tolerance leaves the mesh open",
            remedy=f"Give both, as in --set '{path}={{kind: {kind}, {field.name}: 1e9}}', or leave the law out for "
            "hard contact.",
            path=path,
        )


def _integrator(case: CaseBlock, models: Mapping[str, AbstractRodModel], registry: Registry) -> Any:
    """Return the integrator; None where the case names none and every rod and beam has an exact model."""
    if case.solve.integrator is not None:
        return read_part(case.solve.integrator, "solve.integrator", INTEGRATORS, registry)
    if case.mechanisms:
        return read_part({"kind": "midpoint"}, "solve.integrator", INTEGRATORS, registry)
    if models and all(model.exact for model in models.values()):
        return None
    return read_part(DEFAULT_INTEGRATOR, "solve.integrator", INTEGRATORS, registry)
