"""Which loop a set of records was driven by: known, known but for gains that it shows, or unknown.

The torque is recorded, so a described controller can be checked: played with the recorded reference
and position it must make the recorded torque. Unknown gains are solved from the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from controller_node.gains import unknown_gains
from controller_node.law import as_transfer_function, law_of
from controller_node.transfer_function import TransferFunction
from fjr_records.records import Record, RecordSet

from .controller_gains import identify_gains

Loop = Literal["known", "gains_fitted", "unknown"]

FOLLOWS = 0.98
"""Share of the torque's variance that a controller must explain for its loop to be simulated."""
EXACT = 0.9999
"""Share below which a reader is told that the controller is not the whole truth."""


@dataclass(frozen=True)
class RecordLoop:
    """The loop of a set of records.

    Attributes:
        kind: whether it can be simulated, with gains that were known or solved for.
        laws: the law of each record; empty for an unknown loop.
        gains: gains that were solved for, by name.
        notes: sentences on what was found.
    """

    kind: Loop
    laws: tuple[TransferFunction, ...] = ()
    gains: dict[str, float] | None = None
    notes: tuple[str, ...] = ()


def loop_of(records: RecordSet) -> RecordLoop:
    """Find the loop of records.

    Raises:
        InputError: a controller that is described badly.
    """
    runs = records.records
    if any(r.reference is None or not r.controller for r in runs):
        return RecordLoop("unknown")
    rate = records.sample_rate_hz
    gains: dict[str, float] = {}
    notes: list[str] = []
    if unknown_gains(runs[0].controller):
        gains = _solved(runs, rate)
        notes.append(
            "Gains of the controller solved from the recorded torque: "
            + ", ".join(f"{name} = {value:.4g}" for name, value in gains.items())
            + "."
        )
    laws = tuple(as_transfer_function(law_of(r.controller, rate, gains)) for r in runs)
    worst = min(explained(law, r) for law, r in zip(laws, runs, strict=True))
    if worst < FOLLOWS:
        return RecordLoop(
            "unknown",
            notes=(
                f"The described controller makes {max(worst, 0.0):.1%} of the recorded torque's "
                "variance only, so its loop is not simulated; check the description, and whether "
                "reference, position and torque are of one run and have their signs.",
            ),
        )
    if worst < EXACT:
        notes.append(
            f"The described controller makes {worst:.2%} of the recorded torque's variance, not "
            "all of it: the rest of the controller is part of the gap."
        )
    return RecordLoop("gains_fitted" if gains else "known", laws, gains or None, tuple(notes))


def explained(law: TransferFunction, record: Record) -> float:
    """Return the share of the variance of a recorded torque that a law makes of r and y."""
    assert record.reference is not None
    state = law.entering_state(record.reference, record.position, record.torque)
    made = law.unlimited(record.reference, record.position, state)
    made = np.clip(made, -law.limit_nm, law.limit_nm)
    return 1.0 - float(np.var(record.torque - made) / max(np.var(record.torque), 1e-300))


def _solved(runs: Sequence[Record], rate: float) -> dict[str, float]:
    samples = min(r.samples for r in runs)
    reference = np.array([r.reference[:samples] for r in runs if r.reference is not None])
    torque, position = (
        np.array([getattr(r, name)[:samples] for r in runs]) for name in ("torque", "position")
    )
    controller = runs[0].controller
    assert controller is not None
    return dict(identify_gains(controller, reference, torque, position, rate).values)
