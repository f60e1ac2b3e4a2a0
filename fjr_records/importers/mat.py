"""MATLAB files: version 5 (up to `-v7`) by SciPy; version 7.3 is HDF5."""

from __future__ import annotations

import struct
import warnings
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from fjr_kit.errors import InputError

from .hdf5 import open_hdf5
from .source import EXPANSION, LEAST_BYTES, Names, refuse_bomb

_HEADER, _COMPRESSED = 128, 15
"""Of version 5: bytes before the first variable, and the type of a compressed one."""


def open_mat(path: Path) -> Names:
    """Open a `.mat` file; raise InputError.

    A field of a structure is named `structure.field`, one of an array of structures
    `structure[0].field`.
    """
    with path.open("rb") as file:
        if file.read(10) == b"MATLAB 7.3":
            return open_hdf5(path, "MATLAB 7.3")
    from scipy.io import loadmat

    refuse_bomb(path, _unpacked_size(path))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about MATLAB objects, which are not read
            content = loadmat(path, simplify_cells=True)
    except Exception:  # scipy parses arbitrary bytes here: anything may go wrong
        raise InputError(f"{path}: is not a readable MAT file; save it again.") from None
    variables = _flatten(content)
    return Names(path, list(variables), variables.__getitem__)


def _unpacked_size(path: Path) -> int:
    """Return how many bytes the variables of a MAT file take, or that it is one byte too many."""
    most = max(LEAST_BYTES, EXPANSION * path.stat().st_size) + 1
    size = 0
    with path.open("rb") as file:
        head = file.read(_HEADER)
        order = "<" if head[-2:] == b"IM" else ">"
        while size < most and len(tag := file.read(8)) == 8:
            kind, length = struct.unpack(f"{order}II", tag)
            end = file.tell() + length
            size += length
            if kind == _COMPRESSED:
                size -= length
                decompress = zlib.decompressobj()
                while size < most and (part := file.read(min(2**16, end - file.tell()))):
                    while size < most and part:
                        try:
                            size += len(decompress.decompress(part, 2**20))
                        except zlib.error:
                            return size  # damaged: whoever reads it says so
                        part = decompress.unconsumed_tail
            file.seek(end)
    return size


def _flatten(structure: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return {dotted name: array} of all numeric variables with more than one element."""
    flat: dict[str, Any] = {}
    for key, value in structure.items():
        if isinstance(value, dict):
            flat |= _flatten(value, f"{prefix}{key}.")
        elif isinstance(value, (list, np.ndarray)) and len(many := _structures(value)):
            for index, one in enumerate(many):
                flat |= _flatten(one, f"{prefix}{key}[{index}].")
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiubc" and value.size > 1:
            flat[prefix + key] = value
    return flat


def _structures(value: Any) -> list[dict[str, Any]]:
    """Return the structures of an array or a cell array of nothing else; empty for anything else.

    Simulink's scopes keep their signals so.
    """
    if isinstance(value, np.ndarray) and value.dtype != object:
        return []
    many = list(value.ravel()) if isinstance(value, np.ndarray) else value
    return many if all(isinstance(one, dict) for one in many) else []
