"""A case: read, checked, its scene and method built."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from impactlab import plugins
from impactlab.casefile.blocks.origins import Origins
from impactlab.casefile.blocks.repeat import expand
from impactlab.casefile.build import build, part_faults
from impactlab.casefile.check import check
from impactlab.casefile.document import Document, read_document
from impactlab.casefile.edit import numbered, plain, with_named, with_set, with_values
from impactlab.casefile.mechanisms import odd_mechanisms
from impactlab.casefile.path_units import unit_of
from impactlab.casefile.places import locate, placed
from impactlab.casefile.resolve import resolve
from impactlab.casefile.schema import CaseBlock
from impactlab.casefile.starter import case_file
from impactlab.casefile.text.limits import MAX_GIVEN, check_texts, check_tree
from impactlab.casefile.text.words import shown
from impactlab.casefile.text.written import yaml_text
from impactlab.casefile.values.faults import case_error
from impactlab.casefile.values.loads import folder_of, with_tables
from impactlab.errors import CaseError, ImpactlabError, combined, expect_path
from impactlab.numerics.garbage_collection import GarbageCollectionPaused
from impactlab.printing import counted, first_of
from impactlab.scene.method import Method, Simulation
from impactlab.scene.problem import Scene
from impactlab.scene.ranges import hints_of
from impactlab.startup.cached import cached_property
from impactlab.startup.lazy import above
from impactlab.startup.wall_time import spent_on

LOG = logging.getLogger("impactlab")
MIN_LOGGED = 5000  # of a case: from here on its checks take longer than a second
_said: list[bool] = []


@dataclass(frozen=True, init=False)
class Case:
    """A checked case, read from a file by `load_case` or made in Python; frozen.

    Parameters
    ----------
    bodies : mapping
        Bodies by name: `Rod`, `Beam`, `Shaft`, `Mass`, `Wall`, or blocks as in a case file.
    contacts : sequence
        `Contact`, or blocks as in a case file.
    solve : mapping
        How to solve it: ``{"duration": "1 ms", "tolerance": 1e-3}``, or model, integrator and step.
    probes : sequence
        `Probe`, or blocks as in a case file: quantities to record.
    gravity : float, str or sequence
        Along +x [m/s2], of beams along +u; (x, y) with mechanisms.
    mechanisms : mapping
        `Mechanism` by name.
    snapshots : sequence or mapping
        Times of fields [s], ``{"every": "2 us"}`` or ``{"count": 100}``.
    methods, variants : mapping
        Other ways to solve it, and other scenes: by name, each a mapping of dotted paths to values.
    title, source, metrics
        One line; where it comes from; names of metrics of plugins to measure.
    name : str
        Name of the case, for reports.
    **others
        Other keys of a case file; unknown ones are refused.

    Raises
    ------
    CaseError, PairingError, PluginError
        As for a file, with the path of the key, as in ``bodies.rod.area``.
    """

    name: str  # stem of the file
    file: str  # as it was given
    document: Document = field(repr=False)
    registry: plugins.Registry = field(repr=False, compare=False)
    checked: CaseBlock = field(repr=False, compare=False)
    built: Simulation = field(repr=False, compare=False)
    origins: Origins = field(repr=False, compare=False)  # of blocks made from repeated ones
    method_name: str = "base"
    variant_name: str = "base"
    written: Method | None = field(default=None, repr=False, compare=False)  # of a method: the case as written

    def __init__(
        self,
        *,
        bodies: Mapping[str, Mapping[str, Any]],
        contacts: Sequence[Mapping[str, Any]] = (),
        solve: Mapping[str, Any],
        probes: Sequence[Mapping[str, Any]] | None = None,
        gravity: float | str | Sequence[float | str] | None = None,
        mechanisms: Mapping[str, Mapping[str, Any]] | None = None,
        snapshots: Sequence[float | str] | Mapping[str, Any] | None = None,
        methods: Mapping[str, Mapping[str, Any]] | None = None,
        variants: Mapping[str, Mapping[str, Any]] | None = None,
        title: str | None = None,
        source: str | None = None,
        metrics: Sequence[str] | None = None,
        name: str = "case",
        **others: Any,
    ) -> None:
        given = {"title": title, "source": source, "gravity": gravity, "mechanisms": mechanisms, "probes": probes}
        given |= {"snapshots": snapshots, "metrics": metrics, "methods": methods, "variants": variants}
        blocks = {"bodies": bodies, "contacts": contacts, "solve": solve, **others}
        blocks |= {key: value for key, value in given.items() if value is not None}
        vars(self).update(vars(Case.from_dict(blocks, name)))

    @classmethod
    def from_dict(cls, blocks: Mapping[str, Any], name: str = "case") -> Case:
        """Return the case of plain values as a case file holds them.

        Raises
        ------
        CaseError, PairingError, PluginError
            As for a file, with the path of the key.
        """
        if not isinstance(blocks, Mapping):
            what = shown(blocks) if isinstance(blocks, (str, Path)) else f"a {type(blocks).__name__}"
            raise CaseError(
                f"from_dict() takes the keys of a case as a dictionary, not {what}",
                remedy="A file is read by il.load_case(PATH).",
            )
        data = {"schema_version": 1, **plain(blocks)}
        check_tree(data, MAX_GIVEN)
        return case_of(name, "", Document(data, {}))

    def to_yaml(self) -> str:
        """Return the case as a case file's text, with tables of files included."""
        with folder_of(self.file):
            return yaml_text(with_tables(self.document.data))

    def _with(self, **fields: Any) -> Case:
        """Return the same case with other values of its fields."""
        case = object.__new__(Case)
        vars(case).update({**vars(self), **fields})
        return case

    @property
    def label(self) -> str:
        """Its name, and that of the variant where one was chosen: ``mass_ratios`` or ``mass_ratios/alpha_3``."""
        return self.name if self.variant_name == "base" else f"{self.name}/{self.variant_name}"

    @property
    def title(self) -> str:
        """The title of the case, one line."""
        return self.checked.title

    @property
    def source(self) -> str:
        """Source of the case, as stated in the file."""
        return self.checked.source

    @property
    def method_names(self) -> tuple[str, ...]:
        """The methods of the case, ``base`` (the case as written) first."""
        return ("base", *self.checked.methods)

    @property
    def variant_names(self) -> tuple[str, ...]:
        """The variants of the case, ``base`` (the scene as written) first."""
        return ("base", *self.checked.variants)

    def scene(self) -> Scene:
        """Return the physics of the case, in SI."""
        return self.built.scene

    def simulation(self) -> Simulation:
        """Return the physics of the case and the method that solves it."""
        return self.built

    def with_(self, path: str, value: Any = None, **fields: Any) -> Case:
        """Return the same case with one value, or the fields of one block, changed.

        Parameters
        ----------
        path : str
            Dotted path, e.g. ``contacts.0.law``.
        value : plain value
            The new value. A dictionary is merged with the block there, unless its kind changes; a whole block, such as
            ``il.Rod(...)`` or ``il.Contact(...)``, replaces it.
        **fields
            The same as a block ``{field: value}``.
        """
        if fields and value is not None:
            raise CaseError("with_() takes a value or fields, not both", remedy="Give one of the two.", path=path)
        return self.with_settings([(path, fields or value)])

    def with_settings(self, settings: Mapping[str, Any] | Iterable[tuple[str, Any]], by: str = "with_()") -> Case:
        """Return the same case with several values changed, in order; checked once all are set.

        ``settings`` maps dotted paths to values, or gives pairs of the two; ``by`` is the option or function that gave
        them, for messages.
        """
        pairs = list(settings.items() if isinstance(settings, Mapping) else [None] if settings is None else settings)
        if not all(isinstance(pair, (tuple, list)) and len(pair) == 2 and isinstance(pair[0], str) for pair in pairs):
            raise CaseError(
                "the settings are not paths with values, such as 'solve.duration' with 1e-3",
                remedy="Write with_('solve.duration', 1e-3), or with_settings({'solve.duration': 1e-3}).",
            )
        document = with_set(self.document, pairs, by, self.file)
        variant = _make(self.name, self.file, document, self.registry)
        return variant._with(method_name=self.method_name, variant_name=self.variant_name, written=self.written)

    def method(self, name: str) -> Case:
        """Return the case under a method by name; ``base`` is the case as written."""
        if name == "base":
            return self
        return self._solved_by(name, self._located(with_named, self.document, "methods", name, self.checked.methods))

    def solved_by(self, name: str, values: Mapping[str, Any]) -> Case:
        """Return the case under a method that it does not have.

        Parameters
        ----------
        name : str
            How the method is called.
        values : mapping
            Dotted path to value, as under ``methods`` of a case: each replaces the old value.
        """
        return self._solved_by(name, self._located(with_values, self.document, "methods", name, values))

    def _solved_by(self, name: str, document: Document) -> Case:
        variant = _make(self.name, self.file, document, self.registry)
        written = self.written or self.built.method
        return variant._with(method_name=name, variant_name=self.variant_name, written=written)

    def variant(self, name: str) -> Case:
        """Return a variant of the scene by name; ``base`` is the scene as written.

        A variant changes the scene, a method its solution: so the variant is chosen first.
        """
        if name == "base":
            return self
        if self.method_name != "base":
            order = f"case.variant({name!r}).method({self.method_name!r})"
            text = f"variant {name!r} after method {self.method_name!r}. Allowed: before it, as it changes the scene"
            raise CaseError(text, remedy=f"Write {order}.")
        document = self._located(with_named, self.document, "variants", name, self.checked.variants)
        return _make(self.name, self.file, document, self.registry)._with(variant_name=name)

    @cached_property
    def hints(self) -> tuple[str, ...]:
        """Values that may be mistakes, such as wave speeds that no solid has, a sentence each."""
        return (*hints_of(self.scene(), self.built.method.laws), *odd_mechanisms(self.checked))

    def _repr_html_(self) -> str:
        shown_of = above("report.notebook").of_case
        return str(shown_of(self.label, self.title, self.built, self.method_names, self.hints))

    def _repr_pretty_(self, printer: Any, _cycle: bool) -> None:
        printer.text(repr(self))  # of IPython and hypothesis, which print the fields of a dataclass

    def __repr__(self) -> str:
        scene = self.scene()
        bodies = first_of([f"{name} ({body.kind})" for name, body in scene.bodies.items()])
        method = "" if self.method_name == "base" else f", method '{self.method_name}'"
        contacts = counted(len(scene.contacts), "contact")
        return f"<Case '{self.label}'{method}: {bodies}; {contacts}, {scene.duration:.6g} s>"

    def resolved(self) -> dict[str, Any]:
        """Return the case in SI, with every default and with derived values."""
        return resolve(self.checked, *self.built, self.document.data, self.origins)

    def unit_of(self, path: str) -> str:
        """Return the SI unit at a dotted path: ``1`` of a number, empty without one."""
        return unit_of(self.checked, self.origins.first(numbered(self.document.data, path)), self.registry)

    def locate(self, path: str) -> int | None:
        """Return the line of a dotted path, or of the nearest key above it."""
        return locate(self.document, path)

    def place(self, error: ImpactlabError) -> ImpactlabError:
        """Add file and line to an error that was raised later, and return it."""
        self.origins.led_back(error)
        return placed(error, self.file, self.document)

    def _located(self, change: Callable[..., Document], *given: Any) -> Document:
        try:
            return change(*given)
        except ImpactlabError as error:
            self.place(error)
            raise


def load_case(path: str | Path, *, registry: plugins.Registry | None = None) -> Case:
    """Return the case in a file (YAML, TOML or JSON by its ending), checked.

    Parameters
    ----------
    path : str or Path
        The case file; or the name alone, ``"axial_impact"``, of a case that comes with impactlab.
    registry : Registry, optional
        The parts it may name; those installed if not given.

    Raises
    ------
    CaseError
        If the file, a key, a value or the physics is wrong; it carries file and line.
    PluginError
        If a part it names is not installed or cannot be used.
    """
    expect_path(path, "load_case", "Of plain values a case is made by il.Case.from_dict({...}).")
    file = case_file(Path(path))
    with spent_on("reading"):
        document = read_document(file)
    return case_of(file.stem, str(file), document, registry=registry)


def case_of(
    name: str,
    file: str,
    document: Document,
    *,
    registry: plugins.Registry | None = None,
    method: str = "base",
    variant: str = "base",
    written: Method | None = None,
) -> Case:
    """Return the case in a document, with its method's and variant's names.

    Raises as `load_case`. ``written`` is the method of the case as written, where the document stands under another.
    """
    made = _make(name, file, document, registry or plugins.registry(), is_new=True)
    return made._with(method_name=method, variant_name=variant, written=written)


def expect_case(given: object, function: str) -> None:
    """Raise `CaseError` where a function was not given a case."""
    if isinstance(given, Case):
        return
    what, remedy = f"a {type(given).__name__}", "Give a Case: il.load_case(PATH), or il.Case(bodies=..., ...)."
    if isinstance(given, (str, Path)):
        what, remedy = shown(str(given)), f"Read the file first: il.load_case({str(given)[:60]!r})."
    elif isinstance(given, Mapping):
        remedy = "Make the case first: il.Case.from_dict(...)."
    raise CaseError(f"{function}() takes a Case, not {what}", remedy=remedy)


def simulation_of(case: Case | Simulation, function: str) -> Simulation:
    """Return scene and method of a case, or those that a function was given; raise `CaseError` for anything else."""
    if not (isinstance(case, tuple) and len(case) == 2):
        expect_case(case, function)
    return case.simulation() if isinstance(case, Case) else Simulation(*case)


def _checked_and_built(
    name: str, file: str, data: dict[str, Any], registry: plugins.Registry
) -> tuple[CaseBlock, Simulation]:
    """Return the checked blocks, scene and method; raise with all faults found."""
    try:
        with folder_of(file):
            checked = CaseBlock.model_validate(data)
    except ValidationError as error:
        fault = case_error(error, data, "", CaseBlock)
        raise combined([fault, *part_faults(data, registry)]) from None  # a traceback of pydantic hides the message
    try:
        return checked, build(checked, check(checked, registry), name, registry)
    except ImpactlabError as error:
        raise combined([error, *part_faults(data, registry)]) from None


def log_many_bodies(bodies: int) -> None:
    """Log once in a session that checking many bodies takes seconds."""
    if bodies < MIN_LOGGED or _said:
        return
    from multiprocessing import parent_process

    if parent_process() is None:
        _said.append(True)
        LOG.warning("checking %d bodies and their contacts: about a second for each 10000 ...", bodies)


def _make(name: str, file: str, document: Document, registry: plugins.Registry, is_new: bool = False) -> Case:
    origins = Origins()
    try:
        if is_new:  # of an edited one, new values were checked as they were put in
            check_texts(document.data)
        data, origins = expand(document.data)
        count = len(data["bodies"]) if isinstance(data.get("bodies"), dict) else 0
        log_many_bodies(count)
        with GarbageCollectionPaused(count):
            checked, built = _checked_and_built(name, file, data, registry)
    except ImpactlabError as error:
        origins.led_back(error)
        placed(error, file, document)
        raise
    case = object.__new__(Case)
    vars(case).update(name=name, file=file, document=document, registry=registry, checked=checked, built=built)
    vars(case).update(origins=origins, method_name="base", variant_name="base", written=None)
    return case
