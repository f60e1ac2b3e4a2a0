"""Types of results: what they take, what they write, and what they refuse to read."""

from __future__ import annotations

import json
from typing import Annotated, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, ValidationError

from fjr_kit.check import Check, failed
from fjr_kit.errors import InputError
from fjr_kit.result_types import (
    Array,
    Document,
    EqualArrays,
    FreeForm,
    Number,
    OptionalNumber,
    Unit,
    units,
)


class Lines(EqualArrays):
    frequency_hz: Annotated[np.ndarray, Array("Hz")]
    g: Annotated[np.ndarray, Array("rad", complex)]
    count: Annotated[np.ndarray, Array("1", int)]
    reliable: Annotated[np.ndarray, Array("bool", bool)]


class Found(Document):
    schema_name: Literal["fjr_rig/found/1"] = Field("fjr_rig/found/1", alias="schema")
    rms: Annotated[Number, Unit("N m")] = 0.0
    share: OptionalNumber = None
    lines: Lines | None = None
    settings: FreeForm = Field(default_factory=dict)


LINES = {
    "frequency_hz": np.array([1.0, np.inf]),
    "g": np.array([complex(np.nan, -0.0), complex(-np.inf, 1.0)]),
    "count": np.array([3, -4]),
    "reliable": np.array([True, False]),
}


@given(st.floats() | st.just(float("nan")))
def test_any_number_is_read_back_bit_for_bit(value):
    back = Found.from_json(Found(rms=value).to_json(), "x").rms
    assert (
        np.float64(back).tobytes() == np.float64(value).tobytes() or np.isnan([back, value]).all()
    )


def test_arrays_of_every_kind_are_read_back():
    back = Found.from_json(Found(lines=Lines(**LINES)).to_json(), "x").lines
    for name, array in LINES.items():
        read = getattr(back, name)
        assert read.dtype == array.dtype and np.array_equal(
            read.view(np.uint8), array.view(np.uint8)
        ), name


def test_numbers_of_numpy_become_plain_ones():
    found = Check(name="a", passed=np.bool_(True), value=np.float32(0.5), limit=1, sentence="")
    assert type(found.passed) is bool and type(found.value) is float and type(found.limit) is float


def test_what_is_not_finite_is_no_optional_number():
    assert Found(share=float("nan")).share is None and Found(share=0.5).share == 0.5


def test_free_form_says_what_json_has_not():
    given_ = {"limit": np.inf, "gain": np.nan, "taps": np.array([1.0, -np.inf]), "n": np.int64(2)}
    written = json.loads(Found(settings=given_).to_json())["settings"]
    assert written == {"limit": "Infinity", "gain": "NaN", "taps": [1.0, "-Infinity"], "n": 2}


@pytest.mark.parametrize(
    "changes",
    [
        {"g": np.zeros((2, 1), complex)},
        {"count": np.zeros(3, int)},
        {"reliable": [True, False]},
    ],
)
def test_arrays_that_do_not_fit_are_refused(changes):
    with pytest.raises(ValidationError):
        Lines(**(LINES | changes))


def test_an_array_that_would_lose_its_values_is_refused():
    with pytest.raises(TypeError):
        Lines(**(LINES | {"frequency_hz": np.zeros(2, complex)}))
    with pytest.raises(TypeError):
        Lines(**(LINES | {"count": np.array([0.5, 1.0])}))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{}", "schema: is missing"),
        ('{"schema": "fjr_rig/found/2"}', "schema"),
        ('{"schema": "fjr_rig/found/1", "rms": "1.0"}', "rms"),
        ('{"schema": "fjr_rig/found/1", "rms": NaN}', "rms"),
        (
            '{"schema": "fjr_rig/found/1", "lines": {"frequency_hz": {"unit": "s", "values": []}}}',
            "lines.frequency_hz.unit",
        ),
        ("[", "Invalid JSON"),
    ],
)
def test_what_is_no_such_document_is_refused_in_one_sentence(tmp_path, text, says):
    file = tmp_path / "found.json"
    file.write_text(text)
    with pytest.raises(InputError) as refused:
        Found.read(file)
    said = str(refused.value)
    assert str(file) in said and "fjr_rig/found/1" in said and says in said and "\n" not in said


def test_keys_that_are_not_known_are_ignored():
    assert Found.from_json('{"schema": "fjr_rig/found/1", "later": 1}', "x").rms == 0.0


def test_units_are_found_by_name_and_shown_by_the_schema():
    assert units(Found) == {
        "rms": "N m", "frequency_hz": "Hz", "g": "rad", "count": "1", "reliable": "bool"
    }  # fmt: skip
    schema = Found.model_json_schema(mode="serialization")
    assert schema["properties"]["rms"]["unit"] == "N m"
    lines = schema["$defs"]["Lines"]["properties"]
    assert lines["g"]["properties"]["unit"]["const"] == "rad"
    assert lines["count"]["properties"]["values"]["items"] == {"type": "integer"}


def test_results_do_not_change():
    with pytest.raises(ValidationError):
        Found().rms = 1.0


def test_failed_checks_keep_their_order():
    a, b, c = (
        Check(name=name, passed=name == "b", value=0.0, limit=0.0, sentence="") for name in "abc"
    )
    assert failed([a, b, c]) == (a, c)
