"""Memory of bodies in the coordinates of their models, estimated before they are built."""

from __future__ import annotations

from collections import Counter

from impactlab.errors import CaseError
from impactlab.integrators.base import AbstractAdaptive
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene.bodies import ElasticBody
from impactlab.scene.method import Method, modelled
from impactlab.scene.problem import Scene
from impactlab.scene.sizes import check_memory, fits

MESH = 44.0  # numbers per coordinate of a mesh: nodes, materials, three matrices and their factors
BAND = 9.0  # numbers per coordinate and band
PORT = 8.0  # numbers per coordinate and contact: its row, its responses
DENSE = 5.0  # square matrices of the mesh behind modes
MAX_BEAM_MODES = 5000  # analytic ones, 0.15 ms each to find


def check_bodies(scene: Scene, method: Method) -> float:
    """Return the count of numbers in memory for bodies in coordinates.

    Raises `CaseError` if they are too many, before any body is built.
    """
    ports = Counter(point.body for point in scene.faces)
    adaptive = isinstance(method.integrator, AbstractAdaptive)
    total, largest, count_of_bodies, named, field = 0.0, 0.0, 0, "", ""
    for body, model in modelled(scene, method):
        count, numbers, text = _described(body, model, ports[body.name])
        if adaptive:
            numbers += 3.0 * (2.0 * count) ** 2
            text += " under an adaptive integrator, whose matrices are full,"
        total += numbers
        count_of_bodies += numbers > 0.0
        if numbers > largest:
            largest, named, field = numbers, f"{text} of '{body.name}'", _field(model)
    if not fits(total):
        if count_of_bodies > 1:
            named = f"{count_of_bodies} bodies in coordinates, the largest with {named},"
        check_memory(total, named, f"solve.model{field}", "Give fewer.")
    return total


def _described(body: ElasticBody, model: AbstractRodModel, ports: int) -> tuple[float, float, str]:
    """Return a description's coordinates and numbers in memory, and its text.

    Counts are zero where they are not known.
    """
    each = body.coordinates_per_node
    if isinstance(model, FiniteElement):
        elements = max(model.elements, len(body.segments))
        count = float(each * elements * model.order + each)
        bands = 4 if each == 2 else model.order + 1
        text = f"{elements} elements" + (f" of order {model.order}" if model.order > 1 else "")
        return count, count * (MESH + BAND * bands + PORT * ports), text
    if isinstance(model, Modal) and model.elements is not None:
        count = float(each * max(model.elements, len(body.segments)) * model.order + each)
        modes = min(float(model.modes or count), count)
        return modes, DENSE * count**2 + PORT * ports * modes, f"{model.elements} elements behind modes"
    if isinstance(model, Modal):
        if each == 2 and (model.modes or 1) > MAX_BEAM_MODES:
            raise CaseError(
                f"{model.modes} analytic modes of a beam are found one by one. Allowed: up to {MAX_BEAM_MODES}",
                remedy="Give fewer.",
                path="solve.model.modes",
            )
        modes = float(model.modes or 1)
        return modes, modes * (MESH + PORT * ports), f"{model.modes} modes"
    return 0.0, 0.0, ""


def _field(model: AbstractRodModel) -> str:
    return ".modes" if getattr(model, "elements", None) is None else ".elements"
