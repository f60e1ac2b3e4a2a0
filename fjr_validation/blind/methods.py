"""The methods that a blind check compares, and their application to one case."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from fjr_kit.errors import InputError
from gap_diagnosis.outcome.diagnosis import Diagnosis

Method = Callable[[Path, Mapping[str, float]], Diagnosis]

OURS = "fjr"
METHODS: Mapping[str, tuple[str, str]] = {
    OURS: ("gap_diagnosis.any_record", "diagnose"),
    "refit": ("fjr_validation.blind.baselines", "refit_only"),
    "bic": ("fjr_validation.blind.baselines", "lowest_bic"),
    "sparse": ("fjr_validation.blind.baselines", "sparse_regression"),
    "bam": ("fjr_validation.blind.bam", "bam"),
    "pace": ("fjr_validation.blind.pace", "pace"),
    "mujoco": ("fjr_validation.blind.mujoco_sysid", "mujoco_sysid"),
}
"""Module and function of each method by name, the project's own first. A function takes the folder
of bags and the datasheet."""

NEEDED: Mapping[str, tuple[str, ...]] = {
    "bam": ("cma",),
    "pace": ("cma",),
    "mujoco": ("mujoco.sysid", "absl", "colorama", "tabulate", "yaml"),
}
"""Libraries of the extra `rivals` that methods load."""

KEPT = (
    "verdict", "effects", "equivalent", "confidence", "reported_on", "causes", "doubted", "steps",
    "remainder", "evidence", "gap", "gap_closed", "parameters", "notes",
)  # fmt: skip
"""What is kept of a diagnosis; maps and rankings are not."""
_DIGITS = 6


def check_methods(names: Sequence[str]) -> None:
    """Raise InputError for a method that does not exist, or whose libraries are not installed."""
    for name in names:
        if name not in METHODS:
            raise InputError(f"There is no method {name!r}; known are {', '.join(METHODS)}.")
        absent = [library for library in NEEDED.get(name, ()) if not _installed(library)]
        if absent:
            raise InputError(
                f"The method {name} needs {' and '.join(absent)}, not installed here; install "
                "fjr-rig[rivals]."
            )


def _installed(library: str) -> bool:
    try:
        return find_spec(library) is not None
    except ImportError:  # of the package that it is a part of
        return False


def verdicts(case: str, folder: Path, methods: Sequence[str]) -> list[dict[str, Any]]:
    """Return the verdict of each method on a case."""
    return [verdict(case, folder, method) for method in methods]


def verdict(case: str, folder: Path, method: str) -> dict[str, Any]:
    """Return the verdict of a method on a case: what is kept of a diagnosis, or an error.

    A method that fails has failed on this case only; its error is its verdict. The time is that of
    the processor in one thread, reading included, loading the program not: what else the machine
    does hardly changes it.
    """
    from gap_diagnosis.model.nominal import read_nominal

    function = _function(method)
    begin = time.process_time()
    answer: dict[str, Any] = {"case": case, "method": method}
    try:
        diagnosis = function(folder, read_nominal(folder / "nominal.yaml"))
        values = diagnosis.model_dump(mode="json", by_alias=True)
        answer["diagnosis"] = {
            name: _short(values[name]) for name in ("schema", *KEPT) if name in values
        }
    except Exception as error:
        logging.getLogger(__name__).debug("%s failed on %s", method, case, exc_info=True)
        answer["error"] = f"{type(error).__name__}: {error}"
    answer["seconds"] = round(time.process_time() - begin, 2)
    return answer


@cache
def _function(method: str) -> Method:
    """Load a method so that it works in one thread.

    Two cases side by side on two cores are done sooner than each on both. The pools of threads that
    are made while a module is loaded have as many as there are cores for this process.
    """
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    try:
        module, name = METHODS[method]
        function: Method = getattr(import_module(module), name)
    finally:
        os.sched_setaffinity(0, cores)
    return function


def _short(value: Any) -> Any:
    """Return a value with numbers of a few digits."""
    if isinstance(value, float):
        return float(f"{value:.{_DIGITS}g}")
    if isinstance(value, dict):
        return {name: _short(part) for name, part in value.items()}
    if isinstance(value, list):
        return [_short(part) for part in value]
    return value
