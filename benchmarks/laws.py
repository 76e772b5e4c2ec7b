"""Cost per step of each registered contact law, beside a hand-written loop.

Laws run compiled and as plain Python.

The paper's case with 400 elements at half the stable step, so that stiff contacts are resolved. The hand-written loop
is that of `step_loop.py` (central difference, addition-deletion), whatever the row. "plain Python" is the same law with
``compiled = False``, called back at every step: its additional cost. Times are minima of interleaved runs.

    python benchmarks/laws.py [--repeats 20] [--elements 400] [--json]
"""

from __future__ import annotations

import argparse
import ctypes
import dataclasses
import json
import math
import time
from typing import Any

import numba
from step_loop import scene_of, time_by_hand, time_loop
from tables import figure, table

from impactlab.contact.base import AbstractContactLaw
from impactlab.errors import CaseError, PairingError
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.modal import Modal
from impactlab.numerics.addresses import call
from impactlab.numerics.law_address import LawAddress
from impactlab.plugins import LAWS, kind_of, registry
from impactlab.simulate import Plan, prepare
from impactlab.testing.verdict import options_to_try
from impactlab.types import Port, Reply

ROUND_TRIPS = 1.5  # 2400 steps of 400 elements
CALLS = 2000  # of an empty law


@numba.njit  # type: ignore[untyped-decorator]
def call_often(address: int, port: int, reply: int, times: int) -> None:
    """Call a law at an address."""
    for _ in range(times):
        call(address, port, reply)


def nothing(*_: Any) -> None:
    """Answer nothing."""


def empty_call(repeats: int) -> float:
    """Return the cost of calling back an empty law in plain Python [us]."""
    law, port, reply, least = LawAddress(nothing, as_compiled=False), Port(), Reply(), math.inf
    for _ in range(repeats + 1):
        began = time.perf_counter()
        call_often(law.value, ctypes.addressof(port), ctypes.addressof(reply), CALLS)
        least = min(least, 1e6 * (time.perf_counter() - began) / CALLS)
    return least


def settings(elements: int) -> tuple[tuple[AbstractIntegrator, AbstractRodModel | None], ...]:
    """Return integrators with the model they run on; None is the lumped mesh."""
    modal = Modal(elements=elements, modes=elements // 4)
    return (CentralDifference(), None), (Newmark(), None), (ExactModal(), modal)


def plan_of(law: AbstractContactLaw, integrator: AbstractIntegrator, model: Any, elements: int) -> Plan | None:
    """Return the run, or None where the parts cannot serve each other."""
    try:
        return prepare(*scene_of(elements, law, integrator, model, 0.5, ROUND_TRIPS))
    except (CaseError, PairingError):
        return None


def plain(law: AbstractContactLaw) -> AbstractContactLaw:
    """Return the same law, not compiled."""
    kind = type(law)
    twin = type(f"Plain{kind.__name__}", (kind,), {"compiled": False, "__doc__": kind.__doc__})
    return twin(**{field.name: getattr(law, field.name) for field in dataclasses.fields(law) if field.init})


def rows_of(elements: int) -> list[dict[str, Any]]:
    """Return one row per law, options and supported setting, with its two plans."""
    rows = []
    for name in registry().names(LAWS):
        kind = registry().load(LAWS, name)
        for options in options_to_try(kind):
            law = kind(**options)
            found = [(each, plan_of(law, *each, elements)) for each in settings(elements)]
            if any(plan for _, plan in found[:2]):
                found.pop()  # modes only for laws that need them
            for (integrator, model), plan in found:
                if plan is not None:
                    twin = plan_of(plain(law), integrator, model, elements)
                    values = {key: getattr(value, "relative", value) for key, value in options.items()}
                    shown = " ".join(f"{k}={v:g}" if isinstance(v, float) else f"{k}={v}" for k, v in values.items())
                    rows.append({"law": name, "options": shown, "plans": (plan, twin)})
    return rows


def measure(elements: int, repeats: int) -> list[dict[str, Any]]:
    """Return one row per law, options and integrator, with times per step [us].

    They are those of the loop, by hand, and of plain Python more.
    """
    rows, by_hand = rows_of(elements), prepare(*scene_of(elements, round_trips=ROUND_TRIPS, courant=0.5))
    times = [[math.inf, math.inf] for _ in rows]
    hand = math.inf
    for _ in range(repeats + 1):
        for row, least in zip(rows, times, strict=True):
            for number, plan in enumerate(row["plans"]):
                least[number] = min(least[number], 1e6 * time_loop(plan)[0] / plan.steps)
            hand = min(hand, 1e6 * time_by_hand(by_hand)[0] / by_hand.steps)
    return [
        {
            "law": row["law"],
            "options": row["options"],
            "integrator": kind_of(row["plans"][0].integrator),
            "us": compiled,
            "by_hand_us": hand,
            "ratio": compiled / hand,
            "plain_python_more_us": called - compiled,
        }
        for row, (compiled, called) in zip(rows, times, strict=True)
    ]


def shown(rows: list[dict[str, Any]]) -> str:
    """Return the rows as a Markdown table."""
    cells = []
    for row in rows:
        costs = (figure(row[name]) for name in ("us", "ratio", "plain_python_more_us"))
        cells.append((f"`{row['law']}` {row['options']}".strip(), row["integrator"], *costs))
    heads = ("law", "integrator", "us per step", "ratio", "plain Python, us more")
    return table(heads, cells, text=heads[:2])


def main() -> None:
    """Print one row per law and integrator."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--elements", type=int, default=400)
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows = measure(arguments.elements, arguments.repeats)
    print(json.dumps(rows, indent=1) if arguments.json else shown(rows))


if __name__ == "__main__":
    main()
