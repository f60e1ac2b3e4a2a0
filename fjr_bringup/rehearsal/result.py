"""The outcome of a rehearsal as one value, and as rehearsal.json (docs/rehearsal.md)."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, computed_field

from fjr_kit.check import Check, failed
from fjr_kit.result_types import Document, FreeForm, Number, Unit

from .advice import advice
from .machine import Machine
from .prediction import Prediction
from .timing import Distribution, LoopTiming


class Rehearsal(Document):
    """What a rehearsal found.

    Attributes:
        drive: `simulated` or `external`.
        hardware: whether the drive was said to move hardware.
        domain: ROS domain.
        reach: how far discovery reached, in words.
        planned_s: how long it should have lasted (s).
        ended: how it ended, in words.
        fault: kind and parameters of the fault that was rehearsed, empty without one.
        fault_seed: seed of the fault.
        timing: what was measured.
        prediction: what the measured delay does; None if nothing was answered.
        checks: one for each limit.
        limits: the limits, by name.
        bag: path of the bag, relative to the folder; None if it is not whole.
        bag_damage: why there is none.
        experiment: description of what was played, as plain data.
        machine: what the machine did.
        signals: all messages of r, y and u in the order of their arrival, each of dtype RECORD;
            not written.
    """

    schema_name: Literal["fjr_rig/rehearsal/1"] = Field("fjr_rig/rehearsal/1", alias="schema")
    drive: str
    hardware: bool
    domain: int
    reach: str
    planned_s: Annotated[Number, Unit("s")]
    ended: str
    fault: FreeForm
    fault_seed: int
    timing: LoopTiming
    prediction: Prediction | None
    checks: tuple[Check, ...]
    limits: FreeForm
    bag: str | None
    bag_damage: str | None
    experiment: FreeForm
    machine: Machine
    signals: list[np.ndarray] = Field(exclude=True)

    @property
    def go(self) -> bool:
        """Whether every check passed."""
        return not failed(self.checks)

    @property
    def headline(self) -> str:
        """The verdict in one sentence."""
        if self.go:
            return f"GO: all {len(self.checks)} limits are kept."
        return f"NO-GO: {len(self.reasons)} of {len(self.checks)} limits are not kept."

    @computed_field  # type: ignore[prop-decorator]
    @property
    def verdict(self) -> Literal["GO", "NO-GO"]:
        """The verdict."""
        return "GO" if self.go else "NO-GO"

    @computed_field  # type: ignore[prop-decorator]
    @property
    def reasons(self) -> list[str]:
        """Why it is NO-GO: the sentences of the checks that failed."""
        return [check.sentence for check in failed(self.checks)]

    @computed_field  # type: ignore[prop-decorator]
    @property
    def advice(self) -> list[str]:
        """What to do after a NO-GO, what comes first first."""
        return advice(self.checks, self.machine)


def milliseconds(distribution: Distribution) -> list[float]:
    """Return median, p99, p99.9 and worst in ms."""
    parts = (distribution.p50, distribution.p99, distribution.p999, distribution.worst)
    return [1e3 * part for part in parts]
