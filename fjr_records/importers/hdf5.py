"""HDF5 files, and those of MATLAB 7.3, which are such: by h5py where that is installed."""

from __future__ import annotations

import math
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from fjr_kit.errors import InputError

from .source import Names, refuse_bomb, unreadable
from .structures import names_of

_SMALL = 2**13
"""Most bytes of a text, or of references: of 8 bytes for each element of a cell array."""
_EMPTY = "MATLAB_empty"
_UNITS = ("units", "unit", "unit_string")
"""Attributes that state a unit; the last one as TDMS files have it."""
_DEEP, _MOST = 20, 10_000
"""References after references that are followed, and how much is looked at behind all of them."""


def open_hdf5(path: Path, kind: str = "HDF5") -> Names:
    """Open a `.h5` file; `group/signal` is named `group.signal`; raise InputError.

    A field of a table is named like a signal in a group of the table's name, what stands behind
    references as in files of MATLAB of other versions (`mat`).

    Args:
        path: the file.
        kind: what it is called.
    """
    try:
        import h5py
    except ImportError:
        raise InputError(
            f"{path}: is a {kind} file, read by h5py, not installed here; install fjr-rig[hdf5], "
            "or write the signals as NPZ, CSV or MAT (save(..., '-v7'))."
        ) from None
    held: dict[str, tuple[tuple[int, ...], tuple[str | int, ...], str | None]] = {}
    texts: dict[str, str] = {}
    units: dict[str, str] = {}
    seen: set[int] = set()
    looks = count()

    def sort(name: str, item: Any, steps: tuple[str | int, ...]) -> None:
        """Sort an item, and all in it, into numbers and texts; by the steps it is found again."""
        if isinstance(item, h5py.Group):
            item.visititems(lambda inside, each: sort_inner(name, inside, each, steps))
            return
        if not isinstance(item, h5py.Dataset) or item.shape is None or item.attrs.get(_EMPTY):
            return
        if h5py.check_ref_dtype(item.dtype) is h5py.Reference:
            if _is_small(item) and len(steps) < _DEEP:
                behind(name, item, steps)
        elif item.attrs.get("MATLAB_class") == b"char" or h5py.check_string_dtype(item.dtype):
            texts[name] = _text(item) if _is_small(item) else ""
        else:
            if unit := next(filter(None, (_attribute(item, each) for each in _UNITS)), ""):
                units[name] = unit
            if item.dtype.kind in "fiub":
                held[name] = item.shape, steps, None
            for field, (dtype, _) in (item.dtype.fields or {}).items():
                if dtype.kind in "fiub":
                    held[f"{name}.{field}"] = item.shape, steps, field

    def sort_inner(name: str, inside: str, item: Any, steps: tuple[str | int, ...]) -> bool | None:
        """Sort what a group holds; True ends the visit."""
        if steps and next(looks) > _MOST:
            return True
        if not inside.startswith("#") and not isinstance(item, h5py.Group):  # MATLAB's cells
            inner = inside.replace("/", ".")
            sort(f"{name}.{inner}" if name else inner, item, (*steps, inside))
        return None

    def behind(name: str, item: Any, steps: tuple[str | int, ...]) -> None:
        """Sort the elements of a cell array, or a field of each structure of an array; once."""
        parent, _, field = name.rpartition(".")
        is_cell = item.attrs.get("MATLAB_class") == b"cell" or not parent
        for index, reference in enumerate(np.ravel(item[()])):
            if not reference or next(looks) > _MOST:
                continue
            element = item.file[reference]
            address = h5py.h5o.get_info(element.id).addr
            if address not in seen:
                seen.add(address)
                inner = f"{name}[{index}]" if is_cell else f"{parent}[{index}].{field}"
                sort(inner, element, (*steps, index))

    def find(name: str) -> np.ndarray:
        shape, steps, field = held[name]
        refuse_bomb(path, 8 * math.prod(shape))
        try:
            with h5py.File(path) as file:
                stored = file
                for step in steps:
                    stored = (
                        stored[step] if isinstance(step, str) else file[np.ravel(stored[()])[step]]
                    )
                array = np.asarray(stored if field is None else stored[field])
                return array.T  # MATLAB counts columns first
        except Exception:  # h5py parses arbitrary bytes here: anything may go wrong
            raise _unreadable(path, kind) from None

    try:
        with h5py.File(path) as file:
            sort("", file, ())
    except Exception:
        raise _unreadable(path, kind) from None
    columns = [name for name, (shape, *_) in held.items() if math.prod(shape) > 1]
    return names_of(path, columns, texts, find, units)


def _is_small(item: Any) -> bool:
    """Tell whether a dataset has few bytes, and takes no more to be unpacked."""
    elements = max(math.prod(item.shape), math.prod(item.chunks or ()))
    return elements * item.dtype.itemsize <= _SMALL


def _text(item: Any) -> str:
    """Return what a text says: words of 16 bits of MATLAB, or a single string."""
    stored = np.ravel(item[()])
    if stored.dtype.kind in "iu":
        return stored.astype("<u2").tobytes().decode("utf-16-le", "replace")
    return _word(stored)


def _attribute(item: Any, name: str) -> str:
    try:
        return _word(np.ravel(item.attrs.get(name, "")))
    except Exception:  # an attribute of a kind that h5py does not read
        return ""


def _word(values: np.ndarray) -> str:
    one = values[0] if values.size == 1 else ""
    return one.decode("utf-8", "replace") if isinstance(one, bytes) else one * isinstance(one, str)


def _unreadable(path: Path, kind: str) -> InputError:
    return unreadable(path, f"a readable {kind} file", "save it again")
