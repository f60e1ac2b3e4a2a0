"""result.json: a `Result` as strict JSON, every array beside its unit, read back bit for bit.

Real array {"unit", "values"}, complex array {"unit", "re", "im"}. JSON has no NaN and no infinity:
NaN (unknown) is null, infinities are the strings "Infinity" and "-Infinity".
"""

from __future__ import annotations

import dataclasses
import json
import math
from functools import cache
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, cast, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from fjr_interface.errors import InputError
from fjr_interface.experiment import first_problem

from .result import BlaEstimate, Comparison, LevelResult, LineLevels, Result, TimeSignals

SCHEMA = "fjr_rig/result/1"

UNITS = {
    "frequency_hz": "Hz",
    "g": "rad/(N m)",
    "g0": "rad/(N m)",
    "var_total": "(rad/(N m))^2",
    "var_noise": "(rad/(N m))^2",
    "var_nonlinear": "(rad/(N m))^2",
    "nonlinear_p_value": "1",
    "radius_95": "rad/(N m)",
    "input_relative_variance": "1",
    "reliable": "bool",
    "reference": "rad",
    "torque": "N m",
    "position": "rad",
    "corrected": "rad",
    "smoothed": "rad",
    "noise": "rad",
    "time_s": "s",
    "reference_rad": "rad",
    "torque_nm": "N m",
    "position_rad": "rad",
    "amplitude_rad": "rad",
}
"""Unit of every array field of the data model, by field name."""

SCALAR_UNITS = {
    "v_mean": "dB^2",
    "v_median": "dB^2",
    "v_mean_above_1hz": "dB^2",
    "v_median_above_1hz": "dB^2",
    "reference_rms_rad": "rad",
    "torque_rms_nm": "N m",
    "position_rms_rad": "rad",
    "torque_peak_nm": "N m",
    "position_peak_rad": "rad",
}
"""Unit of the scalar fields of a level, by field name."""

COMPLEX = frozenset({"g", "g0"})
"""The array fields that are complex."""

UNKNOWN = {"nan": None, "inf": "Infinity", "-inf": "-Infinity"}
_FLOATS = {text: float(name) for name, text in UNKNOWN.items()}

Finite = Annotated[float, Field(allow_inf_nan=False)]
Number = Finite | None | Literal["Infinity", "-Infinity"]


class _Strict(BaseModel):
    """No coercion: a number in quotes is not a number. Further keys are ignored."""

    model_config = ConfigDict(strict=True)


def to_json(result: Result) -> str:
    """Return the JSON text, always the same for the same result."""
    return pretty({"schema": SCHEMA, **_encode(result, "")}) + "\n"


def from_json(text: str | bytes, source: str) -> Result:
    """Parse `to_json`'s text; raise InputError naming `source`, the field and what is wrong."""
    try:
        plain = document_model().model_validate_json(text).model_dump()
    except ValidationError as error:
        problem = first_problem(error).rstrip(".")
        raise InputError(
            f"{source}: not a {SCHEMA} file: {problem}; run the analysis again."
        ) from None
    result = _decode(Result, plain)
    for level in result.levels:
        _check_lengths(level, source)
    return result


def load_result(path: str | Path) -> Result:
    """Read a result.json; raise InputError if it is missing, no JSON or not of the schema."""
    try:
        text = Path(path).read_bytes()
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({error.strerror}); name the result.json of an analysis."
        ) from None
    return from_json(text, str(path))


@cache
def document_model() -> type[BaseModel]:
    """Return the pydantic model that validates a whole result.json."""
    return create_model(
        "ResultDocument", __base__=_model(Result), schema_name=_required(Literal[SCHEMA], "schema")
    )


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of result.json."""
    return document_model().model_json_schema()


def _required(kind: Any, alias: str | None = None) -> Any:
    return (kind, Field(alias=alias))


@cache
def _model(cls: type) -> type[BaseModel]:
    """Return the pydantic model of one dataclass of the data model."""
    hints = get_type_hints(cls)
    fields = {
        f.name: _required(_annotation(hints[f.name], f.name)) for f in dataclasses.fields(cls)
    }
    return create_model(cls.__name__, __base__=_Strict, __doc__=cls.__doc__, **fields)


def _annotation(hint: Any, name: str) -> Any:
    """Return the pydantic annotation for the JSON form of a field of type `hint`."""
    if hint is np.ndarray:
        return _array_model(UNITS[name], name in COMPLEX)
    if hint is float:
        return Number
    if dataclasses.is_dataclass(hint):
        return _model(cast(type, hint))
    if get_origin(hint) is tuple:
        item: Any = _annotation(get_args(hint)[0], name)
        return list[item]
    if get_origin(hint) in (Union, UnionType):
        return Union[tuple(_annotation(part, name) for part in get_args(hint))]  # noqa: UP007
    return hint


@cache
def _array_model(unit: str, is_complex: bool) -> type[BaseModel]:
    """Return the model of an array in `unit`: {unit, values}, or {unit, re, im} if complex."""
    item: Any = bool if unit == "bool" else Number
    keys = ("re", "im") if is_complex else ("values",)
    fields = {"unit": _required(Literal[unit])} | {key: _required(list[item]) for key in keys}
    kind = "Complex" if is_complex else "Real"
    return create_model(f"{kind} array in {unit}", __base__=_Strict, **fields)


def _encode(value: Any, name: str) -> Any:
    """Return the plain JSON form of a value of the field `name`."""
    if dataclasses.is_dataclass(value):
        return {f.name: _encode(getattr(value, f.name), f.name) for f in _fields(value)}
    if isinstance(value, np.ndarray):
        return _encode_array(value, name)
    if isinstance(value, tuple | list):
        return [_encode(item, name) for item in value]
    if isinstance(value, dict):
        return {str(key): _encode_free(item) for key, item in value.items()}
    return _encode_scalar(value)


def _encode_scalar(value: Any) -> Any:
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, float) and not math.isfinite(value):
        return UNKNOWN[repr(value)]
    return value


def _encode_free(value: Any) -> Any:
    """Encode a value of the free-form controller description: NaN stays visible, as a string."""
    if isinstance(value, dict):
        return {str(key): _encode_free(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [_encode_free(item) for item in value]
    if isinstance(value, float) and math.isnan(value):
        return "NaN"
    return _encode_scalar(value)


def _encode_array(values: np.ndarray, name: str) -> dict[str, Any]:
    if name in COMPLEX:
        z = values.astype(complex)
        return {"unit": UNITS[name], "re": _numbers(z.real), "im": _numbers(z.imag)}
    return {"unit": UNITS[name], "values": _numbers(values)}


def _numbers(values: np.ndarray) -> list[Any]:
    plain = values.tolist()
    if values.dtype.kind != "f" or np.isfinite(values).all():
        return plain
    return [_encode_scalar(value) for value in plain]


def _decode(hint: Any, value: Any) -> Any:
    """Return the value of type `hint` from its validated plain JSON form."""
    if hint is np.ndarray:
        return _decode_array(value)
    if hint is float:
        return float(_FLOATS.get(value, value))
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        hints = get_type_hints(hint)
        return hint(**{f.name: _decode(hints[f.name], value[f.name]) for f in _fields(hint)})
    if get_origin(hint) is tuple:
        return tuple(_decode(get_args(hint)[0], item) for item in value)
    if get_origin(hint) in (Union, UnionType) and value is not None:
        return _decode(next(part for part in get_args(hint) if part is not type(None)), value)
    return value


def _fields(cls: Any) -> tuple[dataclasses.Field, ...]:
    return dataclasses.fields(cls)


def _decode_array(value: dict[str, Any]) -> np.ndarray:
    if value["unit"] == "bool":
        return np.array(value["values"], dtype=bool)
    if "values" in value:
        return _floats(value["values"])
    re, im = _floats(value["re"]), _floats(value["im"])
    if re.shape != im.shape:
        return np.concatenate([re, im])[:, None]  # found by _check_lengths
    z = np.empty(re.shape, complex)
    z.real, z.imag = re, im
    return z


def _floats(values: list[Any]) -> np.ndarray:
    return np.array([_FLOATS.get(value, value) for value in values], dtype=float)


def _check_lengths(level: LevelResult, source: str) -> None:
    """Raise InputError if arrays that share an axis differ in length."""
    groups: list[tuple[str, LineLevels | TimeSignals | BlaEstimate | Comparison, int]] = [
        (name, part, len(part.frequency_hz))
        for name, part in (("excited", level.excited), ("odd", level.odd), ("even", level.even))
    ]
    groups.append(("signals", level.signals, len(level.signals.time_s)))
    if level.bla is not None:
        lines = len(level.bla.frequency_hz)
        groups.append(("bla", level.bla, lines))
        groups += [(f"comparisons {c.name}", c, lines) for c in level.comparisons]
    for name, part, length in groups:
        for f in _fields(part):
            array = getattr(part, f.name)
            if isinstance(array, np.ndarray) and array.shape != (length,):
                raise InputError(
                    f"{source}: level {level.level}: {name}.{f.name} must hold {length} values; "
                    "run the analysis again."
                )


def pretty(value: Any, indent: str = "") -> str:
    """Return JSON text with one array per line: readable, small, and kind to diff."""
    deeper = indent + "  "
    if isinstance(value, dict) and "unit" not in value and value:
        items = [f"{json.dumps(k)}: {pretty(v, deeper)}" for k, v in value.items()]
        return "{\n" + ",\n".join(deeper + item for item in items) + "\n" + indent + "}"
    if isinstance(value, list) and value and isinstance(value[0], dict | str):
        items = [pretty(item, deeper) for item in value]
        return "[\n" + ",\n".join(deeper + item for item in items) + "\n" + indent + "]"
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
