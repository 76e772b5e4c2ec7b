"""Materials that a case may name instead of giving their constants."""

from __future__ import annotations

from typing import Any, NamedTuple

from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import core_schema

from impactlab.casefile.text.words import shown
from impactlab.casefile.values.faults import refuse
from impactlab.errors import closest


class Constants(NamedTuple):
    """Typical elastic constants and density at room temperature, within some percent."""

    young: float  # Pa
    poisson: float
    density: float  # kg/m3
    source: str


_KAYE_LABY = "Kaye and Laby, Tables of Physical and Chemical Constants, 16th ed. 1995, elastic constants"
MATERIALS = {
    "steel": Constants(210e9, 0.30, 7850.0, "EN 1993-1-1:2005, 3.2.6; EN 1991-1-1:2002, table A.4"),
    "aluminium": Constants(70e9, 0.30, 2700.0, "EN 1999-1-1:2007, 3.2.5"),
    "titanium": Constants(110.3e9, 0.31, 4430.0, "Ti-6Al-4V: MIL-HDBK-5J 2003, table 5.4.1"),
    "brass": Constants(100.6e9, 0.35, 8500.0, f"70 % Cu, 30 % Zn: {_KAYE_LABY}"),
    "copper": Constants(129.8e9, 0.343, 8930.0, _KAYE_LABY),
    "tungsten": Constants(411.0e9, 0.28, 19300.0, _KAYE_LABY),
    "glass": Constants(71.3e9, 0.22, 2500.0, f"crown glass: {_KAYE_LABY}"),
    "concrete": Constants(30e9, 0.20, 2400.0, "C20/25, without reinforcement: EN 1992-1-1:2004, table 3.1, 3.1.3"),
    "pmma": Constants(
        3.0e9, 0.35, 1190.0, "slow loading, stiffer under impact: Ashby and Jones, Engineering Materials 1"
    ),
}


class Named:
    """A pydantic annotation: a material is a block or a name of `MATERIALS`."""

    def __get_pydantic_core_schema__(self, source: type[BaseModel], handler: GetCoreSchemaHandler) -> Any:
        return core_schema.no_info_before_validator_function(lambda given: _read(source, given), handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"anyOf": [{"enum": list(MATERIALS)}, handler(schema)]}


def _read(block: type[BaseModel], given: Any) -> Any:
    """Return a block with its constants in place of a material's name."""
    if not isinstance(given, str):
        return given
    if given not in MATERIALS:
        keys = ", ".join(block.model_fields)
        raise refuse(
            f"{shown(given)} is not the name of a material.{closest(given, MATERIALS)} "
            f"Allowed: {', '.join(MATERIALS)}, or a block of {keys}"
        )
    constants = MATERIALS[given]._asdict()
    return {key: constants[key] for key in block.model_fields if key in constants}


NAMED = Named()
