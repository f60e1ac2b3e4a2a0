"""HDF5 files, and those of MATLAB 7.3, which are such: by h5py where that is installed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from fjr_kit.errors import InputError

from .source import Names, refuse_bomb


def open_hdf5(path: Path, kind: str = "HDF5") -> Names:
    """Open a `.h5` file; `group/signal` is named `group.signal`; raise InputError.

    A field of a table is named like a signal in a group of the table's name.

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
    held: dict[str, tuple[tuple[int, ...], str, str | None]] = {}

    def note(path_inside: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or path_inside.startswith("#"):  # MATLAB's cells
            return
        name = path_inside.replace("/", ".")
        if item.dtype.kind in "fiub":
            held[name] = item.shape, path_inside, None
        for field, (dtype, _) in (item.dtype.fields or {}).items():
            if dtype.kind in "fiub":
                held[f"{name}.{field}"] = item.shape, path_inside, field

    def find(name: str) -> np.ndarray:
        shape, path_inside, field = held[name]
        refuse_bomb(path, 8 * int(np.prod(shape)))
        try:
            with h5py.File(path) as file:
                stored = file[path_inside]
                array = np.asarray(stored if field is None else stored[field])
                return array.T  # MATLAB counts columns first
        except Exception:  # h5py parses arbitrary bytes here: anything may go wrong
            raise _unreadable(path, kind) from None

    try:
        with h5py.File(path) as file:
            file.visititems(note)
    except Exception:
        raise _unreadable(path, kind) from None
    return Names(path, [name for name, (shape, *_) in held.items() if np.prod(shape) > 1], find)


def _unreadable(path: Path, kind: str) -> InputError:
    return InputError(f"{path}: is not a readable {kind} file; save it again.")
