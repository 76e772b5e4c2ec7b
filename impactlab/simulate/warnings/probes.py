"""Warnings of probes that miss the internal force of a load beside them.

It lies in modes left out, in a node or inside an element.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from impactlab.history.base import Warned
from impactlab.models.base import AbstractDiscreteModel
from impactlab.models.modal_body import ModalBody
from impactlab.printing import counted
from impactlab.scene.bodies import ElasticBody
from impactlab.scene.problem import Scene
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.simulate.planning.preparation import BuiltBody, left_out_per_force
from impactlab.types import Quantity

MISSING_WARN = 0.1  # of the static force at a probe per force of a load
# Of the same: less is rounding, or the error of the mesh, where the true value is 0 as at a free end.
MIN_MISSING = 1e-4


def warnings(scene: Scene, built: Mapping[str, BuiltBody]) -> Iterator[Warned]:
    """Yield a warning for each body with probes that miss internal forces.

    They are those of a load beside the probe. Modes of a free end have no force there, however many are kept, and those
    of an inner point no jump. Elements at a node without mass have the strain of a node that nothing presses. An
    element of a beam that is struck between its nodes has one shear force, where there should be two: `with_nodes_at`
    states where a mesh has no node at a contact.
    """
    for name, body in scene.elastic.items():
        model = _closed_model(built[name])
        lacking = _lacking(body, model)
        loads = {x for _, each in scene.met_by(name) for x in each.places_on(name)}
        loads |= {x for x, end in body.ends if end.is_loaded}
        found: dict[str, float] = {}
        for probe in scene.probes:
            quantity = scene.bodies[name].quantities[probe.quantity][0] if probe.body == name else "displacement"
            whole = of_unit_force(body, probe.x, quantity)
            if whole > 0.0 and loads:
                missing = max(abs(model.left_out(probe.x, quantity, x)) for x in loads) / whole
                if missing > MISSING_WARN:
                    found[probe.channel] = missing
        if found:
            worst = max(found, key=lambda channel: found[channel])
            yield Warned(
                "probe_near_load",
                f"{worst}: the {lacking} {100 * found[worst]:.0f} % of the static internal force that a "
                f"load next to it causes there{_more(found, name)}",
            )


def after(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Yield warnings for probes of beams that modes left out change.

    These probes of a moment or a shear force lack a share in the run. It is their static response to the contact force
    of each instant, beside the largest value of the probe: in a short impact the moment is that of the struck place
    alone, and far smaller than in statics.
    """
    scene, laws = history.scene, history.method.laws
    for name, body in scene.elastic.items():
        model = _closed_model(history.built[name])
        if not body.bends:
            continue
        pressing = [each for _, each in scene.met_by(name) if not laws[each.name].hard]
        found: dict[str, tuple[float, float, float]] = {}
        for probe in scene.probes:
            quantity = body.quantities[probe.quantity][0] if probe.body == name else "displacement"
            if quantity not in ("bending_moment", "shear_force"):
                continue
            whole, channel = of_unit_force(body, probe.x, quantity), history.recorded[probe.channel]
            times = np.minimum(channel.times, history.duration)
            missing, negligible = np.zeros(times.size), 0.0
            for contact in pressing:
                each = left_out_per_force(model, contact, name, probe.x, quantity)
                if abs(each) <= MISSING_WARN * whole:  # above it the probe is warned of before the run
                    force = history.evaluate(times, f"force:{contact.name}")
                    missing += each * force
                    negligible = max(negligible, MIN_MISSING * whole * float(np.abs(force).max()))
            most, largest = float(np.abs(missing).max()), float(np.abs(channel.values).max())
            if most > max(MISSING_WARN * largest, negligible) and largest > 0.0:
                found[probe.channel] = most / largest, most, largest
        if found:
            worst = max(found, key=lambda channel: found[channel])
            _, most, largest = found[worst]
            yield Warned(
                "probe_near_load",
                f"{worst}: the {_lacking(body, model)} up to {most:.3g} of it, by statics under the "
                f"contact forces of the run; its largest value is {largest:.3g}{_more(found, name)}",
            )


def _closed_model(built: BuiltBody) -> AbstractDiscreteModel:
    """Return the model of a body while its contact is closed."""
    return built.model if built.system.phases is None else built.system.phases.closed


def _lacking(body: ElasticBody, model: AbstractDiscreteModel) -> str:
    """Return which part of a model misses an internal force, with its verb."""
    if isinstance(model, ModalBody):
        return "modes kept miss"
    return "elements without a node at a load miss" if body.bends else "nodes without mass miss"


def _more(found: Mapping[str, object], body: str) -> str:
    """Return the end of a text on the worst of several probes."""
    others = len(found) - 1
    return f", and {counted(others, 'more probe')} of '{body}' miss{'es' if others == 1 else ''} some" if others else ""


def of_unit_force(body: ElasticBody, x: float, quantity: Quantity) -> float:
    """Return the size of an internal force under a static unit force; 0 for other quantities."""
    segment = body.segment_at(x)
    scales = {"force": 1.0, "shear_force": 1.0, "bending_moment": body.length, "stress": 1.0 / segment.area}
    return {**scales, "strain": 1.0 / (segment.young * segment.area)}.get(quantity, 0.0)
