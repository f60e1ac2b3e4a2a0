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
    shapes: dict[str, tuple[int, ...]] = {}
    tables: dict[str, str] = {}

    def note(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#"):  # what MATLAB's cells hold
            return
        dotted = name.replace("/", ".")
        for field, (kind, _) in (item.dtype.fields or {}).items():
            if kind.kind in "fiub":
                shapes[f"{dotted}.{field}"], tables[f"{dotted}.{field}"] = item.shape, dotted
        if item.dtype.kind in "fiub":
            shapes[dotted] = item.shape

    def find(name: str) -> np.ndarray:
        refuse_bomb(path, 8 * int(np.prod(shapes[name])))
        try:
            with h5py.File(path) as file:
                if (table := tables.get(name)) is not None:
                    return np.asarray(file[table.replace(".", "/")][name[len(table) + 1 :]])
                return np.asarray(file[name.replace(".", "/")]).T  # MATLAB counts columns first
        except Exception:  # h5py parses arbitrary bytes here: anything may go wrong
            raise _unreadable(path, kind) from None

    try:
        with h5py.File(path) as file:
            file.visititems(note)
    except Exception:
        raise _unreadable(path, kind) from None
    return Names(path, [name for name, shape in shapes.items() if np.prod(shape) > 1], find)


def _unreadable(path: Path, kind: str) -> InputError:
    return InputError(f"{path}: is not a readable {kind} file; save it again.")
