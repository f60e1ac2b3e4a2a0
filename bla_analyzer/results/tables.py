"""The BLA as tables for other tools: frf.csv, frf.npz, frf.mat and python-control's FRD."""

from __future__ import annotations

import csv
import io
import json
import re
from operator import attrgetter
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import scipy.io
from pydantic import BaseModel

from fjr_kit.errors import InputError
from fjr_kit.result_types import units

from .result import BlaEstimate, LevelResult, Result

if TYPE_CHECKING:
    import control

BLA_COLUMNS = {
    "var_total": "var_total_rad2_per_nm2",
    "var_noise": "var_noise_rad2_per_nm2",
    "var_nonlinear": "var_nonlinear_rad2_per_nm2",
    "nonlinear_p_value": "nonlinear_p_value",
    "radius_95": "radius_95_rad_per_nm",
    "coherence": "coherence",
    "input_relative_variance": "input_relative_variance",
}
"""Column of frf.csv for each real array of the BLA."""

LINK_COLUMNS = {
    "g.real": "link_g_re_rad_per_nm",
    "g.imag": "link_g_im_rad_per_nm",
    "var_total": "link_var_total_rad2_per_nm2",
    "var_noise": "link_var_noise_rad2_per_nm2",
    "radius_95": "link_radius_95_rad_per_nm",
    "cov_total.real": "link_cov_total_re_rad2_per_nm2",
    "cov_total.imag": "link_cov_total_im_rad2_per_nm2",
}
"""Columns of frf.csv for the link position, where a level has one: array, and part of it."""

UNITS = units(LevelResult)
"""Unit of every numeric field of a level."""


def frf_csv(result: Result) -> str:
    """Return frf.csv: one row for each excited line of each level that has a BLA.

    The header names the unit of each column; numbers are written so that they read back exactly;
    unknown is NaN. Models come after the BLA, two columns each; the link position, if any, last.
    """
    names = list(dict.fromkeys(c.name for level in result.levels for c in level.comparisons))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    linked = any(level.bla is not None and level.bla.link is not None for level in result.levels)
    writer.writerow(_header(names) + linked * [*LINK_COLUMNS.values()])
    for level in result.levels:
        if level.bla is not None:
            rows = _rows(level, level.bla, names)
            if linked:
                links = zip(*_link_columns(level.bla), strict=True)
                rows = [(*row, *link) for row, link in zip(rows, links, strict=True)]
            writer.writerows(rows)
    return text.getvalue()


def _header(models: list[str]) -> list[str]:
    frf = [
        "level",
        "frequency_hz",
        "amplitude_rad",
        "g_re_rad_per_nm",
        "g_im_rad_per_nm",
        "g_magnitude_db",
    ]
    parts = [f"{name}_{part}_rad_per_nm" for name in models for part in ("re", "im")]
    return [*frf, "g_phase_deg", *BLA_COLUMNS.values(), "reliable", *parts]


def _rows(level: LevelResult, bla: BlaEstimate, models: list[str]) -> list[tuple[str, ...]]:
    """Return the rows of one level as text, columns as in `_header`."""
    with np.errstate(divide="ignore"):
        magnitude_db = 20.0 * np.log10(np.abs(bla.g))
    columns = [bla.frequency_hz, level.amplitude_rad, bla.g.real, bla.g.imag]
    columns += [magnitude_db, np.angle(bla.g, deg=True)]
    columns += [getattr(bla, name) for name in BLA_COLUMNS]
    known = {c.name: c.g0 for c in level.comparisons}
    unknown = np.full(len(bla.g), complex(np.nan, np.nan))
    models_g0 = [known.get(name, unknown) for name in models]
    after = [part for g0 in models_g0 for part in (g0.real, g0.imag)]
    texts = [[str(level.level)] * len(bla.g), *map(_texts, columns)]
    texts += [[str(int(flag)) for flag in bla.reliable], *map(_texts, after)]
    return list(zip(*texts, strict=True))


def _link_columns(bla: BlaEstimate) -> list[list[str]]:
    if bla.link is None:
        return [["NaN"] * bla.g.size for _ in LINK_COLUMNS]
    return [_texts(attrgetter(name)(bla.link)) for name in LINK_COLUMNS]


def _texts(values: np.ndarray) -> list[str]:
    return ["NaN" if value != value else repr(value) for value in values.tolist()]


def frf_npz(result: Result) -> bytes:
    """Return frf.npz: every array of the result under a flat name, such as level0_bla_g.

    `units` is a JSON text that maps each name to its unit. Nothing in it needs pickle.
    """
    arrays = {
        key: value
        for level in result.levels
        for key, value in _flat(level, f"level{level.level}").items()
    }
    by_name = {key: UNITS[_field(key)] for key in arrays}
    arrays["units"] = np.array(json.dumps(by_name))
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **cast(dict[str, Any], arrays))
    return buffer.getvalue()


def _field(key: str) -> str:
    """Return the field name at the end of a flat key: the longest that is known."""
    parts = key.split("_")
    return next(tail for i in range(len(parts)) if (tail := "_".join(parts[i:])) in UNITS)


def _flat(value: Any, prefix: str) -> dict[str, np.ndarray]:
    """Return the numeric leaves of a result as {prefix_field: array}."""
    if isinstance(value, BaseModel):
        pairs = list(value)
    elif isinstance(value, tuple):
        pairs = [(re.sub(r"\W", "_", item.name), item) for item in value]
    elif isinstance(value, np.ndarray | float | int):
        return {prefix: np.asarray(value)}
    else:
        return {}
    return {k: v for name, item in pairs for k, v in _flat(item, f"{prefix}_{name}").items()}


def frf_mat(result: Result) -> bytes:
    """Return frf.mat (MATLAB 5): the structs `result` (as in result.json) and `units`.

    `result.level` is a 1 x L struct array; arrays are columns; what is None is empty.
    """
    return mat_file({"result": matlab_struct(result), "units": UNITS}, "fjr_rig/result/2")


def matlab_struct(document: BaseModel) -> dict[str, Any]:
    """Return a document that has levels as a struct; `level` is a 1 x L struct array."""
    top = {n: _matlab(value) for n, value in document if n not in ("schema_name", "levels")}
    return top | {"level": _struct_array(document.levels)}  # type: ignore[attr-defined]


def mat_file(content: dict[str, Any], schema: str) -> bytes:
    """Return a MATLAB 5 file, the same bytes for the same content."""
    buffer = io.BytesIO()
    scipy.io.savemat(buffer, content, long_field_names=True, do_compression=True, oned_as="column")
    # scipy writes the date into the first 116 bytes; the same result must give the same file.
    return f"MATLAB 5.0 MAT-file, {schema}".encode().ljust(116) + buffer.getvalue()[116:]


def _matlab(value: Any) -> Any:
    """Return `value` as savemat takes it."""
    if value is None:
        return np.zeros((0, 0))
    if isinstance(value, BaseModel):
        return {name: _matlab(item) for name, item in value}
    if isinstance(value, dict):
        named = {key.replace(".", "_"): item for key, item in value.items()}
        return {key: _matlab(item) for key, item in named.items() if _is_matlab_name(key)}
    if isinstance(value, tuple) and value and isinstance(value[0], BaseModel):
        return _struct_array(value)
    if isinstance(value, tuple | list) and all(isinstance(item, str) for item in value):
        return np.array([*value], dtype=object)
    return value


def _is_matlab_name(key: str) -> bool:
    return key.isascii() and key.isidentifier() and key[0] != "_" and len(key) <= 63


def _struct_array(items: tuple[Any, ...]) -> np.ndarray:
    """Return a 1 x n struct array of results of one type."""
    if not items:
        return np.zeros((0, 0))
    names = list(type(items[0]).model_fields)
    array = np.empty((1, len(items)), dtype=[(name, object) for name in names])
    for i, item in enumerate(items):
        array[0, i] = tuple(_matlab(getattr(item, name)) for name in names)
    return array


def to_frd(result: Result, level: int) -> control.FrequencyResponseData:
    """Return the BLA of a level as python-control's FRD.

        >>> from bla_analyzer import analyze, to_frd
        >>> response = to_frd(analyze("rig"), level=1)
        >>> response.omega.shape, response(1j * response.omega).shape  # rad/s; complex, rad/(N m)
        ((17,), (17,))

    Args:
        result: the analysis.
        level: index of the level.

    Returns:
        `control.FRD` of one input and one output: G_BLA, motor torque to motor position, in
        rad/(N m), at the excited lines in rad/s.

    Raises:
        InputError: python-control is absent, or the level is absent or has no BLA.
    """
    found = next((item for item in result.levels if item.level == level), None)
    if found is None or found.bla is None:
        levels = ", ".join(str(item.level) for item in result.levels if item.bla is not None)
        raise InputError(
            f"{result.source}: level {level} has no BLA; choose one of: {levels or 'none'}."
        )
    try:
        import control
    except ImportError:
        raise InputError("control.FRD needs python-control; install fjr-rig[control].") from None
    bla = found.bla
    return control.FRD(bla.g, 2.0 * np.pi * bla.frequency_hz, name=f"BLA level {level}")
