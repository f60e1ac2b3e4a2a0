"""MATLAB files: version 4 and 5 (up to `-v7`) by SciPy; version 7.3 is HDF5."""

from __future__ import annotations

import struct
import warnings
import zlib
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from fjr_kit.errors import InputError

from .hdf5 import open_hdf5
from .source import EXPANSION, LEAST_BYTES, Names, refuse_bomb, unreadable
from .structures import names_of

_HEADER, _MATRIX, _COMPRESSED = 128, 14, 15
"""Of version 5: bytes before the first variable, the types of an array and of a compressed one."""
_TYPES = {*range(1, 8), 9, *range(12, 19)}
"""Of version 5: types of elements that there are."""
_MARK = 4
"""Bytes of which one is zero in version 4, and none in version 5, which begins with words."""


def open_mat(path: Path) -> Names:
    """Open a `.mat` file; raise InputError.

    A field of a structure is named `structure.field`, one of an array of structures
    `structure[0].field`, or as a text beside it says (`structures`); an element of a cell array is
    named `cell[0]`.
    """
    with path.open("rb") as file:
        head = file.read(10)
    if head.startswith(b"MATLAB 7."):
        return open_hdf5(path, "MATLAB 7.3")
    from scipy.io import loadmat

    if 0 not in head[:_MARK]:  # else of version 4, which compresses nothing
        refuse_bomb(path, _unpacked_size(path))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about MATLAB objects, which are not read
            content = loadmat(path, simplify_cells=True)
    except Exception:  # scipy parses arbitrary bytes here: anything may go wrong
        raise _unreadable(path) from None
    arrays: dict[str, np.ndarray] = {}
    texts: dict[str, str] = {}
    for key, value in content.items():
        _sort(key, value, arrays, texts)
    return names_of(path, list(arrays), texts, arrays.__getitem__)


def _unpacked_size(path: Path) -> int:
    """Return how many bytes the variables take, of version 5, or that it is one byte too many."""
    most = max(LEAST_BYTES, EXPANSION * path.stat().st_size) + 1
    size = 0
    with path.open("rb") as file:
        head = file.read(_HEADER)
        order = "<" if head[-2:] == b"IM" else ">"
        while size < most and len(tag := file.read(8)) == 8:
            kind, length = struct.unpack(f"{order}II", tag)
            end = file.tell() + length
            size += length
            if kind == _MATRIX and not _is_whole(file, end, order):
                raise _unreadable(path)
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


def _is_whole(file: BinaryIO, end: int, order: str) -> bool:
    """Tell whether elements of types that there are fill an array of version 5 up to its end.

    SciPy trusts the types, and the process would die of one that there is not.
    """
    while file.tell() < end:
        kind, length = struct.unpack(f"{order}II", file.read(8).ljust(8, b"\0"))
        if kind >> 16:  # up to four bytes, which stand in place of the length
            kind, length = kind & 0xFFFF, 0
        stop = file.tell() + length + -length % 8
        if kind not in _TYPES or stop > end:
            return False
        if kind == _MATRIX and not _is_whole(file, stop, order):
            return False
        file.seek(stop)
    return True


def _unreadable(path: Path) -> InputError:
    return unreadable(path, "a readable MAT file", "save it again")


def _sort(name: str, value: Any, arrays: dict[str, np.ndarray], texts: dict[str, str]) -> None:
    """Sort a variable, and all in it, into numbers of more than one element and texts, by name."""
    if isinstance(value, dict):
        for key, field in value.items():
            _sort(f"{name}.{key}", field, arrays, texts)
    elif isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
        for index, element in enumerate(value if isinstance(value, list) else value.ravel()):
            _sort(f"{name}[{index}]", element, arrays, texts)
    elif isinstance(value, str):
        texts[name] = value
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiubc" and value.size > 1:
        arrays[name] = value
