"""What the search found, and when an explanation counts: thresholds on held-out misfits.

All thresholds are ratios of misfits, because a rig is never exactly of the model's family. They
were set by hand on training cases of the blind check.
"""

from __future__ import annotations

from dataclasses import dataclass

from .fits import Fit

CERTAIN = 60.0
"""Least fall of the held-out chi-square that an effect must bring, whatever its share."""
SMALL_GAIN = 1.25
"""An effect must lower the held-out misfit of the refit at least by this factor."""
SECOND_GAIN = 2.0
"""A second effect must lower the held-out misfit of the first at least by this factor."""
NOTHING_LEFT = 2.0
"""Held-out misfit per degree of freedom below which nothing is left to explain."""
PLAIN = 4.0
"""The same for the refit alone, where no effect gains anything."""
STANDS_OUT = 40.0
"""An explanation that leaves more must stand out: the refit's misfit beyond noise over its own,
times the next explanation's misfit over its own. A rig's law is never exactly the catalogue's, so a
right one may leave a lot; what only substitutes for an unknown effect has others nearly as good
(at most 18 on the training cases it was set by, right ones at least 90; one later substitute, a
ripple of the torque constant that goes for cogging, passed)."""
MOST_LEFT = 0.5
"""Greatest share of the error of the motion, squared, that an explanation may leave unless noise is
all it leaves: what is left has a cause of its own."""
TIE = 0.5
"""Explanations can't be told apart if their misfits differ by less than this share of what even
the best leaves beyond noise: so much the model's own form may be wrong."""

_NOTHING = 1.0  # misfit per degree of freedom that noise alone leaves


@dataclass(frozen=True)
class Attribution:
    """What the search found.

    Attributes:
        refit: the base parameters alone.
        candidates: all explanations with effects that were fitted, best first; those that have not
            converged stand last.
        best: the explanation chosen; the refit if no effect is called for.
        tied: explanations that the data can't tell from the best, without it.
        explained: whether the best leaves nothing worth explaining.
        complete: whether the search ended by itself, not by its time budget.
        by_noise_alone: held-out misfit per degree of freedom of the best by noise without rounding,
            where a coarse encoder is named; else None.
    """

    refit: Fit
    candidates: tuple[Fit, ...]
    best: Fit
    tied: tuple[Fit, ...]
    explained: bool
    complete: bool = True
    by_noise_alone: float | None = None


def stands_out(left: float, refit: float, rival: float) -> float:
    """Return by how much an explanation beats refit and next explanation, multiplied.

    Args:
        left: its misfit per degree of freedom, above 1.
        refit: that of the refit.
        rival: that of the next explanation.
    """
    return (refit - _NOTHING) / (left - _NOTHING) * rival / left


def tie_limit(left: float, size: int) -> float:
    """Return the held-out misfit below which an explanation can't be told from the best.

    Args:
        left: misfit per degree of freedom of the best.
        size: degrees of freedom of the held-out data.
    """
    return left + 0.5 * CERTAIN / size + TIE * max(left - _NOTHING, 0.0)
