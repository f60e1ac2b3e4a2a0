"""One bag of an experiment, and what a user may set instead of what the bags say."""

from __future__ import annotations

from dataclasses import dataclass

from fjr_interface.bags.reader import BagReader
from fjr_interface.experiment import Experiment
from fjr_kit.errors import InputError

from .discover import NoPeriodError
from .lines import Grid


@dataclass(frozen=True)
class Override:
    """What the user sets instead of what the bags say; None leaves it.

    Attributes:
        samples_per_period: N.
        transient_periods: periods to discard.
        periods: P to keep.
    """

    samples_per_period: int | None = None
    transient_periods: int | None = None
    periods: int | None = None

    def check(self) -> None:
        """Raise InputError for a number below the least that makes sense."""
        for field, least in (("samples_per_period", 2), ("transient_periods", 0), ("periods", 1)):
            value = getattr(self, field)
            if value is not None and value < least:
                raise InputError(f"{field} must be {least} or more, not {value}.")

    def kept(self, total: int, transient: int) -> tuple[int, int]:
        """Return (transient periods, periods to keep).

        Args:
            total: periods that the bags hold.
            transient: how many of them are transient as far as the bags say.

        Raises:
            NoPeriodError: the bags hold too few.
        """
        if self.transient_periods is not None:
            transient = self.transient_periods
        periods = total - transient if self.periods is None else self.periods
        if periods < 1 or transient + periods > total:
            raise NoPeriodError(
                f"The bags hold {total} periods, too few for {transient} transient periods and "
                f"{max(periods, 1)} to keep; lower transient_periods or periods."
            )
        return transient, periods


@dataclass(frozen=True)
class ExperimentBag:
    """One bag and its place in the experiment.

    Attributes:
        reader: gives its samples.
        experiment: its description with the user's overrides, or what was found in its signals.
    """

    reader: BagReader
    experiment: Experiment

    @property
    def name(self) -> str:
        """The name of the bag's folder."""
        return self.reader.path.name

    @property
    def level(self) -> int:
        """Index of the excitation level."""
        return self.experiment.level

    @property
    def realization(self) -> int:
        """Index of the realization within its level."""
        return self.experiment.realization


Understood = tuple[Grid, tuple[ExperimentBag, ...], list[str]]
"""What bags are together: their grid, the bags in the order (level, realization), and notes."""
