"""Columns of numbers from the files in which rigs without ROS keep their records: MAT, CSV, NPZ."""

from __future__ import annotations

import csv
import re
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fjr_interface.errors import InputError

_INDEXED = re.compile(r"(?P<name>.+)\[(?P<index>\d+)\]")
_DELIMITERS = ",;\t|"


def read_columns(path: str | Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Read named columns of a `.mat`, `.csv` (also `.txt`, `.tsv`) or `.npz` file.

    A field of a MAT structure is named `structure.field`, a column of a matrix `matrix[0]`, counted
    from 0. The first line of a CSV file names its columns.

    Args:
        path: the file; its suffix tells the format.
        names: the columns to read.

    Returns:
        {name: float64 (samples,)}, all of one length.

    Raises:
        InputError: the file cannot be read, lacks a column (those that are there are named), or a
            column holds something that is not a finite real number, or has another length.
    """
    path = Path(path)
    readers: dict[str, Callable[[Path, Sequence[str]], dict[str, np.ndarray]]] = {
        ".mat": _read_mat,
        ".npz": _read_npz,
        ".csv": _read_csv,
        ".txt": _read_csv,
        ".tsv": _read_csv,
    }
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise InputError(
            f"{path}: cannot tell the format by the suffix {path.suffix!r}; it must be one of "
            f"{', '.join(readers)}."
        )
    if not path.is_file():
        raise InputError(f"{path}: there is no such file.")
    columns = {name: _numbers(path, name, column) for name, column in reader(path, names).items()}
    first = next(iter(columns))
    for name, column in columns.items():
        if column.size != columns[first].size:
            raise InputError(
                f"{path}: {name} has {column.size} samples, but {first} has {columns[first].size}; "
                "they must be of one length."
            )
    return columns


def _numbers(path: Path, name: str, column: np.ndarray) -> np.ndarray:
    """Return a column as float64 (samples,); raise InputError unless it is finite and real."""
    if column.dtype.kind not in "fiub":
        raise InputError(f"{path}: {name} does not hold real numbers; choose another column.")
    if column.ndim != 1 and sum(size != 1 for size in column.shape) > 1:
        shape = " x ".join(map(str, column.shape))
        raise InputError(
            f"{path}: {name} is a matrix ({shape}); name one of its columns, such as {name}[0]."
        )
    numbers = column.astype(float).ravel()
    bad = np.flatnonzero(~np.isfinite(numbers))
    if bad.size:
        raise InputError(
            f"{path}: {name} holds {numbers[bad[0]]} at sample {bad[0]} and {bad.size - 1} more "
            "such values; repair or cut the record."
        )
    return numbers


def _pick(path: Path, name: str, find: Callable[[str], Any], known: Sequence[str]) -> np.ndarray:
    """Return the variable `name`, or column i of a matrix for `name[i]`."""
    match = _INDEXED.fullmatch(name)
    if name in known or match is None:
        if name not in known:
            raise _missing(path, name, known)
        return np.asarray(find(name))
    if match["name"] not in known:
        raise _missing(path, match["name"], known)
    matrix, index = np.asarray(find(match["name"])), int(match["index"])
    if matrix.ndim != 2 or index >= matrix.shape[1]:
        shape = " x ".join(map(str, matrix.shape))
        raise InputError(
            f"{path}: {match['name']} is {shape}, so there is no {name}; columns count from 0."
        )
    return matrix[:, index]


def _missing(path: Path, name: str, known: Sequence[str]) -> InputError:
    there = ", ".join(known) or "nothing"
    return InputError(f"{path}: there is no {name}; the file holds {there}.")


def _read_npz(path: Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: _pick(path, name, archive.__getitem__, archive.files) for name in names}
    except InputError:
        raise
    except Exception:  # zipfile and numpy parse arbitrary bytes here: anything may go wrong
        raise InputError(
            f"{path}: is not a NPZ archive of numeric arrays; write it with numpy.savez."
        ) from None


def _read_mat(path: Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    from scipy.io import loadmat

    if path.open("rb").read(10) == b"MATLAB 7.3":
        raise InputError(
            f"{path}: is a MATLAB 7.3 file; write it with save(..., '-v7') and try again."
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about MATLAB objects, which are not read
            content = loadmat(path, simplify_cells=True)
    except Exception:  # scipy parses arbitrary bytes here: anything may go wrong
        raise InputError(f"{path}: is not a readable MAT file; save it again.") from None
    variables = _flatten(content)
    return {name: _pick(path, name, variables.__getitem__, list(variables)) for name in names}


def _flatten(structure: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return {dotted name: array} of all numeric variables with more than one element."""
    flat: dict[str, Any] = {}
    for key, value in structure.items():
        if isinstance(value, dict):
            flat |= _flatten(value, f"{prefix}{key}.")
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiubc" and value.size > 1:
            flat[prefix + key] = value
    return flat


def _read_csv(path: Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            header = file.readline().strip()
            delimiter = max(_DELIMITERS, key=header.count)
            known = (
                [
                    cell.strip().lstrip("#% ")
                    for cell in next(csv.reader([header], delimiter=delimiter))
                ]
                if header
                else []
            )
            wanted = [_position(path, name, known) for name in names]
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # a file without data is only warned of
                table = np.loadtxt(
                    file, delimiter=delimiter, usecols=wanted, ndmin=2, quotechar='"'
                )
    except InputError:
        raise
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not a text file in UTF-8.") from None
    except (ValueError, UserWarning, csv.Error) as error:
        what = str(error).splitlines()[0].rstrip(".")
        raise InputError(f"{path}: below the line of names: {what}.") from None
    return dict(zip(names, table.T, strict=True))


def _position(path: Path, name: str, known: Sequence[str]) -> int:
    if name not in known:
        raise _missing(path, name, known)
    if known.count(name) > 1:
        raise InputError(
            f"{path}: the column {name} is there {known.count(name)} times; rename one."
        )
    return known.index(name)
