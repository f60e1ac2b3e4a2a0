"""The JSON Schemas in docs/schemas: those of the present types, and true of what is written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fjr_cli.schemas import DOCUMENTS, schemas

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize(("name", "text"), list(schemas()))
def test_a_published_schema_is_that_of_the_present_type(name, text):
    file = DOCS / "schemas" / name
    assert file.is_file() and file.read_text(encoding="utf-8") == text, (
        f"{name} is stale; renew it: python -m fjr_cli.schemas docs/schemas"
    )


def test_no_schema_is_left_of_what_is_no_longer_written():
    assert {file.name for file in (DOCS / "schemas").iterdir()} == {name for name, _ in schemas()}


def test_every_schema_names_its_document_first():
    for model in DOCUMENTS.values():
        schema = model.model_json_schema(mode="serialization")
        assert next(iter(schema["properties"])) == "schema" and "schema" in schema["required"]


def test_the_schema_shows_units():
    result = json.loads((DOCS / "schemas" / "result.schema.json").read_text("utf-8"))
    level, bla = (result["$defs"][name]["properties"] for name in ("LevelResult", "BlaEstimate"))
    assert level["torque_peak_nm"]["unit"] == "N m"
    assert bla["g"]["properties"]["unit"]["const"] == "rad/(N m)"
    assert set(bla["g"]["required"]) == {"unit", "re", "im"}
