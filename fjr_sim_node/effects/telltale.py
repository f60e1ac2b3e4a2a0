"""How an effect shows in the data: in words, and over which quantity it is drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Over = Literal[
    "velocity", "travel", "position", "turn", "deflection", "deflection rate", "load", "command",
    "command rate", "time", "frequency",
]  # fmt: skip
"""The quantity at which a law acts."""
QUANTITIES: dict[Over, tuple[str, str]] = {
    "velocity": ("motor velocity", "rad/s"),
    "travel": ("travel of the motor since it turned round", "rad"),
    "position": ("motor position", "rad"),
    "turn": ("motor position within one period", "rad"),
    "deflection": ("deflection of the transmission", "rad"),
    "deflection rate": ("rate of the deflection", "rad/s"),
    "load": ("torque in the gear", "N m"),
    "command": ("commanded torque", "N m"),
    "command rate": ("rate of the commanded torque", "N m/s"),
    "time": ("time since the first run began", "s"),
    "frequency": ("frequency", "Hz"),
}
"""Name and unit of each; frequency is that of what no torque at one of the others shows."""
Along = Literal["", "velocity", "command", "deflection rate"]
"""What a law has the direction of, so that both directions are folded into one; empty: nothing."""


@dataclass(frozen=True)
class Telltale:
    """How an effect shows in the data, and the axis of the plot that shows it.

    Attributes:
        words: how it shows, in words.
        over: over what the missing torque is drawn, or, over frequency, the error of the position.
        along: in which direction that torque counts as positive, and what it is drawn over too, but
            for an angle, travel and time, which have none.
    """

    words: str
    over: Over
    along: Along = ""
