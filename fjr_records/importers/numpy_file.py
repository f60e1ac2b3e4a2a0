"""NumPy files: archives of arrays, and single arrays."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from fjr_kit.errors import InputError

from .source import Names, refuse_bomb, sample_axis, unreadable


def open_npz(path: Path) -> Names:
    """Open a `.npz` file; raise InputError if it is none."""
    try:
        with zipfile.ZipFile(path) as members:
            sizes = {m.filename.removesuffix(".npy"): m.file_size for m in members.infolist()}
    except Exception:  # zipfile parses arbitrary bytes here: anything may go wrong
        raise _unreadable(path) from None

    def find(name: str) -> np.ndarray:
        refuse_bomb(path, sizes[name])
        try:
            with np.load(path, allow_pickle=False) as archive:
                return np.asarray(archive[name])
        except Exception:  # as above, of numpy
            raise _unreadable(path) from None

    return Names(path, list(sizes), find)


def open_npy(path: Path) -> Names:
    """Open a `.npy` file; raise InputError if it is none.

    The columns of a structured array are its fields, those of a matrix are called 0, 1, ... as in
    a table without names.
    """
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except Exception:  # numpy parses arbitrary bytes here: anything may go wrong
        raise unreadable(path, "a NPY array of numbers", "write it with numpy.save") from None
    if array.dtype.names:
        return Names(path, list(array.dtype.names), array.__getitem__)
    signals = np.atleast_2d(array) if array.ndim < 2 or sample_axis(array.shape) else array.T
    known = [str(index) for index in range(len(signals))] if signals.ndim == 2 else []
    by_bracket = [f"[{index}]" for index in known]
    return Names(path, known, lambda name: signals[int(name.strip("[]"))], by_bracket)


def _unreadable(path: Path) -> InputError:
    return unreadable(path, "a NPZ archive of numeric arrays", "write it with numpy.savez")
