"""Recorded and replayed signals, sample by sample, and `replay.json`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, computed_field

from fjr_interface.bags.reader import BagReader
from fjr_interface.topics import MOTOR_POSITION, MOTOR_TORQUE, REFERENCE
from fjr_kit.atomic import write_whole
from fjr_kit.result_types import Document, FreeForm, Number, ResultModel, Unit

from .lockstep_plan import PLAYED_ANEW, ReplayPlan

REPLAY_FILE = "replay.json"

_SIGNALS = {"reference": REFERENCE, "position": MOTOR_POSITION, "torque": MOTOR_TORQUE}
_BLOCK = 2**16


class Difference(ResultModel):
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
    rms_recorded: Number = 0.0
    mean: Number = 0.0
    rms: Number = 0.0
    worst: Number = 0.0
    worst_sample: int | None = None
    worst_s: Annotated[float | None, Unit("s")] = None

    @computed_field  # type: ignore[prop-decorator]
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
        found = {
            "samples": total,
            "different": self.different + bits.size,
            "first_different": first,
            "rms_recorded": _rms(self.rms_recorded, self.samples, before),
            "mean": (self.mean * self.samples + float(error.sum())) / total,
            "rms": _rms(self.rms, self.samples, error),
        }
        worst = float(abs(error[at]))
        if not worst <= self.worst:
            found |= {"worst": worst, "worst_sample": self.samples + at + 1}
            found["worst_s"] = float(stamps[at]) * 1e-9
        return self.model_copy(update=found)


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
        name: Difference(unit=signal.unit, played_anew=name in PLAYED_ANEW[into])
        for name, signal in _SIGNALS.items()
    }
    readers = (BagReader(recorded).blocks(_BLOCK), BagReader(replayed).blocks(_BLOCK))
    for before, after in zip(*readers, strict=True):
        for name in found:
            pair = getattr(before, name), getattr(after, name)
            found[name] = found[name].with_block(before.stamps_ns, *pair)
    return found


class ReplayResult(Document):
    """What a replay found.

    Attributes:
        bag: the bag that was replayed.
        into: `closed-loop`, `plant` or `controller`.
        rig: parameter file of the simulated rig, or `paper`; None where no plant was simulated.
        replayed_bag: the bag that was recorded; None if it was not kept.
        sample_rate_hz: rate of the samples.
        signals: differences of reference, position and torque.
        parameters: of the nodes that took part, by node.
    """

    schema_name: Literal["fjr_rig/replay/1"] = Field("fjr_rig/replay/1", alias="schema")
    bag: str
    into: str
    rig: str | None
    replayed_bag: str | None
    sample_rate_hz: Annotated[Number, Unit("Hz")]
    signals: dict[str, Difference]
    parameters: FreeForm

    @computed_field  # type: ignore[prop-decorator]
    @property
    def identical(self) -> bool:
        """Whether all signals that were played anew have the recorded bits."""
        return all(each.identical for each in self.signals.values() if each.played_anew)


def report(plan: ReplayPlan, differences: dict[str, Difference], kept: Path | None) -> str:
    """Return the text of replay.json.

    Args:
        plan: what was replayed.
        differences: by signal.
        kept: the bag that was recorded; None if it was not kept.
    """
    return ReplayResult(
        bag=str(plan.bag),
        into=plan.into,
        rig=plan.rig,
        replayed_bag=None if kept is None else str(kept),
        sample_rate_hz=plan.experiment.sample_rate_hz,
        signals=differences,
        parameters=plan.values,
    ).to_json()


def write_report(folder: Path, text: str) -> Path:
    """Write replay.json, as a whole or not at all; return its path."""
    path = folder / REPLAY_FILE
    write_whole(path, text)
    return path
