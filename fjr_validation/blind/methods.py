"""The methods that a blind check compares, and their application to one case."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from fjr_kit.errors import InputError
from fjr_sim_node.plant import PLANT
from gap_diagnosis.any_record import diagnose
from gap_diagnosis.outcome.diagnosis import Diagnosis

from .baselines import BASELINES

Method = Callable[[Path, Mapping[str, float]], Diagnosis]

OURS = "fjr"
METHODS: dict[str, Method] = {OURS: diagnose, **BASELINES}
"""All methods by name, the project's own first."""

NOMINAL: dict[str, float] = {p.name: float(str(p.default)) for p in PLANT}
"""The datasheet that every method is given: the paper's values."""


def check_methods(names: list[str]) -> None:
    """Raise InputError for a method that does not exist."""
    unknown = [name for name in names if name not in METHODS]
    if unknown:
        raise InputError(f"There is no method {unknown[0]!r}; known are {', '.join(METHODS)}.")


def verdict(method: str, folder: Path) -> dict[str, Any]:
    """Return the verdict of a method on a case: a diagnosis or an error, and what it took.

    A method that fails has failed on this case only; its error is its verdict.
    """
    begin = time.perf_counter()
    answer: dict[str, Any] = {"case": folder.name, "method": method}
    try:
        diagnosis = METHODS[method](folder, NOMINAL)
        answer["diagnosis"] = diagnosis.model_dump(mode="json", by_alias=True)
    except Exception as error:
        logging.getLogger(__name__).exception("%s failed on %s", method, folder.name)
        answer["error"] = f"{type(error).__name__}: {error}"
    answer["seconds"] = round(time.perf_counter() - begin, 3)
    return answer
