"""Whether the stamps of positions keep pace with the clock.

What may change in a time, may change in the time that has passed: stamps that run faster than the
clock would stretch every such limit. A position may come late, and then others may follow it at
once; one that comes early by more than that has a wrong stamp.
"""

from __future__ import annotations

_DRIFT = 0.01  # of two clocks that count as one
_SKIP = 0.1  # share of the tolerance that stamps may gain from one position to the next


class Pace:
    """Stamps against the clock, from position to position, run after run.

    Attributes:
        lead_s: how far the stamps are ahead of the clock; negative if positions come late, and then
            no lower than the tolerance.
    """

    def __init__(self) -> None:
        """Begin with stamps and clock together."""
        self.lead_s = 0.0

    def skips(self, left_out_s: float, clock_s: float, tolerance_s: float) -> bool:
        """Return whether more samples are left out than could have been lost since the last one.

        Args:
            left_out_s: sample time of the positions between this one and the last.
            clock_s: time since the last position.
            tolerance_s: how far stamps may be ahead.
        """
        lateness_s = max(-self.lead_s, 0.0)
        return left_out_s - clock_s - lateness_s > _SKIP * tolerance_s

    def pass_time(self, stamps_s: float, clock_s: float, tolerance_s: float) -> bool:
        """Return whether the stamps are still with the clock.

        Args:
            stamps_s: sample time since the last position.
            clock_s: time since the last position.
            tolerance_s: how far stamps may be ahead.
        """
        lead_s = self.lead_s + stamps_s - clock_s
        drift_s = min(_DRIFT * clock_s, abs(lead_s))
        lead_s -= drift_s if lead_s > 0.0 else -drift_s
        self.lead_s = min(max(lead_s, -tolerance_s), tolerance_s)
        return lead_s <= tolerance_s
