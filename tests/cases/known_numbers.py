"""The numbers that the case files print, with their readings from the exact solution: an entry per case and variant.

A new case belongs here: `test_every_case` checks that it has an entry, its number in the text, and the value.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from impactlab.drilling import blow_of
from impactlab.history import AbstractHistory, ContactSpan
from impactlab.piling import Driven, drive
from impactlab.scene.method import Simulation

Reading = Callable[[AbstractHistory], float]


class Known(NamedTuple):
    """A number as the file writes it, its reading from a history, and its unit; T for round trips of the case."""

    text: str
    reading: Reading
    unit: float | str = 1.0


def span(history: AbstractHistory, number: int, contact: str = "") -> ContactSpan:
    """Return a period of contact, counted from the start, of all contacts or of one."""
    return [each for each in history.contacts if contact in ("", each.contact)][number]


def close(number: int, contact: str = "") -> Reading:
    """When a contact closed [s]."""
    return lambda history: span(history, number, contact).start


def opened(number: int, contact: str = "") -> Reading:
    """When a contact opened [s]."""
    return lambda history: span(history, number, contact).end or np.nan


def peak(number: int = 0, contact: str = "") -> Reading:
    """The largest force of a period of contact [N]."""
    return lambda history: span(history, number, contact).peak_force or np.nan


def touch(number: int, unit: float | str = 1.0, *, contact: str = "", **texts: str) -> tuple[Known, ...]:
    """Return the numbers of a period of contact: ``close`` and ``opened`` in a unit, ``peak`` and ``impulse``."""
    readings = {"close": close, "opened": opened, "peak": peak, "impulse": impulse}
    units = {"close": unit, "opened": unit}
    return tuple(Known(text, readings[name](number, contact), units.get(name, 1.0)) for name, text in texts.items())


def period(history: AbstractHistory) -> float:
    """Return the time from the first contact to the second [s]."""
    return history.contacts[1].start - history.contacts[0].start


def impulse(number: int = 0, contact: str = "") -> Reading:
    """The impulse of a period of contact [N s]."""
    return lambda history: span(history, number, contact).impulse


def at(channel: str, time: float = np.inf, unit: float = 1.0) -> Reading:
    """Return what a channel says at a time [s], the end if none is given."""
    return lambda history: float(history.evaluate([min(time, history.duration)], channel)[0]) * unit


def when_largest(history: AbstractHistory, channel: str) -> float:
    """Return when a force is largest [s], between its samples by a parabola; a stepped force is that of mid-step."""
    t = np.linspace(0.0, history.duration, 4001)
    values = history.evaluate(t, channel)
    i = int(np.argmax(values))
    before, here, after = values[i - 1 : i + 2]
    shift = 0.5 * (t[1] - t[0]) * (before - after) / (before - 2.0 * here + after)
    return float(t[i] + shift) + 0.5 * (history.dt or 0.0)


def lag(history: AbstractHistory) -> tuple[float, float]:
    """Return the largest lag of the tip of the beam behind the axis of its hub [m], and its time [s]."""
    t = np.arange(0.0, history.duration, 2.0 * (history.dt or 0.0))
    hub = history.evaluate(t, "angle:beam")
    x, y = (history.evaluate(t, f"position:beam.right along {along}") for along in "xy")
    behind = np.sin(hub) * x - np.cos(hub) * y
    return float(behind.max()), float(t[np.argmax(behind)])


def toe_set(history: AbstractHistory) -> float:
    """The permanent displacement of the link named toe [m]."""
    return next(link.set for link in history.links if link.name == "toe") or np.nan


def lowest_toe(history: AbstractHistory) -> float:
    """The largest displacement of the toe of the pile [m]."""
    return float(history.evaluate(np.linspace(0.0, history.duration, 20_001), "displacement:pile@20").max())


def largest(channel: str) -> Reading:
    """The largest value of a channel at 20 000 instants."""
    return lambda history: float(history.evaluate(np.linspace(0.0, history.duration, 20_001), channel).max())


@lru_cache(maxsize=1)  # of one run several numbers are read
def rest(history: AbstractHistory) -> Driven:
    """Return the motion for good and the residual forces of the blow of a run, solved again."""
    return drive(Simulation(history.scene, history.method), 1).blows[0]


T = "T"
MM, KN = 1e-3, 1e3
MS = 1e-3
US = 1e-6
HAMMER = at("velocity:hammer")
Z = 36657.74133794934  # N s/m of the paper's rod

PAPER = (  # alpha = 1: first opening, second contact, speed of the mass at the end
    Known("1.533834", opened(0), T),
    Known("2.124623", close(1), T),
    Known("2.162843", opened(1), T),
    Known("-0.698876", HAMMER),
)

KNOWN: Mapping[str, tuple[Known, ...]] = {
    "all_methods": (Known("1.533834", opened(0), T), Known("-0.698876", HAMMER)),
    "arm_on_stop": (
        *touch(0, MS, opened="0.356", peak="118.51", impulse="0.02273"),
        *touch(1, MS, close="13.369", opened="13.780", peak="74.1", impulse="0.01606"),
        *touch(2, MS, close="16.119", opened="16.584", peak="50.0", impulse="0.01220"),
    ),
    "axial_impact": (*PAPER, Known("36657.74", at("force:hammer|rod.left", 0.0)), Known("78276.57", peak())),
    "shaft_impact": (
        *PAPER,
        Known("100.771950", at("force:hammer|shaft.left", 0.0)),
        Known("215.181901", peak()),
        Known("25.192988", at("torque:shaft@0", 0.0)),
        Known("50.385975", at("torque:shaft@0.5", (1.0 + 1e-9) * 0.5 / np.sqrt(8.0e10 / 7850.0))),
    ),
    "ball_on_stepped_rod": (
        *touch(0, US, opened="61.9333", impulse="0.1185887", peak="3530.41"),
        Known("-1.582741", at("velocity:ball")),
    ),
    "beam_on_three_stops": (
        Known("5818.32", opened(0, "first|beam.at(0.2)"), US),
        *touch(0, impulse="0.603233", peak="161.188"),
        Known("199.607", close(1), US),
        Known("4783.24", opened(0, "second|beam.at(0.5)"), US),
        Known("0.450098", impulse(1)),
        *touch(2, US, close="596.723", opened="6169.21", impulse="0.561949", peak="160.875"),
    ),
    "bouncing_bar": (Known("266.667", impulse()), Known("500", peak(1))),
    "chain_of_bars": (Known("20000", peak(2)), Known("100", opened(0), US), Known("2", impulse(1))),
    "chain_of_bars/gaps": (Known("70", close(1), US), Known("140", close(2), US)),
    "chain_of_bars/tapered": (
        Known("53333.33", peak()),
        Known("35555.56", peak(1)),
        Known("23703.70", peak(2)),
        Known("11.85185", at("momentum:fourth"), 0.2),
    ),
    "damped_rod": (Known("1.464863", opened(0), T), Known("-0.677569", HAMMER), Known("0.0838785", impulse())),
    "dead_weight_preload": (
        Known("0.144949", close(0, "hammer|weight")),
        Known("2.449490", at("velocity:hammer", 0.1449489742)),
    ),
    "direct_impact": (
        Known("26611.669", at("force:striker.right|bar.left", 200e-6)),
        Known("29010.065", at("force:striker.right|bar.left", 395e-6)),
        Known("0.40973", at("gap:striker.right|bar.left", 200e-6, -1.0), MM),
        Known("0.71510", at("gap:striker.right|bar.left", 395e-6, -1.0), MM),
    ),
    "drill_rod": (
        Known("0.7330685831", lambda history: blow_of(history).first_pass),
        Known("285.398081", lambda history: blow_of(history).peak_force, KN),
        Known("1.027433093", lambda history: blow_of(history).final, MM),
    ),
    "drill_rod/passes": (
        Known("152.24", lambda history: blow_of(history).work),
        Known("0.7612", lambda history: blow_of(history).efficiency),
        Known("2.601", lambda history: blow_of(history).deepest, MM),
    ),
    "drill_string": (
        Known("190", at("energy:second", 6e-4)),
        Known("131.12", lambda history: blow_of(history).work),
        Known("1.7070", lambda history: blow_of(history).deepest, MM),
    ),
    "drill_string/tight": (
        Known("138.33", lambda history: blow_of(history).work),
        Known("1.7533", lambda history: blow_of(history).deepest, MM),
    ),
    "falling_cantilever": (
        *touch(0, US, close="24577.64", opened="33749.76", impulse="0.1387899", peak="27.645"),
        *touch(1, US, close="34561.04", opened="40088.73", impulse="0.1065770"),
        Known("89402.7", close(2), US),
        Known("95466.8", close(3), US),
    ),
    "far_end": (Known("1.290157", opened(0), T), Known("-0.365751", HAMMER)),
    "far_end/light": (Known("1.132550", opened(0), T), Known("-0.105120", HAMMER)),
    "far_end/spring": (
        Known("1.540044", close(1), T),
        *touch(2, T, close="2.241379", opened="2.540044"),
        Known("-0.817706", HAMMER),
    ),
    "far_end/stiff_spring": (*touch(1, T, close="1.068502", opened="1.629672"), Known("-0.693816", HAMMER)),
    "free_rod": (Known("0.135335", HAMMER), *touch(0, impulse="1.844330", peak="36657.74")),
    "grazing_pair": (Known("1.522066", opened(0), T), Known("-0.689446", HAMMER)),
    "grazing_pair/touches": PAPER,
    "hopkinson_aluminium": (
        Known("26572.0435", at("force:incident.right|transmission.left", 350e-6)),
        Known("29530.2722", at("force:incident.right|transmission.left", 400e-6)),
        Known("0.754483097", lambda history: history.links[0].set or np.nan, MS),
    ),
    "hopkinson_copper": (Known("27.021", at("force:incident.right|transmission.left", 395e-6), 1e3),),
    "hopkinson_ring_up": (
        Known("21640.929", at("force:specimen.right|transmission.left", 302e-6)),
        Known("37070.441", at("force:specimen.right|transmission.left", 304e-6)),
        Known("61506.934", at("force:specimen.right|transmission.left", 310e-6)),
    ),
    "hopkinson_chain": (
        *touch(0, US, close="100", peak="39496.84"),
        Known("52662.45", peak(0, "incident.right|transmission.left")),
    ),
    "hunt_crossley_ball": (
        *touch(0, US, opened="90.7124", impulse="0.1706811", peak="3652.80"),
        Known("-0.625864", at("velocity:ball")),
        Known("16.6341", lambda history: float(history.energy.booked["contact"][-1]), 1e-3),
    ),
    "mass_on_cantilever_middle": (
        *touch(0, US, opened="924.78", peak="222.978", impulse="0.1154239"),
        *touch(1, US, close="983.272", opened="1637.670", peak="88.2655", impulse="0.0328793"),
        Known("-0.483032", HAMMER),
    ),
    "mass_on_cantilever_middle/ball": (
        *touch(0, US, opened="314.103", peak="597.39"),
        *touch(1, US, close="887.17", opened="1092.82"),
    ),
    "mass_on_cantilever_tip": (
        *touch(0, US, opened="464.542", peak="271.567", impulse="0.0363204"),
        *touch(1, US, close="479.397", opened="634.265"),
        *touch(2, US, close="953.684", opened="1198.656"),
        Known("4031.84", close(3), US),
        *touch(7, US, close="6991.51", opened="7160.40"),
        Known("-0.55498", HAMMER),
    ),
    "mass_on_infinite_beam": (
        Known("0.427584", at("velocity:hammer", 1.0e-4)),
        Known("0.170578", HAMMER),
        Known("0.0714991", impulse()),
    ),
    "mass_ratios": (*PAPER, Known("2.135335", peak(), Z)),
    "mass_ratios/alpha_1_10": (
        Known("4.770529", opened(0), T),
        *touch(1, T, close="5.057101", opened="5.257990"),
        Known("-0.969839", HAMMER),
        Known("4.073679", peak(), Z),
    ),
    "mass_ratios/alpha_1_4": (
        Known("2.949795", opened(0), T),
        *touch(1, T, close="3.001071", opened="3.328632"),
        Known("-0.959266", HAMMER),
        Known("2.974410", peak(), Z),
    ),
    "mass_ratios/alpha_1_2": (
        Known("2.354284", opened(0), T),
        Known("-0.925247", HAMMER),
        Known("2.367879", peak(), Z),
    ),
    "mass_ratios/alpha_3_2": (
        Known("1.341631", opened(0), T),
        Known("-0.717669", HAMMER),
        Known("2.049787", peak(), Z),
    ),
    "mass_ratios/alpha_3": (
        Known("1.166873", opened(0), T),
        Known("-0.734848", HAMMER),
        Known("2.002479", peak(), Z),
    ),
    "mass_ratios/alpha_10": (
        Known("1.050000", opened(0), T),
        Known("-0.735759", HAMMER),
        Known("2.000000", peak(), Z),
    ),
    "measured_head": (
        Known("11.65", toe_set, MM),
        Known("14.65", lowest_toe, MM),
        Known("2.51", largest("velocity:pile@0")),
    ),
    "opening_joint": (Known("200", opened(0), US), *touch(1, US, close="275", peak="20000")),
    "periodic_bar": (Known("1/2", peak()), Known("1/2", impulse(3)), Known("3", period)),
    "ram_cushion_pile": (
        Known("2430.83", peak(0, "ram|cap"), 1e3),
        Known("2277.42", peak(0, "cap|pile.left"), 1e3),
        Known("1.106950", opened(0, "cap|pile.left"), T),
        Known("1.167185", opened(0, "ram|cap"), T),
        Known("0.491055", at("velocity:ram")),
    ),
    "pulse_shaper": (
        Known("60046.40", at("force:striker.right|incident.left", 50e-6)),
        Known("72272.44", at("force:striker.right|incident.left", 100e-6)),
        Known("72336.35", peak(0, "striker.right|incident.left")),
    ),
    "residual_blows": (
        Known("11.794", lambda history: rest(history).head, MM),
        Known("11.794", lambda history: rest(history).toe, MM),
        Known("44.5", lambda history: rest(history).toe_force or np.nan, KN),
    ),
    "rod_between_walls": (Known("200", close(0), US), Known("7899.367", peak(1))),
    "rod_on_beam": (
        *touch(0, US, opened="109.4232", peak="1090.26", impulse="0.0601140"),
        *touch(1, US, close="289.223", opened="351.498", peak="311.07", impulse="0.0110996"),
        Known("0.109830", at("momentum:rod", unit=1.0 / 0.08)),
    ),
    "rod_on_rod": (
        *touch(0, US, peak="26666.67", opened="280"),
        Known("1/9", at("force:striker.right|target.left", 2.0e-4), 80000.0 / 3.0),
    ),
    "rod_on_rod/steep": (
        *touch(0, US, peak="16000", opened="280"),
        Known("27/125", at("force:striker.right|target.left", 2.6e-4), 16000.0),
    ),
    "rod_on_rod/rebound": touch(0, US, peak="53333.33", opened="80"),
    "hammer_rod_wall": (
        Known("143.0783", close(0, "rod.right|wall"), US),
        Known("10000", peak(0, "hammer|rod.left")),
    ),
    "rod_on_spring_wall": touch(0, T, peak="7854.144", opened="1.418217"),
    "rod_on_spring_wall/soft": touch(0, T, peak="5311.775", opened="2.401681"),
    "rod_on_spring_wall/stiff": touch(0, T, peak="8000.000", opened="1.041959"),
    "rod_on_wall": touch(0, US, peak="7899.367", impulse="1.56", opened="197.4842"),
    "rotating_beam": (
        *touch(0, US, opened="957.181", peak="289.966", impulse="0.132799"),
        *touch(1, US, close="3394.43", opened="4289.85", peak="133.111", impulse="0.0539031"),
        Known("0.066489", at("velocity:sphere")),
    ),
    "rotating_beam/chord": (
        *touch(0, US, opened="957.496", impulse="0.132837"),
        *touch(1, US, close="3384.01", opened="4288.11", impulse="0.0545661"),
        Known("0.220526", at("velocity:sphere")),
    ),
    "rotating_beam/slower": (
        Known("950.983", opened(0), US),
        *touch(1, US, close="3670.54", impulse="0.044015"),
        Known("0.118965", at("velocity:sphere")),
    ),
    "rotating_beam/at_rest": (
        *touch(0, US, opened="948.944", impulse="0.131990"),
        *touch(1, US, close="3732.82", opened="4619.23", impulse="0.0402000"),
        Known("0.139049", at("velocity:sphere")),
    ),
    "rotating_rod": (
        *touch(0, T, opened="0.953207", impulse="1.423195"),
        *touch(1, T, close="1.000193", opened="1.380084", impulse="1.280461"),
        Known("1.6644", HAMMER),
    ),
    "rotating_rod/slower": (*touch(0, T, opened="1.466688", impulse="3.25469"), Known("1.0287", HAMMER)),
    "rounded_ends": touch(0, US, peak="15367.0", opened="169.5161", impulse="1.441076"),
    "rounded_ends/tip": touch(0, US, peak="12231.5", opened="229.9371", impulse="1.551394"),
    "several_masses": (
        Known("1.533834", opened(0, "left|rod.left"), 0.000116373782025236),
        Known("2.162843", opened(1, "rod.right|right"), 0.000116373782025236),
        Known("78276.57", peak()),
    ),
    "smith_pile": (
        Known("11.653", toe_set, MM),
        Known("85.8", lambda history: 1.0 / toe_set(history)),
        Known("14.653", lowest_toe, MM),
        Known("4009.9", peak(0, "helmet|pile.left"), KN),
    ),
    "slider_crank": (
        *touch(0, MS, close="7.4036", opened="7.7558", peak="5620.7", impulse="1.0382"),
        Known("4.153", at("velocity:block")),
    ),
    "sphere_on_beam": (
        Known("4.97714", peak()),
        Known("72.6", lambda history: when_largest(history, "force:sphere|beam.at(0.07675)"), US),
        Known("156.402", opened(0), US),
        Known("4.34231", impulse(), 1e-4),
        Known("-0.302324", at("velocity:sphere", unit=100.0)),
    ),
    "sphere_on_long_beam": (
        *touch(0, US, opened="434.540", peak="9.0079"),
        Known("1.474024", impulse(0), 1e-3),
        *touch(1, US, close="1336.87", opened="1782.11", peak="10.298"),
        Known("2.12703", impulse(1), 1e-3),
        *touch(2, US, close="2798.33", opened="3221.70", peak="5.604"),
        Known("1.65712", impulse(2), 1e-3),
        Known("-0.97126", at("velocity:sphere", unit=100.0)),
    ),
    "sphere_on_short_beam": (
        *touch(0, US, peak="92.0315", opened="108.106"),
        Known("-0.545152", at("velocity:sphere", unit=10.0)),
    ),
    "sphere_on_short_beam/euler_bernoulli": (
        *touch(0, US, peak="92.3854", opened="109.638"),
        Known("-0.552168", at("velocity:sphere", unit=10.0)),
    ),
    "spinning_up_beam": (
        Known("0.574", lambda history: lag(history)[0]),
        Known("6.76", lambda history: lag(history)[1]),
        Known("75.000", at("angle:beam")),
    ),
    "step_loaded_rod": (
        Known("31.74603", at("displacement:rod@0", 116.373782025236e-6), US),
        Known("0.3174603", at("energy:rod", 116.373782025236e-6)),
    ),
    "step_loaded_rod/free": (Known("10", lambda h: at("momentum:rod")(h) / h.duration, 1e3),),
    "step_loaded_rod/end_mass": (Known("147.9573", at("displacement:rod@0"), US),),
    "stepped_rod": (Known("394.968", opened(0), US), Known("7899.367", at("force:rod.right|wall", 0.0))),
    "sub_step_double_touch": (
        Known("50", opened(0), 1e-09),
        Known("116.6667", close(1), 1e-09),
        Known("199.85", opened(1), US),
        Known("199.916667", close(2), US),
        Known("24000", peak(1)),
    ),
    "tube_between_stops": (
        *touch(0, US, close="1024", opened="1761.4", impulse="0.062397"),
        *touch(1, US, close="2881.9", opened="5347.8"),
        Known("13518.9", close(0, "below|tube.right"), US),
        Known("19389.4", close(3, "below|tube.right"), US),
    ),
    "two_link_arm": (
        *touch(0, MS, opened="0.3450", peak="1282", impulse="0.23824"),
        *touch(1, MS, close="9.664", opened="10.018", peak="965", impulse="0.1855"),
    ),
    "two_material_rod": touch(0, US, opened="118.4905", peak="7899.367"),
    "two_rods": touch(0, US, opened="77.5825", impulse="0.474", peak="6109.624"),
    "viscous_end": (Known("1.556390", opened(0), T), Known("-0.394373", at("velocity:hammer", 1.9e-4))),
}
