"""The JSON schema is committed; every field has a description, and every length and mass its unit."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from impactlab.casefile.jsonschema import case_schema
from impactlab.casefile.schema import CaseBlock
from impactlab.plugins import registry

COMMITTED = Path(__file__).parents[2] / "docs" / "case.schema.json"


@pytest.fixture(scope="module")
def schema():
    return case_schema(registry().only("impactlab"))


def test_the_committed_schema_is_that_of_the_code(schema):
    committed = json.loads(COMMITTED.read_text(encoding="utf-8"))
    assert committed == json.loads(json.dumps(schema)), "run: impactlab schema --builtin > docs/case.schema.json"


def test_every_field_has_a_description(schema):
    blocks = {"case": schema, **schema["$defs"]}
    for name, block in blocks.items():
        for key, field in block["properties"].items():
            assert field.get("description"), f"{name}.{key} has no description"
        assert block["additionalProperties"] is False


def test_the_fields_of_parts_are_in_the_schema(schema):
    laws = {
        part["properties"]["kind"]["const"]: part
        for part in schema["$defs"]["ContactBlock"]["properties"]["law"]["oneOf"]
    }
    assert {"penalty", "wave_identification", "addition_deletion", "impulse_momentum"} <= set(laws)
    stiffness = laws["penalty"]["properties"]["stiffness"]
    assert stiffness["unit"] == "N/m"
    assert stiffness["description"]


def test_models_of_the_format_are_frozen_and_closed():
    def blocks(kind):
        for block in kind.__subclasses__():
            yield block
            yield from blocks(block)

    for block in blocks(CaseBlock.__mro__[1]):
        assert block.model_config["frozen"], block
        assert block.model_config["extra"] == "forbid", block
