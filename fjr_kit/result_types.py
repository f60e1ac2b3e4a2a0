"""Results as pydantic types with units, written as strict JSON and read back bit for bit.

A result is a `ResultModel`: frozen, its fields typed, the unit of a field beside its type, so that
the JSON Schema shows it. A file is a `Document`: a result whose first key names its schema.

JSON has no NaN and no infinity: NaN (unknown) is null, infinities are the strings "Infinity" and
"-Infinity". A numpy array is an object of its unit and its values, {"unit", "values"} or, if it is
complex, {"unit", "re", "im"}; it is checked and converted as a whole, not number by number.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, get_args

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    PlainSerializer,
    ValidationError,
    model_validator,
)
from pydantic_core import core_schema as cs
from typing_extensions import Self

from .errors import InputError, shown

_WORDS = {"nan": None, "inf": "Infinity", "-inf": "-Infinity"}
_FLOATS = {word: float(number) for number, word in _WORDS.items()}
_NUMBER = cs.union_schema(
    [
        cs.float_schema(allow_inf_nan=False),
        cs.none_schema(),
        cs.literal_schema(["Infinity", "-Infinity"]),
    ],
    mode="left_to_right",
)
"""A number in JSON; that the file is read strictly keeps numbers in quotes out."""


def _word(value: float) -> float | str | None:
    return value if math.isfinite(value) else _WORDS[repr(float(value))]


@dataclass(frozen=True)
class Unit:
    """The unit of a number: `torque_nm: Annotated[Number, Unit("N m")]`."""

    unit: str

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        """Return the JSON Schema of the field, with its unit."""
        return {**handler(schema), "unit": self.unit}


@dataclass(frozen=True)
class Array(Unit):
    """The unit of a numpy array of shape (n,): `torque: Annotated[np.ndarray, Array("N m")]`.

    Attributes:
        kind: float, complex, int or bool; what such an array can hold exactly is converted.
    """

    kind: type = float

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> cs.CoreSchema:
        """Return how pydantic checks, reads and writes the array."""
        return cs.json_or_python_schema(
            json_schema=cs.no_info_after_validator_function(self._read, self._form()),
            python_schema=cs.no_info_after_validator_function(
                self._taken, cs.is_instance_schema(np.ndarray)
            ),
            serialization=cs.plain_serializer_function_ser_schema(self._written),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        """Return the JSON Schema of the object that holds the array."""
        return dict(handler(self._form()))

    def _form(self) -> cs.TypedDictSchema:
        items: dict[type, cs.CoreSchema] = {int: cs.int_schema(), bool: cs.bool_schema()}
        values = cs.list_schema(items.get(self.kind, _NUMBER))
        keys = ("re", "im") if self.kind is complex else ("values",)
        fields = {"unit": cs.typed_dict_field(cs.literal_schema([self.unit]))}
        return cs.typed_dict_schema(fields | {key: cs.typed_dict_field(values) for key in keys})

    def _taken(self, array: np.ndarray) -> np.ndarray:
        if array.ndim != 1:
            raise ValueError(f"must have one axis, not {array.ndim}")
        return array.astype(self.kind, casting="same_kind", copy=False)

    def _read(self, form: dict[str, Any]) -> np.ndarray:
        if self.kind is not complex:
            return np.array(form["values"], dtype=self.kind)
        re, im = (np.array(form[part], dtype=float) for part in ("re", "im"))
        if re.shape != im.shape:
            raise ValueError(
                f"re and im must hold equally many values, not {re.size} and {im.size}"
            )
        z = np.empty(re.shape, complex)
        z.real, z.imag = re, im
        return z

    def _written(self, array: np.ndarray) -> dict[str, Any]:
        parts = {"values": array}
        if self.kind is complex:
            parts = {"re": array.real, "im": array.imag}
        return {"unit": self.unit, **{key: _numbers(part) for key, part in parts.items()}}


def _numbers(array: np.ndarray) -> list[Any]:
    if array.dtype.kind != "f" or np.isfinite(array).all():
        return array.tolist()
    return [_word(value) for value in array.tolist()]


def _read_number(form: float | str | None) -> float:
    return _FLOATS[form] if form is None or isinstance(form, str) else float(form)


class _NumberForm:
    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> cs.CoreSchema:
        return cs.json_or_python_schema(
            json_schema=cs.no_info_after_validator_function(_read_number, _NUMBER),
            python_schema=cs.no_info_after_validator_function(float, cs.float_schema()),
            serialization=cs.plain_serializer_function_ser_schema(_word),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        return dict(handler(_NUMBER))


Number = Annotated[float, _NumberForm()]
"""A number that may be unknown (NaN) or infinite."""

OptionalNumber = Annotated[
    float | None,
    AfterValidator(lambda value: value if value is None or math.isfinite(value) else None),
]
"""A number, or None where there is none; what is not finite counts as none."""


def _plain(value: Any) -> Any:
    """Return nested data of JSON's own types; NaN stays visible, as a string."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list | np.ndarray):
        return [_plain(item) for item in value]
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, float):
        return "NaN" if math.isnan(value) else _word(value)
    return value


FreeForm = Annotated[Mapping[str, Any], PlainSerializer(_plain)]
"""Names and values of no fixed form; what is not finite stays the string that it is written as."""


class ResultModel(BaseModel):
    """A result, or a part of one: frozen, checked when it is made and when it is read."""

    model_config = ConfigDict(
        frozen=True,
        populate_by_name=True,
        arbitrary_types_allowed=True,
        json_schema_serialization_defaults_required=True,
    )


class EqualArrays(ResultModel):
    """A result whose arrays are all of one length."""

    @model_validator(mode="after")
    def _equal(self) -> Self:
        arrays = [(n, v.size) for n, v in self if isinstance(v, np.ndarray)]
        for name, size in arrays:
            if size != arrays[0][1]:
                raise ValueError(f"{name} must hold {arrays[0][1]} values as {arrays[0][0]} does")
        return self


class Document(ResultModel):
    """A result that is a file of its own.

    A subclass names its schema: `schema_name: Literal["..."] = Field("...", alias="schema")`.
    """

    def to_json(self) -> str:
        """Return the JSON text, always the same for the same result."""
        return pretty(self.model_dump(by_alias=True)) + "\n"

    @classmethod
    def from_json(cls, text: str | bytes, source: str) -> Self:
        """Parse what `to_json` wrote, strictly; keys that are not known are ignored.

        Args:
            text: the JSON text.
            source: what it comes from, for messages.

        Raises:
            InputError: it is no such document; the message names the source and the field.
        """
        name = cls.model_fields["schema_name"].default
        try:
            found = cls.model_validate_json(text, strict=True)
        except ValidationError as error:
            problem = first_problem(error).rstrip(".")
        else:
            if "schema_name" in found.model_fields_set:
                return found
            problem = "schema: is missing"
        raise InputError(f"{source}: not a {name} file: {problem}; make it again.")

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a file; raise InputError if it is missing or no such document."""
        try:
            text = Path(path).read_bytes()
        except OSError as error:
            raise InputError(f"{path} cannot be read: {error.strerror}.") from None
        return cls.from_json(text, str(path))


def first_problem(error: ValidationError) -> str:
    """Return the first problem of a failed validation as 'field: what is wrong'."""
    problem = error.errors(include_url=False)[0]
    where = ".".join(str(part) for part in problem["loc"])
    what = what_is_wrong(problem)
    return f"{where}: {what}." if where else f"{what}."


_PLAIN_WORDS = {
    "missing": "is missing",
    "extra_forbidden": "is not known here; remove it or correct its name",
    "finite_number": "must be a finite number",
    **dict.fromkeys(("float_parsing", "float_type"), "must be a number"),
    **dict.fromkeys(("int_parsing", "int_type", "int_from_float"), "must be a whole number"),
    **dict.fromkeys(
        ("model_type", "model_attributes_type", "dict_type"), "must be names with values"
    ),
}


def what_is_wrong(problem: Mapping[str, Any]) -> str:
    """Return a problem of a failed validation in plain words that follow the name of the field."""
    if problem["type"] == "union_tag_invalid":
        tags = problem["ctx"]
        return f"the kind is {shown(tags['tag'])}; known are {tags['expected_tags']}"
    if problem["type"] == "union_tag_not_found":
        return "the kind is missing"
    said = problem["msg"].removeprefix("Value error, ")
    return _PLAIN_WORDS.get(problem["type"], re.sub(r"^(Input|List|String) should ", "must ", said))


def units(model: type[BaseModel]) -> dict[str, str]:
    """Return the unit of every field that has one, of a type and the types within it, by name."""
    found: dict[str, str] = {}
    for name, field in model.model_fields.items():
        for each in field.metadata:
            if isinstance(each, Unit):
                found[name] = each.unit
        for inner in _models(field.annotation):
            found.update(units(inner))
    return found


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models(part)


def pretty(value: Any, indent: str = "") -> str:
    """Return JSON text with one array per line: readable, small, and kind to diff."""
    deeper = indent + "  "
    if isinstance(value, dict) and "unit" not in value and value:
        items = [f"{json.dumps(k)}: {pretty(v, deeper)}" for k, v in value.items()]
        return "{\n" + ",\n".join(deeper + item for item in items) + "\n" + indent + "}"
    if isinstance(value, tuple | list) and value and isinstance(value[0], dict | str):
        items = [pretty(item, deeper) for item in value]
        return "[\n" + ",\n".join(deeper + item for item in items) + "\n" + indent + "]"
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
