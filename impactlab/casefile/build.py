"""Builds the scene that a checked case describes: plain frozen records in SI, with the parts the case names."""

from __future__ import annotations

import dataclasses
from typing import Any

from impactlab.casefile.arms import lever_arm_of
from impactlab.casefile.blocks import ElasticBlock
from impactlab.casefile.check import faces_of, reference_rod
from impactlab.casefile.parts import read_part
from impactlab.casefile.schema import CaseBlock, MassBlock, RoundTrips
from impactlab.errors import CaseError, ImpactlabError, PluginError
from impactlab.plugins import INTEGRATORS, LAWS, METRICS, MODELS, Registry
from impactlab.scene.bodies import Body, ElasticBody, Mass, Wall
from impactlab.scene.problem import Contact, Probe, Scene, StepRule
from impactlab.scene.ranges import check_scales
from impactlab.types import Relative

DEFAULT_INTEGRATOR = {"kind": "newmark"}
# What stands in the scene of a case with a tolerance until the automatic choice has come to its own.
UNDESCRIBED, HARD_CONTACT = {"kind": "continuous"}, {"kind": "addition_deletion"}


def build_scene(case: CaseBlock, name: str, registry: Registry) -> Scene:
    """Return the scene of a checked case.

    Raises
    ------
    PluginError
        If a part is not installed or broken.
    CaseError
        If a parameter of a part is wrong, or a snapshot lies outside the run.
    """
    bodies = {label: _body(case, label, registry) for label in case.bodies}
    contacts = tuple(_contact(case, number, registry) for number in range(len(case.contacts)))
    rod = reference_rod(case)
    counted = bodies[rod] if rod is not None else None
    round_trip = counted.round_trip if isinstance(counted, ElasticBody) else float("nan")
    given = case.solve.duration
    duration = given.round_trips * round_trip if isinstance(given, RoundTrips) else float(given)
    for number, time in enumerate(case.snapshots):
        if time > duration:
            raise CaseError(
                f"{time:g} s lies after the end of the run. Allowed: 0 to {duration:g} s",
                remedy="Take the snapshot earlier, or run longer.",
                path=f"snapshots.{number}",
            )
    for number, metric in enumerate(case.metrics):
        try:
            registry.load(METRICS, metric)
        except PluginError as error:
            error.path = f"metrics.{number}"
            raise
    step = case.solve.step
    scene = Scene(
        name=name,
        bodies=bodies,
        contacts=contacts,
        duration=duration,
        integrator=_integrator(case, bodies, registry),
        step=StepRule(points_per_period=step.points_per_period, dt=step.dt, courant=step.courant),
        events=case.solve.events,  # type: ignore[arg-type]
        records=case.solve.records,
        gravity=case.gravity,
        probes=tuple(Probe(probe.body, probe.at, probe.quantity) for probe in case.probes),
        snapshots=tuple(case.snapshots),
        metrics=tuple(dict.fromkeys(case.metrics)),
        round_trip=round_trip,
        tolerance=case.solve.tolerance,
        tolerance_on=tuple(dict.fromkeys(case.solve.tolerance_on)),  # type: ignore[arg-type]
    )
    check_scales(scene)
    return scene


def part_faults(case: CaseBlock, registry: Registry) -> list[ImpactlabError]:
    """Return the faults of all models, laws and integrators that a case names."""
    named = [(block.law, f"contacts.{number}.law", LAWS) for number, block in enumerate(case.contacts)]
    if case.solve.tolerance is None:
        named += [(case.solve.model, "solve.model", MODELS), (case.solve.integrator, "solve.integrator", INTEGRATORS)]
        named += [(block, f"solve.models.{name}", MODELS) for name, block in case.solve.models.items()]
    found = []
    for block, path, group in named:
        if block is not None:
            try:
                read_part(block, path, group, registry)
            except ImpactlabError as error:
                found.append(error)
    return found


def _body(case: CaseBlock, name: str, registry: Registry) -> Body:
    block = case.bodies[name]
    if isinstance(block, MassBlock):
        return Mass(name, block.mass, block.velocity)
    if not isinstance(block, ElasticBlock):
        return Wall(name)
    path = f"solve.models.{name}" if name in case.solve.models else "solve.model"
    asked = case.solve.models.get(name, case.solve.model) if case.solve.tolerance is None else UNDESCRIBED
    return block.body(name, lever_arm_of(case, name), {"model": read_part(asked, path, MODELS, registry)})


def _contact(case: CaseBlock, number: int, registry: Registry) -> Contact:
    block = case.contacts[number]
    faces = faces_of(case, number)
    path = f"contacts.{number}.law"
    law = read_part(block.law or HARD_CONTACT, path, LAWS, registry)
    if case.solve.tolerance is not None:
        for field in dataclasses.fields(law):
            if isinstance(getattr(law, field.name), Relative):
                raise CaseError(
                    f"{field.name} is relative to the elements of a mesh, and with tolerance there is none yet",
                    remedy="Give it in SI, or leave the law out for hard contact.",
                    path=f"{path}.{field.name}",
                )
    return Contact(faces.left.point, faces.right.point, block.gap, law, block.overlap is not None)


def _integrator(case: CaseBlock, bodies: dict[str, Body], registry: Registry) -> Any:
    """Return the integrator; None where it was not given and no rod or beam may need it."""
    if case.solve.integrator is not None:
        return read_part(case.solve.integrator, "solve.integrator", INTEGRATORS, registry)
    models = [body.model for body in bodies.values() if isinstance(body, ElasticBody)]
    if models and all(model.exact for model in models if model is not None):
        return None
    return read_part(DEFAULT_INTEGRATOR, "solve.integrator", INTEGRATORS, registry)
