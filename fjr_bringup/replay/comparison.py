"""Recorded and replayed signals, sample by sample: a table, and `replay.json`."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from fjr_interface.bag_reader import BagReader
from fjr_interface.errors import InputError
from fjr_interface.topics import MOTOR_POSITION, MOTOR_TORQUE, REFERENCE

from .plan import PLAYED_ANEW, ReplayPlan

SCHEMA = "fjr_rig/replay/1"
REPLAY_FILE = "replay.json"

_SIGNALS = {"reference": REFERENCE, "position": MOTOR_POSITION, "torque": MOTOR_TORQUE}
_BLOCK = 2**16


@dataclass(frozen=True)
class Difference:
    """Replayed minus recorded samples of one signal; samples count from 1, values in `unit`.

    Attributes:
        unit: rad or N m.
        played_anew: whether the graph made it anew; else it was taken from the bag.
        samples: how many were compared.
        different: how many differ in any bit.
        first_different: the first of those; None if there are none.
        rms_recorded: rms of the recorded signal.
        mean: mean of the difference.
        rms: rms of the difference.
        worst: greatest magnitude of the difference.
        worst_sample: where that is; None if nothing differs.
        worst_s: time of that sample, in s.
    """

    unit: str
    played_anew: bool
    samples: int = 0
    different: int = 0
    first_different: int | None = None
    rms_recorded: float = 0.0
    mean: float = 0.0
    rms: float = 0.0
    worst: float = 0.0
    worst_sample: int | None = None
    worst_s: float | None = None

    @property
    def identical(self) -> bool:
        """Whether every sample has the same bits."""
        return not self.different

    def with_block(self, stamps: np.ndarray, before: np.ndarray, after: np.ndarray) -> Difference:
        """Take the next samples in: stamps (ns), recorded, replayed, all of shape (samples,)."""
        count = len(before)
        total = self.samples + count
        error = after - before
        bits = np.flatnonzero(before.view(np.int64) != after.view(np.int64))
        first = self.first_different
        if first is None and bits.size:
            first = self.samples + int(bits[0]) + 1
        at = int(np.abs(error).argmax())
        taken = replace(
            self,
            samples=total,
            different=self.different + bits.size,
            first_different=first,
            rms_recorded=_rms(self.rms_recorded, self.samples, before),
            mean=(self.mean * self.samples + float(error.sum())) / total,
            rms=_rms(self.rms, self.samples, error),
        )
        if abs(error[at]) <= self.worst:
            return taken
        worst = float(abs(error[at]))
        return replace(
            taken, worst=worst, worst_sample=self.samples + at + 1, worst_s=float(stamps[at]) * 1e-9
        )


def _rms(before: float, samples: int, more: np.ndarray) -> float:
    """Return the rms over samples of a known rms and more of them."""
    total = before**2 * samples + float(np.square(more).sum())
    return math.sqrt(total / (samples + len(more)))


def compare(recorded: Path, replayed: Path, into: str) -> dict[str, Difference]:
    """Compare the three signals of two bags with the same stamps, in bounded memory.

    Raises:
        InputError: a bag is not whole.
    """
    found = {
        name: Difference(signal.unit, name in PLAYED_ANEW[into])
        for name, signal in _SIGNALS.items()
    }
    readers = (BagReader(recorded).blocks(_BLOCK), BagReader(replayed).blocks(_BLOCK))
    for before, after in zip(*readers, strict=True):
        for name in found:
            pair = getattr(before, name), getattr(after, name)
            found[name] = found[name].with_block(before.stamps_ns, *pair)
    return found


def report(plan: ReplayPlan, differences: dict[str, Difference], kept: Path | None) -> str:
    """Return the text of replay.json.

    Args:
        plan: what was replayed.
        differences: by signal.
        kept: the bag that was recorded; None if it was not kept.
    """
    anew = [each for each in differences.values() if each.played_anew]
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "bag": str(plan.bag),
        "into": plan.into,
        "rig": plan.rig,
        "replayed_bag": None if kept is None else str(kept),
        "sample_rate_hz": plan.experiment.sample_rate_hz,
        "identical": all(each.identical for each in anew),
        "signals": {
            name: {**asdict(each), "identical": each.identical}
            for name, each in differences.items()
        },
        "parameters": plan.values,
    }
    return json.dumps(_finite(document), indent=2, allow_nan=False) + "\n"


def _finite(value: Any) -> Any:
    """Return infinite numbers (no limit, no noise) as null, as JSON has none."""
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def write_report(folder: Path, text: str) -> Path:
    """Write replay.json, as a whole or not at all; return its path."""
    path = folder / REPLAY_FILE
    temporary = folder / f".{REPLAY_FILE}.{os.getpid()}.tmp"
    try:
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written: {error.strerror}.") from None
    return path


def print_table(differences: dict[str, Difference], console: Console) -> None:
    """Print one line for each signal that was played anew, or that should not differ but does."""
    table = Table("signal", "identical", box=SIMPLE_HEAD)
    for title in ("rms", "rms diff.", "worst diff.", "unit", "at sample"):
        table.add_column(title, justify="left" if title == "unit" else "right", no_wrap=True)
    for name, each in differences.items():
        if each.played_anew or each.different:
            table.add_row(name, *_cells(each))
    console.print(table)


def _cells(each: Difference) -> Sequence[str]:
    numbers = [f"{value:.4g}" for value in (each.rms_recorded, each.rms, each.worst)]
    where = "" if each.worst_sample is None else str(each.worst_sample)
    return ("yes" if each.identical else "no", *numbers, each.unit, where)
