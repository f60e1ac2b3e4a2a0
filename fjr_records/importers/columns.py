"""Columns of numbers from any file in which a rig without ROS keeps its records."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from fjr_interface.bags.audit import LARGEST
from fjr_interface.bags.files import ROS_1, of_ros_1
from fjr_kit.errors import InputError

from . import hdf5, json_log, mat, numpy_file, text
from .source import Heading, Names, is_text, refuse_bomb, sample_axis
from .split_stamps import joined, nanoseconds_beside

Result = TypeVar("Result")

READERS: dict[str, Callable[[Path], Names]] = {
    ".mat": mat.open_mat,
    ".npz": numpy_file.open_npz,
    ".csv": text.open_text,
    ".tsv": text.open_text,
    ".txt": text.open_text,
    ".dat": text.open_text,
    ".asc": text.open_text,
    ".log": text.open_text,
    ".json": json_log.open_json,
    ".jsonl": json_log.open_json,
    ".ndjson": json_log.open_json,
    ".npy": numpy_file.open_npy,
    ".h5": hdf5.open_hdf5,
    ".hdf5": hdf5.open_hdf5,
}
"""What reads a file, by its suffix; each may be followed by .gz where it holds text."""
_MOST = 200
"""How many names of a file are looked at to say what it holds."""

_BY_PANDAS = "as by pandas.{}(FILE).to_csv(NEW)"
ELSEWHERE: dict[str, str] = {
    ".parquet": f"write it as CSV or NPZ, {_BY_PANDAS.format('read_parquet')}",
    ".feather": f"write it as CSV or NPZ, {_BY_PANDAS.format('read_feather')}",
    ".xlsx": f"save its sheet as CSV, {_BY_PANDAS.format('read_excel')}",
    ".xls": f"save its sheet as CSV, {_BY_PANDAS.format('read_excel')}",
    ".pkl": f"write it as CSV or NPZ, {_BY_PANDAS.format('read_pickle')}",
    ".tdms": "export it as CSV, as by nptdms.TdmsFile(FILE).as_dataframe().to_csv(NEW)",
    ".mf4": "export it as CSV, as by asammdf.MDF(FILE).to_dataframe().to_csv(NEW)",
    ".mdf": "export it as CSV, as by asammdf.MDF(FILE).to_dataframe().to_csv(NEW)",
}
"""What to do with files that are not read, by their suffix."""
_TEXTS = tuple(s for s, read in READERS.items() if read in (text.open_text, json_log.open_json))


def read_columns(
    path: str | Path, names: Sequence[str]
) -> tuple[dict[str, np.ndarray], dict[str, Heading]]:
    """Read named columns of a file.

    A field of a structure is named `structure.field`, a signal in a matrix `matrix[0]`, counted
    from 0 along its shorter side; a column of a text without names `0`, `1`, ...

    Args:
        path: the file; its suffix tells the format, see `READERS`.
        names: the columns to read.

    Returns:
        {name: float64 (samples,)}, and what the file says of each. Where most rows lack one of the
        columns, as logs of several topics do, NaN stands for what a row does not hold. A column of
        whole seconds has the nanoseconds of the column beside it added.

    Raises:
        InputError: the file cannot be read, lacks a column (those that are there are named), or a
            column holds something that is not a finite real number.
    """
    path = Path(path)

    def columns(found: Names) -> tuple[dict[str, np.ndarray], dict[str, Heading]]:
        headings = {name: found.heading(name) for name in names}
        beside = {name: nanoseconds_beside(headings[name].title, found.known) for name in names}
        asked = [*names, *(other for other in beside.values() if other is not None)]
        try:
            values = {name: _numbers(path, name, found.column(name)) for name in asked}
        except InputError:
            parted = _parted_rows(found, asked)
            if parted is None:
                raise
            values = parted
        for name, other in beside.items():
            stamps = None if other is None else joined(values[name], values[other])
            if stamps is not None and other is not None:
                values[name] = stamps
                headings[name] = replace(headings[name], unit="s", nanoseconds=other)
        return {name: values[name] for name in names}, headings

    return _of_file(path, columns)


def _parted_rows(found: Names, names: Sequence[str]) -> dict[str, np.ndarray] | None:
    """Return columns with NaN for what a row does not hold, if most rows lack some; else None."""
    path = found.path
    try:
        columns = {n: _numbers(path, n, found.column(n, holes=True), holes=True) for n in names}
    except InputError:
        return None
    there = [np.isfinite(column) for column in columns.values()]
    if len({each.size for each in there}) != 1 or not all(each.any() for each in there):
        return None
    whole = np.logical_and.reduce(there)
    return columns if 2 * whole.sum() < whole.size else None


@dataclass(frozen=True)
class Held:
    """A column, a matrix of signals or a number that a file holds.

    Attributes:
        name: by which it is read.
        shape: of the array.
        range: least and greatest value; None where it does not hold finite real numbers.
        holes: how many rows do not hold it.
        title: what the file calls it, where that is not its name; else empty.
    """

    name: str
    shape: tuple[int, ...]
    range: tuple[float, float] | None
    holes: int = 0
    title: str = ""


def held_columns(path: str | Path) -> tuple[list[Held], int]:
    """Return what a file holds, in its order, and how many names beyond _MOST are not looked at.

    Raises InputError if the file cannot be read.

    Args:
        path: the file, as for `read_columns`.
    """

    def held(found: Names) -> tuple[list[Held], int]:
        if found.empty:
            raise found.missing("column")
        return [_held(name, found) for name in found.known[:_MOST]], len(found.known[_MOST:])

    return _of_file(Path(path), held)


def _held(name: str, found: Names) -> Held:
    title = found.heading(name).title
    title = "" if title == name else title
    try:
        values = found.column(name, holes=True)
    except InputError:  # a damaged column, or a name that is there twice: said when it is asked for
        return Held(name, (), None, title=title)
    if values.dtype.kind not in "fiub":
        return Held(name, values.shape, None, title=title)
    holes = np.isnan(values) & (found.find_with_holes is not None)
    there = values[~holes]
    if not there.size or not np.isfinite(there).all():
        return Held(name, values.shape, None, title=title)
    span = (float(there.min()), float(there.max()))
    return Held(name, values.shape, span, int(holes.sum()), title)


def _of_file(path: Path, use: Callable[[Names], Result]) -> Result:
    """Return what is made of an open file; raise InputError if it cannot be read."""
    suffixes = [suffix.lower() for suffix in path.suffixes[-2:]]
    packed = suffixes[-1:] == [".gz"]
    suffix = suffixes[-2] if packed and len(suffixes) > 1 else path.suffix.lower()
    if path.is_dir():
        raise InputError(
            f"{path}: is a folder, not a file; name the files in it, as in FOLDER/*.csv; a bag of "
            "ROS 2 needs no import."
        )
    if not path.is_file():
        raise InputError(f"{path}: there is no such file.")
    if suffix == ROS_1:
        raise InputError(of_ros_1(path))
    try:
        reader = READERS.get(suffix) if suffix in _TEXTS or not packed else None
        if suffix in ELSEWHERE:
            raise InputError(f"{path}: files {suffix} are not read here; {ELSEWHERE[suffix]}.")
        if reader is None and (packed or not is_text(path)):
            raise InputError(
                f"{path}: cannot tell the format by the suffix {path.suffix!r}; it must be one of "
                f"{', '.join(READERS)}, or text, perhaps with .gz behind."
            )
        return use((reader or text.open_text)(path))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}).") from None
    except RecursionError:
        raise InputError(f"{path}: is nested too deeply to be a record.") from None


def _numbers(path: Path, name: str, column: np.ndarray, *, holes: bool = False) -> np.ndarray:
    """Return a column as float64 (samples,); raise InputError unless it is finite and real.

    With holes, it may be NaN as well.
    """
    if column.dtype.kind not in "fiub":
        raise InputError(f"{path}: {name} does not hold real numbers; choose another column.")
    if column.ndim != 1 and sum(size != 1 for size in column.shape) > 1:
        shape = " x ".join(map(str, column.shape))
        which = "columns" if sample_axis(column.shape) == 0 else "rows"
        raise InputError(
            f"{path}: {name} is a matrix ({shape}); name one of its {which}, such as {name}[0]."
        )
    refuse_bomb(path, 8 * column.size)
    numbers = column.astype(float).ravel()
    bad = np.flatnonzero(~(np.abs(numbers) <= LARGEST) & ~(holes & np.isnan(numbers)))
    if bad.size:
        more = f" and {bad.size - 1} more such values" if bad.size > 1 else ""
        raise InputError(
            f"{path}: {name} holds {numbers[bad[0]]} at sample {bad[0]}{more}; repair or cut the "
            "record."
        )
    return numbers
