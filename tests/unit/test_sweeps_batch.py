"""Batches of exact runs against single runs: networks and events bit for bit, quantities to rounding; fall-backs."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab import plugins
from impactlab.contact.penalty import Penalty
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.exact.batch import marcher, points
from impactlab.exact.results.history import ContinuousHistory
from impactlab.history.arrivals import first_arrivals
from impactlab.models.continuous import Continuous
from impactlab.scene import Contact, End, Mass, Point, Rod, Segment, Wall
from impactlab.scene.bodies import Body
from impactlab.scene.method import Method, Simulation
from impactlab.scene.problem import Scene
from impactlab.sweeps import batch, counts, quantities, run
from impactlab.sweeps.chunks import ENGINES, STATUSES

pytestmark = pytest.mark.slow  # a batch takes most of a minute to compile

QUANTITIES = (*points.OF_CONTACT, *points.OF_PAIR, *points.OF_BODY, *points.OF_WHOLE)
ROUNDING = 1e-12  # of the size of a quantity


def random_rod(rng: np.random.Generator, name: str, left: bool, right: bool) -> Rod:
    """Return a rod of one or two segments; its ends that nothing touches may be held or loaded."""
    segments = []
    for _ in range(rng.integers(1, 3)):
        young, density = [(2.1e11, 7900.0), (7.0e10, 2700.0), (3.0e9, 1200.0)][rng.integers(3)]
        segments.append(Segment(rng.uniform(0.1, 0.5), 10.0 ** rng.uniform(-4.0, -3.0), young, density))
    first, mass = segments[0], sum(each.mass for each in segments)
    sizes = {"mass": mass, "spring": first.young * first.area / first.length, "dashpot": first.impedance}
    ends = []
    for touched in (left, right):
        kind: Any = "free" if touched else rng.choice(["free", "clamped", "mass", "spring", "dashpot"])
        force = 0.0 if kind == "clamped" or touched or rng.random() < 0.8 else rng.uniform(-1e3, 1e3)
        ends.append(End(kind, sizes.get(kind, 0.0) * 10.0 ** rng.uniform(-1.0, 1.0), force))
    velocity = rng.uniform(-1.0, 2.0) if all(end.kind in ("free", "mass") for end in ends) else 0.0
    return Rod(name, tuple(segments), *ends, velocity)


def random_run(rng: np.random.Generator) -> Simulation:
    """Return a row of up to four bodies in contact, hard or by springs; hard ones have a rod on one side."""
    kinds = ["rod"]
    while len(kinds) < 2 or (len(kinds) < 4 and rng.random() < 0.4):
        kind = str(rng.choice(["rod", "mass", "mass", "wall"]))
        if kinds[-1] == "wall":
            break
        kinds.append(kind)
    if rng.random() < 0.5:
        kinds.reverse()
    bodies: dict[str, Body] = {}
    for number, kind in enumerate(kinds):
        name = f"{kind}{number}"
        if kind == "rod":
            bodies[name] = random_rod(rng, name, number > 0, number < len(kinds) - 1)
        else:
            bodies[name] = (
                Wall(name) if kind == "wall" else Mass(name, 10.0 ** rng.uniform(-1.0, 1.0), rng.uniform(-2.0, 2.0))
            )
    contacts, laws = [], dict[str, Any]()
    for left, right in zip(list(bodies.values())[:-1], list(bodies.values())[1:], strict=True):
        gap = float(rng.choice([0.0, 10.0 ** rng.uniform(-6.0, -4.0)]))
        contact = Contact(Point(left.name, left.length, left.name), Point(right.name, 0.0, right.name), gap)
        contacts.append(contact)
        hard = (left.elastic or right.elastic) and rng.random() < 0.6
        damping = float(rng.choice([0.0, 1e3]))
        laws[contact.name] = (
            WaveIdentification() if hard else Penalty(stiffness=10.0 ** rng.uniform(6.0, 9.0), damping=damping)
        )
    rods = [body for body in bodies.values() if isinstance(body, Rod)]
    trip = rods[0].round_trip
    gravity = float(rng.choice([0.0, 9.81])) if rng.random() < 0.3 else 0.0
    scene = Scene("row", bodies, tuple(contacts), rng.uniform(2.0, 6.0) * trip, gravity, round_trip=trip)
    return Simulation(scene, Method(laws, {rod.name: Continuous() for rod in rods}))


def varied(rng: np.random.Generator, run: Simulation) -> Simulation:
    """Return the same scene with other numbers."""

    def other(value: float) -> float:
        return value * float(rng.uniform(0.7, 1.4))

    scene, method = run
    bodies: dict[str, Body] = {}
    for name, body in scene.bodies.items():
        if isinstance(body, Rod):
            segments = tuple(
                Segment(other(each.length), other(each.area), other(each.young), other(each.density))
                for each in body.segments
            )
            ends = [
                dataclasses.replace(end, value=other(end.value), force=other(end.force))
                for end in (body.left, body.right)
            ]
            bodies[name] = Rod(name, segments, *ends, other(body.velocity))
        elif isinstance(body, Mass):
            bodies[name] = Mass(name, other(body.mass), other(body.velocity))
        else:
            bodies[name] = body
    contacts = []
    for contact in scene.contacts:
        left = scene.bodies[contact.left.body]
        moved = Point(contact.left.body, bodies[left.name].length, contact.left.label)
        contacts.append(dataclasses.replace(contact, left=moved, gap=other(contact.gap)))
    laws = {
        name: law if law.hard else dataclasses.replace(law, stiffness=other(law.stiffness), damping=other(law.damping))  # type: ignore[attr-defined, type-var]
        for name, law in method.laws.items()
    }
    trip = next(body.round_trip for body in bodies.values() if isinstance(body, Rod))
    changed = dataclasses.replace(
        scene, bodies=bodies, contacts=tuple(contacts), duration=other(scene.duration), round_trip=trip
    )
    return Simulation(changed, dataclasses.replace(method, laws=laws))


def counted(scene: Scene) -> str:
    return next(name for name, body in scene.bodies.items() if body.elastic is not None)


def batch_of(runs: list[Simulation]) -> tuple[marcher.Marcher, list[marcher.Built]]:
    """Return the batch of runs of one pattern: their whole vectors are the values of one axis."""
    made = [marcher.built(run, counted(run.scene), None) for run in runs]
    built = [each for each in made if each is not None]
    size = len(built[0].vector)
    numbers = points.Numbers(
        built[0].vector, np.array([1]), np.array([len(runs)]), np.array([0, size]), np.arange(size), np.array([0]),
        np.concatenate([each.vector for each in built]),
    )  # fmt: skip
    return marcher.Marcher(runs[0], built[0].pattern, numbers), built


def values_of(history: ContinuousHistory) -> dict[str, list[float]]:
    """Return each quantity of a single run, in the order of the scene."""
    found = {}
    for name in QUANTITIES:
        value: Any = getattr(quantities, name)(history.scene, history)
        function: Any = getattr(quantities, name)
        labels = quantities.labels_of(history.scene, function.over)
        found[name] = [value.get(label, np.nan) for label in labels] if labels else [value]
    return found


def in_order(row: Any, pattern: Any) -> dict[str, list[float]]:
    """Return the results of a point of a batch by quantity."""
    found, at = {}, 0
    for names, count in marcher.parts_of(pattern):
        for number, name in enumerate(names):
            found[name] = row[at + number : at + len(names) * count : len(names)].tolist()
        at += len(names) * count
    return found


@pytest.mark.parametrize("seed", range(12))
def test_random_scenes_have_the_networks_events_and_quantities_of_single_runs(seed):
    rng = np.random.default_rng(seed)
    first = random_run(rng)
    try:
        il.run(first)
    except il.ImpactlabError:
        return  # a scene that the solver refuses
    runs = [first]
    while len(runs) < 4:
        other = varied(rng, first)
        try:
            il.run(other)
        except il.ImpactlabError:
            continue
        runs.append(other)
    march, built = batch_of(runs)
    rows, states = march.results(np.arange(4), sum(points.WANTED.values()))
    for number, each in enumerate(runs):
        if not built[number].pattern.same_as(built[0].pattern):
            continue
        assert marcher.same_network(march.network(number), built[number].log)
        history = il.run(each)
        assert isinstance(history, ContinuousHistory)
        march.results(np.array([number]), points.BARE)
        count = int(history.log.state["events"])
        assert int(march.log.state["events"]) == count
        assert np.array_equal(march.log.events[:count], history.log.events[:count])  # bit for bit
        if states[number] != points.SERVED:
            continue
        march.results(np.array([number]), points.PEAKS)
        places, arrivals = np.asarray(march.pattern.contacts)["place"], first_arrivals(*each)
        soonest = [arrivals[each.scene.contacts[place].name] for place in places]
        assert march.room.arrivals[: len(places)] == pytest.approx(soonest, rel=1e-12)
        mine, wanted = in_order(rows[number], march.pattern), values_of(history)
        for name in ("contacts", "first_opening", "time_in_contact", "near_grazing"):
            assert np.array_equal(mine[name], wanted[name], equal_nan=True), name
        bodies = [body for body in each.scene.bodies.values() if body.moves]
        speed = max(float(history.log.state["fastest"]), *(abs(body.velocity) for body in bodies))
        # A gain is a share of the energy at stake; bodies that drift together carry many times that, which rounds.
        scales = {"final_velocity": speed, "restitution": 1.0, "energy_gain": history.energy.rounding}
        scales["final_momentum"] = speed * max(body.moving_mass for body in bodies)
        for name in set(QUANTITIES) - {"near_grazing", "contacts", "first_opening"}:
            scale = max(scales.get(name, 0.0), np.nanmax(np.abs(wanted[name]), initial=0.0))
            np.testing.assert_allclose(mine[name], wanted[name], rtol=0.0, atol=ROUNDING * scale, err_msg=name)


PAPER = il.load_case(Path(__file__).parents[2] / "cases" / "axial_impact.yaml")
MASS, GAP = "bodies.hammer.mass", "contacts.0.gap"


@pytest.fixture
def small(monkeypatch):
    """Let small sweeps be batches, too."""
    monkeypatch.setattr(batch, "MIN_POINTS", 2)


def engines(found: Any) -> set[str]:
    return {ENGINES[number] for number in np.unique(found["engine"]).tolist()}


@pytest.mark.parametrize(
    ("path", "values"),
    [
        ("bodies.rod.length", np.linspace(0.3, 0.9, 30)),
        ("bodies.rod.material.young", np.geomspace(7e10, 3e11, 30)),
        ("bodies.rod.material.density", np.geomspace(2e3, 2e4, 30)),
        ("bodies.hammer.velocity", np.linspace(0.0, 2.0, 30)),
        ("solve.duration", [3e-4, 3.5e-4]),
        ("contacts.0.gap", ["0 mm", "0.1 mm"]),
        ("gravity", [0.0, 9.81]),
        ("bodies.rod.ends.right.spring", [1e7, 1e8, 1e9]),
    ],
)
def test_any_numeric_axis_is_a_batch(small, path, values):
    case = PAPER.method("continuous")
    if path.endswith("spring"):
        case = case.with_("bodies.rod.ends.right", {"spring": 1e8})
    found = il.sweep(case, {path: values}, quantities=QUANTITIES)
    assert engines(found) == {"batch"}
    for place in (0, 1, len(values) - 1):
        value = values[place].item() if isinstance(values, np.ndarray) else values[place]
        history = il.run(case.with_(path, value))
        point = found.isel({path: place})
        assert point["first_opening"].item() == history.contacts[0].end if history.contacts else True
        assert point["contacts"].item() == len(history.contacts)
        assert point["impulse"].item() == pytest.approx(sum(each.impulse for each in history.contacts), rel=1e-12)


def test_axes_of_a_grid_are_composed_and_a_changed_number_of_two_axes_is_no_batch(small):
    case = PAPER.method("continuous")
    over = {
        "bodies.rod.length": [0.3, 0.35, 0.5],
        "bodies.rod.area": [5e-4, 9e-4],
        "bodies.rod.material.young": [1e11, 2e11],
    }
    found = il.sweep(case, {**over, MASS: [1.0, 2.0]}, quantities=["first_opening", "final_velocity"])
    assert engines(found) == {"batch"}
    for place in [(0, 0, 0, 0), (2, 1, 1, 0), (1, 0, 1, 1)]:
        settings = {path: found[path].values[k].item() for path, k in zip(found["status"].dims, place, strict=True)}
        history = il.run(case.with_settings(settings))
        assert found["first_opening"].sel(settings).item() == history.contacts[0].end
    soft = case.with_("contacts.0.law", {"kind": "penalty", "stiffness": {"relative": 1.0}})
    both = {"contacts.0.law.stiffness.relative": [0.5, 1.0], "bodies.rod.material.young": [1e11, 2e11]}
    found = il.sweep(soft, both, quantities=["peak_force"])
    assert engines(found) == {"run"}
    assert engines(il.sweep(soft, {"contacts.0.law.stiffness.relative": [0.5, 1.0]}, quantities=["peak_force"])) == {
        "batch"
    }


def test_a_striker_that_touches_a_third_body_meanwhile_has_no_restitution_and_is_a_batch(small):
    bodies = {
        "hammer": il.Mass("1 kg", velocity="1 m/s"),
        "rod": il.Rod(length="0.5 m", area="2.5 cm^2", material={"young": "200 GPa", "density": 8000}),
        "wall": il.Wall(),
    }
    hard = {"kind": "wave_identification"}
    contacts = [il.Contact("hammer", "rod.left", hard), il.Contact("rod.right", "wall", hard)]
    solve = {"duration": {"round_trips": 6}, "model": {"kind": "continuous"}}
    case = il.Case(bodies=bodies, contacts=contacts, solve=solve)
    over = {"bodies.hammer.mass": [0.1, 1.0], "contacts.1.gap": ["0 mm", "0.3 mm"]}
    found = il.sweep(case, over, quantities=["restitution", "contacts"])
    assert engines(found) == {"batch"}
    for place in np.ndindex(2, 2):
        settings = {path: values[k] for (path, values), k in zip(over.items(), place, strict=True)}
        whole = il.run(case.with_settings(settings))
        alone = quantities.restitution(whole.scene, whole)
        for pair, point in zip(("hammer|rod", "rod|wall"), found["restitution"].values[place], strict=True):
            assert point == pytest.approx(alone.get(pair, np.nan), rel=1e-12, nan_ok=True)
            assert place[1] == 1 or np.isnan(point)  # without a gap the hammer is still at the rod
    assert np.isfinite(found["restitution"].values[:, 1, 0]).all()
    assert np.isfinite(found["restitution"].values[1, 1, 1])


def test_a_striker_met_by_a_driven_body_has_no_restitution_and_is_a_batch(small):
    """The rod drives the mass at its other end; with a gap of 0.1 mm the hammer has left the rod by then."""
    bodies = {
        "hammer": il.Mass("1 kg", velocity="1 m/s"),
        "rod": il.Rod(length="0.3 m", area="9 cm^2", material="steel"),
        "end": il.Mass("0.2 kg"),
    }
    hard = {"kind": "wave_identification"}
    contacts = [il.Contact("hammer", "rod.left", hard, gap="0.1 mm"), il.Contact("rod.right", "end", hard)]
    solve = {"duration": {"round_trips": 4}, "model": {"kind": "continuous"}}
    case = il.Case(bodies=bodies, contacts=contacts, solve=solve)
    over = {"contacts.1.gap": ["0 mm", "0.1 mm"], "bodies.end.mass": [0.1, 0.2]}
    found = il.sweep(case, over, quantities=["restitution"])
    assert engines(found) == {"batch"}
    values = found["restitution"].sel(pair="rod|end").values
    assert np.isnan(values[0]).all()
    assert np.isfinite(values[1]).all()
    whole = il.run(case.with_settings({"contacts.1.gap": "0.1 mm", "bodies.end.mass": 0.1}))
    assert values[1, 0] == pytest.approx(quantities.restitution(whole.scene, whole)["rod|end"], rel=1e-12)


def test_a_batch_that_differs_from_a_run_is_logged(small, monkeypatch, caplog):
    @quantities.quantity("N s", quantities.CONTACT)
    def impulse(_scene: Scene, _history: Any) -> dict[str, float]:
        """Another one."""
        return {"hammer|rod.left": 1.0}

    monkeypatch.setattr(quantities, "impulse", impulse)
    monkeypatch.setitem(PAPER.registry._loaded, (plugins.QUANTITIES.name, "impulse"), impulse)
    found = il.sweep(PAPER.method("continuous"), {MASS: [1.0, 2.0]}, quantities=["impulse"])
    assert engines(found) == {"run"}
    assert "impulse of point 0" in caplog.text
    assert "please report" in caplog.text


@pytest.mark.parametrize(
    ("method", "over", "wanted"),
    [
        ("continuous", {"contacts.0.law.kind": ["wave_identification", "addition_deletion"]}, ["impulse"]),
        ("continuous", {MASS: [1.0, 2.0]}, ["impulse", il.Sampled("force:hammer|rod.left", [1e-5])]),
        ("penalty", {MASS: [1.0, 2.0]}, ["impulse"]),
    ],
)
def test_words_channels_and_stepped_runs_are_no_batch(small, method, over, wanted):
    case = PAPER.method(method).with_("solve.duration", 1e-4) if method == "penalty" else PAPER.method(method)
    found = il.sweep(case, over, quantities=wanted)
    assert engines(found) == {"run"}
    assert counts(found) == {"completed": 2}


def test_points_that_a_batch_leaves_are_runs_with_their_status(small):
    case = PAPER.method("continuous").with_("contacts.0.law", {"kind": "penalty", "stiffness": 1e9})
    stiff = np.array([1e8, 1e9, 1e24, 1e10])
    found = il.sweep(case, {"contacts.0.law.stiffness": stiff}, quantities=["peak_force", "energy_gain"])
    assert found["engine"].values.tolist() == [ENGINES.index(name) for name in ("batch", "batch", "run", "batch")]
    assert found["status"].values.tolist() == [
        STATUSES.index(name) for name in ("completed", "completed", "failed", "completed")
    ]
    assert np.isnan(found["peak_force"].values[2, 0])
    assert "rounding errors" in str(found["reason"].values[2]) or "fast" in str(found["reason"].values[2])


def test_a_grid_with_a_refused_corner_is_no_batch(small):
    case = il.load_case("hammer_rod_wall")
    grid = {"bodies.rod.material.density": [8000.0, 1e-9], "bodies.rod.material.young": [2e11, 1e20]}
    found = il.sweep(case, grid, quantities=["impulse"])
    assert engines(found) == {"run"}
    assert counts(found).get("refused") == 1


def test_faces_that_fall_together_are_not_near_grazing(small):
    """A helmet falls with the rod it rests on until a hammer meets it: their gap is 0, and no slow meeting ends it."""
    rod = {"kind": "rod", "length": 0.1, "area": 5e-4, "material": {"young": 2e11, "density": 8000.0}}
    bodies = {"hammer": {"kind": "mass", "mass": 1.0, "velocity": 2.0}, "helmet": {"kind": "mass", "mass": 0.5}}
    contacts = [{"between": ["hammer", "helmet"], "gap": 3e-4, "law": {"kind": "penalty", "stiffness": 2e8}},
                {"between": ["helmet", "rod.left"], "law": {"kind": "addition_deletion"}}]  # fmt: skip
    case = il.Case.from_dict(
        {"schema_version": 1, "bodies": {**bodies, "rod": rod}, "contacts": contacts, "gravity": 3.7,
         "solve": {"duration": 4e-4, "model": {"kind": "continuous"}}}
    )  # fmt: skip
    found = il.sweep(case, {GAP: np.linspace(3e-4, 6e-4, 300)}, quantities=["near_grazing"])
    assert engines(found) == {"batch"}
    assert not found["near_grazing"].values.any()


def test_rods_that_part_at_rest_and_fall_together_are_not_near_grazing(small):
    """The impact stops the first of two equal rods; both faces then fall alike: rounding of their gap was a near miss.

    No batch was computed, or it differed from single runs at some points.
    """
    rod = {"kind": "rod", "area": 1e-4, "material": {"young": 2e11, "density": 8000.0}}
    bodies = {"one": {**rod, "length": 0.3, "velocity": 1.0}, "other": {**rod, "length": 0.4}}
    case = il.Case.from_dict(
        {"schema_version": 1, "bodies": bodies, "gravity": 9.81,
         "contacts": [{"between": ["one.right", "other.left"], "law": {"kind": "addition_deletion"}}],
         "solve": {"duration": 8e-5, "model": {"kind": "continuous"}}}
    )  # fmt: skip
    assert il.run(case.with_("bodies.one.length", 0.1557)).warnings == []
    found = il.sweep(case, {"bodies.one.length": np.linspace(0.15, 0.159, 300)}, quantities=["near_grazing"])
    assert engines(found) == {"batch"}
    assert not found["near_grazing"].values.any()


def test_bits_do_not_depend_on_chunks_workers_or_interruptions(small, tmp_path, monkeypatch):
    case, over = PAPER.method("continuous"), {MASS: np.geomspace(0.2, 20.0, 150), GAP: [0.0, 1e-4]}
    whole = il.sweep(case, over, quantities=QUANTITIES)
    assert engines(whole) == {"batch"}
    monkeypatch.setattr(run, "size_of_chunk", lambda *_: 7)
    assert whole.equals(il.sweep(case, over, quantities=QUANTITIES, workers=2))
    done = []

    def interrupt(fraction: float) -> None:
        done.append(fraction)
        if len(done) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        il.sweep(case, over, quantities=QUANTITIES, out=tmp_path, progress=interrupt)
    assert counts(il.open_sweep(tmp_path))["missing"] == 300 - 21
    assert whole.equals(il.sweep(case, over, quantities=QUANTITIES, out=tmp_path))
