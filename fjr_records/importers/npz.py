"""NumPy archives."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from fjr_kit.errors import InputError

from .source import Names, refuse_bomb


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


def _unreadable(path: Path) -> InputError:
    return InputError(f"{path}: is not a NPZ archive of numeric arrays; write it with numpy.savez.")
