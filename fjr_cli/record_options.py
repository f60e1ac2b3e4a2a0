"""Options by which every command that reads records is told what the bags do not say."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from fjr_records.experiment_bag import Override

MapSignals = Annotated[
    list[str] | None,
    typer.Option(
        "--map",
        metavar="SIGNAL=TOPIC:FIELD[JOINT][:FACTOR]",
        help="Where reference, torque, position or link stands in foreign bags, such as "
        "position=/joint_states:position\\[elbow]; a factor leads to rad and N m, as from a "
        "current: torque=/joint_states:effort\\[elbow]:12. reference=none or link=none leaves it "
        "out. Repeatable.",
    ),
]
SamplesPerPeriod = Annotated[
    int | None,
    typer.Option(
        min=2,
        help="Samples of one period; found in the reference if not given.",
    ),
]
Resample = Annotated[
    str | None,
    typer.Option(
        metavar="auto|HZ",
        help="Bring bags with jittered stamps, clocks of their own or lost samples onto one even "
        "grid, at the rate of the reference or at HZ; the error is stated.",
    ),
]
Periods = Annotated[
    int | None, typer.Option(min=1, help="Periods to keep after the transient; default: all.")
]
TransientPeriods = Annotated[
    int | None,
    typer.Option(min=0, help="Leading periods to discard; default: as described, or found."),
]


@dataclass(frozen=True)
class PeriodOptions:
    """Options of `analyze`, `diagnose` and `fit`: the periods of a multisine."""

    samples_per_period: SamplesPerPeriod = None
    transient_periods: TransientPeriods = None
    periods: Periods = None

    def override(self) -> Override:
        """Return what to take instead of what the bags say."""
        from fjr_records.experiment_bag import Override

        return Override(self.samples_per_period, self.transient_periods, self.periods)
