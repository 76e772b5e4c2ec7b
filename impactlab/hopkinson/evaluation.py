"""Stress, strain and rate of a specimen by one, two and three waves.

Waves are those at its faces; stress and strain are nominal and true.

    force at the front  F1 = E1 A1 (i + r)   velocity  v1 = c1 (i - r)
    force at the back   F2 = E2 A2 t         velocity  v2 = c2 t
    waves = 1           stress F2/As                   rate (v1 - v2)/Ls with r and t alone
    waves = 2           stress F1/As                   rate (v1 - v2)/Ls with i and t alone
    waves = 3           stress (F1 + F2)/(2 As)        rate (v1 - v2)/Ls

with the strains i of the incident, r of the reflected and t of the transmitted wave at the specimen, its section As and
length Ls; E, A and c are of the incident bar (1) and of the transmission bar (2). With equal forces on both faces,
i + r = q t with q = E2 A2/(E1 A1), the three are one, and the third wave follows from the two others:

    waves = 1           rate ((q c1 - c2) t - 2 c1 r)/Ls    -2 c0 r/Ls of bars alike
    waves = 2           rate (2 c1 i - (q c1 + c2) t)/Ls    2 c0 (i - t)/Ls of bars alike
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import ImpactlabError
from impactlab.hopkinson.separation import same_length
from impactlab.hopkinson.windows import THRESHOLD
from impactlab.measurement.dispersion import Bar, expect_bar
from impactlab.measurement.inputs import (
    above_zero,
    expect,
    finite,
    row_of_numbers,
    warn_samples,
    warn_size,
    warn_unusual,
)
from impactlab.prefixes import prefixed, prefixed_range
from impactlab.startup.cached import cached_property
from impactlab.startup.lazy import above
from impactlab.types import Array
from impactlab.wrong_calls import names_parameters

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

WIDTH_TOL = 1e-6  # relative, of two diameters that are one
WINDOW = 10.0  # diameters of the bar over the wave speed, from the arrival of the incident wave on: the first rise
ARRIVAL_SHARE = 0.05  # of the largest incident strain
MAX_DENSITY = 1e4  # kg/m3, density of a specimen: above those of steel, copper and lead's alloys of tests
SHARE = 0.05  # of the force of the incident wave, by which strains of both bars may differ


@names_parameters
@dataclass(frozen=True, init=False, repr=False)
class Specimen:
    """A cylinder between two bars.

    Parameters
    ----------
    length : float or str
        Before the test [m], or a string with its unit such as ``"6 mm"``. An `UnusualValue` is issued above 0.5 m.
    diameter : float or str
        Before the test [m], likewise.

    Raises
    ------
    ImpactlabError
        If one of them is not above 0.
    """

    length: float
    diameter: float

    def __init__(self, length: float | str, diameter: float | str) -> None:
        for name, value in (("length", length), ("diameter", diameter)):
            object.__setattr__(self, name, above_zero(f"{name} of the specimen", value, "m"))
            warn_size(f"{name} of the specimen", getattr(self, name))

    def __repr__(self) -> str:
        return f"<Specimen, length {prefixed(self.length, 'm')}, diameter {prefixed(self.diameter, 'm')}>"

    @property
    def area(self) -> float:
        """Section [m2]."""
        return 0.25 * math.pi * self.diameter**2


@dataclass(frozen=True, repr=False)
class Test:
    """The waves at the faces of a specimen between two bars: strains, positive in compression.

    An `UnusualValue` is issued where a strain is above 2 %, or the time between samples above 10 us.

    Parameters
    ----------
    dt : float
        Time between samples [s].
    bar : Bar
        Both bars, or the incident one.
    incident, reflected, transmitted : Array
        Shape (n,) each, at one time base.
    transmission_bar : Bar, optional
        The transmission bar, if it is another one.

    Raises
    ------
    ImpactlabError
        If they differ in length.
    """

    __test__ = False  # no class of tests for pytest

    dt: float
    bar: Bar
    incident: Array
    reflected: Array
    transmitted: Array
    transmission_bar: Bar | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "dt", above_zero("dt", self.dt, "s"))
        for bar in self.bars:
            expect_bar(bar)
        rows = same_length(incident=self.incident, reflected=self.reflected, transmitted=self.transmitted)
        for name, row in zip(("incident", "reflected", "transmitted"), rows, strict=True):
            object.__setattr__(self, name, row)
        warn_samples(self.dt, *rows)

    def __repr__(self) -> str:
        peaks = ", ".join(
            f"{name} {1e6 * row[np.argmax(np.abs(row))]:.4g}"
            for name, row in (
                ("incident", self.incident), ("reflected", self.reflected), ("transmitted", self.transmitted)
            )
        )  # fmt: skip
        count = len(self.incident)
        length = prefixed_range(0.0, self.dt * (count - 1), "s")
        return f"<Test of {count} samples, {length}, largest strains: {peaks} µm/m>"

    @property
    def bars(self) -> tuple[Bar, Bar]:
        """The incident bar and the transmission bar."""
        return self.bar, self.bar if self.transmission_bar is None else self.transmission_bar

    @property
    def time(self) -> Array:
        """Times of the samples [s], shape (n,)."""
        return np.asarray(self.dt * np.arange(len(self.incident)))

    @property
    def forces(self) -> tuple[Array, Array]:
        """Forces on the front and on the back of the specimen [N], shape (n,) each."""
        front, back = (bar.young * bar.area for bar in self.bars)
        return front * (self.incident + self.reflected), back * self.transmitted

    def plot(self) -> Figure:
        """Return the waves at the specimen and the forces on both of its faces, over time, as a figure."""
        made: Figure = above("report.figures.evaluations").waves_of_test(self)
        return made


@dataclass(frozen=True, repr=False)
class Curve:
    """Stress, strain and rate of a specimen over time, positive in compression."""

    time: Array  # (n,) s
    strain: Array  # (n,)
    stress: Array  # (n,) Pa
    rate: Array  # (n,) 1/s

    def __repr__(self) -> str:
        if not len(self.time):
            return "<Curve without samples>"
        ranges = [(float(row.min()), float(row.max())) for row in (self.strain, self.stress, self.rate)]
        return (
            f"<Curve of {len(self.time)} samples, {prefixed_range(self.time[0], self.time[-1], 's')}: strain "
            f"{100.0 * ranges[0][0]:.3g} to {100.0 * ranges[0][1]:.4g} %, stress {prefixed_range(*ranges[1], 'Pa')}, "
            f"rate {ranges[2][0]:.4g} to {ranges[2][1]:.4g} 1/s>"
        )

    @cached_property
    def true(self) -> Curve:
        """Return true stress and strain from nominal ones, at constant volume.

        They are -ln(1 - e) and s (1 - e) of nominal ones e, s.

        Raises
        ------
        ImpactlabError
            If a nominal strain reaches 1: nothing of the specimen would be left.

        Warns
        -----
        UnusualValue
            If the strain with the largest size is negative: the curve is that of a specimen that is pulled.
        """
        if np.any(self.strain >= 1.0):
            when = float(self.time[np.argmax(self.strain >= 1.0)])
            raise ImpactlabError(
                f"the nominal strain reaches 1 at {when:.6g} s: nothing of the specimen would be left",
                remedy="Cut the curve before it, and check the length of the specimen and the signals.",
            )
        if len(self.strain) and -self.strain.min() > self.strain.max():
            warn_unusual(
                f"the strain reaches {100.0 * self.strain.min():.4g} %, so these are true curves of a specimen that is "
                "pulled. If it was compressed, give both signals with compression positive: negative ones times -1."
            )
        left = 1.0 - self.strain
        return Curve(self.time, -np.log(left), self.stress * left, self.rate / left)

    def stress_at(self, strain: ArrayLike) -> Array:
        """Return the stress [Pa] at which the loading first passes strains.

        It has the shape of ``strain``, and is NaN where the loading does not pass.
        """
        end = int(np.argmax(self.strain)) + 1 if len(self.strain) else 0
        if end < 2:
            return np.full(np.shape(strain), np.nan)
        wanted = row_of_numbers("strain", strain)
        rising = np.maximum.accumulate(self.strain[:end])
        return np.asarray(np.interp(wanted, rising, self.stress[:end], left=np.nan, right=np.nan))

    def to_pandas(self) -> pandas.DataFrame:
        """Return strain, stress [Pa] and rate [1/s] over time [s]; ``.to_csv("curve.csv")`` writes the table."""
        import pandas

        index = pandas.Index(self.time, name="time [s]")
        columns = {"strain [1]": self.strain, "stress [Pa]": self.stress, "rate [1/s]": self.rate}
        return pandas.DataFrame(columns, index=index)

    def plot(
        self, others: Mapping[str, Curve] | None = None, band: tuple[ArrayLike, ArrayLike, ArrayLike] | None = None
    ) -> Figure:
        """Return a figure of the stress over the strain.

        Parameters
        ----------
        others : mapping, optional
            Further curves by their names, such as ``{"one wave": curve}``.
        band : (array, array, array), optional
            Strain, and the lower and upper stress [Pa] there, shape (n,) each: a shaded band.
        """
        made: Figure = above("report.figures.applications").stress_strain_curves(self, others or {}, band)
        return made

    def between(self, start: float, end: float) -> Curve:
        """Return the part from ``start`` to ``end`` [s], both included."""
        start, end = finite("start", start, "s"), finite("end", end, "s")
        part = (self.time >= start) & (self.time <= end)
        return Curve(self.time[part], self.strain[part], self.stress[part], self.rate[part])


def evaluate(test: Test, specimen: Specimen, waves: Literal[1, 2, 3] = 3) -> Curve:
    """Return the nominal stress, strain and rate of a specimen; ``.true`` gives the true ones.

    Parameters
    ----------
    test : Test
    specimen : Specimen
    waves : 1, 2 or 3
        1: stress from the transmitted wave, rate from the reflected one, and of bars that differ from both. 2: stress
        from incident and reflected, rate from incident and transmitted. 3: the mean of both forces, the difference of
        both velocities.

    Raises
    ------
    ImpactlabError
        If ``waves`` is not one of them.

    Warns
    -----
    UnusualValue
        If the specimen is wider than the bar, or the forces on its two faces differ at the first rise by more than its
        momentum: records that do not begin at one instant, or wrong distances of the gauges.

    References
    ----------
    Gray2000.
    """
    _expect_test(test)
    expect(specimen, Specimen, "Give hopkinson.Specimen(length=..., diameter=...).")
    if not isinstance(waves, int) or waves not in (1, 2, 3):
        raise ImpactlabError(f"no evaluation by {waves!r} waves", remedy="Give 1, 2 or 3.")
    thinnest = min(bar.diameter for bar in test.bars)
    if specimen.diameter > thinnest * (1.0 + WIDTH_TOL):
        warn_unusual(
            f"the specimen is wider than a bar, {prefixed(specimen.diameter, 'm')} and "
            f"{prefixed(thinnest, 'm')}: its edge touches no bar. Check the units of both diameters."
        )
    warn_if_apart(test.dt, test.bar, test.incident, test.forces, specimen.area * specimen.length)
    front, back = test.forces
    incident, reflected, transmitted = test.incident, test.reflected, test.transmitted
    first, second = test.bars
    one, two = first.wave_speed / specimen.length, second.wave_speed / specimen.length
    ratio = second.young * second.area / (first.young * first.area)
    if waves == 1:
        force, rate = back, (ratio * one - two) * transmitted - 2.0 * one * reflected
    elif waves == 2:
        force, rate = front, 2.0 * one * incident - (ratio * one + two) * transmitted
    else:
        force, rate = 0.5 * (front + back), one * (incident - reflected) - two * transmitted
    strain = np.concatenate([[0.0], np.cumsum(0.5 * test.dt * (rate[1:] + rate[:-1]))])
    return Curve(test.time, strain, force / specimen.area, rate)


def _expect_test(given: object) -> None:
    """Raise `ImpactlabError` unless a function was given the waves of a test."""
    expect(given, Test, "Give the result of hopkinson.measured, of_history, or Test(dt, bar, ...).")


def equilibrium(test: Test, floor: float = THRESHOLD) -> Array:
    """Return the equilibrium ratio 2 (F1 - F2)/(F1 + F2), shape (n,).

    F1 and F2 are the forces on both faces. 0 is equilibrium, 2 a specimen that passes nothing on; NaN where the mean
    force is below ``floor`` of its largest.
    """
    _expect_test(test)
    floor = finite("floor", floor, "1")
    front, back = test.forces
    mean = 0.5 * (front + back)
    loaded = np.abs(mean) > floor * np.abs(mean).max()
    return np.divide(front - back, mean, out=np.full_like(mean, np.nan), where=loaded)


def warn_if_apart(dt: float, bar: Bar, incident: Array, forces: tuple[Array, Array], volume: float) -> None:
    """Issue an `UnusualValue` where the forces on a specimen differ too much.

    They are those on both faces, and differ by more than the specimen can take up. The impulse of their difference is
    the momentum of the specimen, whose velocity is at most twice that of the incident wave. Records that begin at
    different instants, or distances of the gauges that are wrong, move one wave against the others: for that time, at
    the first rise, the impulse is as large as that of the whole wave.

    ``incident`` are strains and ``forces`` [N] those on both faces, shape (n,) each, ``dt`` [s] apart; ``volume`` is
    that of the specimen [m3].
    """
    size = float(np.abs(incident).max())
    if size == 0.0:
        return
    first = int(np.argmax(np.abs(incident) >= ARRIVAL_SHARE * size))
    window = WINDOW * bar.diameter / bar.wave_speed
    begin, end = max(0, first - round(0.5 * window / dt)), first + max(1, round(window / dt))
    front, back = (each[begin:end] for each in forces)
    late = dt * float(np.abs(np.cumsum(front - back)).max()) / (size * bar.young * bar.area)  # s, of the incident force
    impedance = bar.young * bar.area / bar.wave_speed
    allowed = 2.0 * MAX_DENSITY * volume / impedance + SHARE * window
    if late > allowed:
        warn_unusual(
            f"up to the end of the first rise, {end * dt:.6g} s, the forces on the two faces of the "
            f"specimen differ by an impulse of {1e6 * late:.3g} us times the force of the incident "
            f"wave, and the momentum of the specimen accounts for {1e6 * allowed:.3g} us at most: "
            "check that both records begin at the same instant, and the distances of the gauges from "
            "the specimen."
        )
