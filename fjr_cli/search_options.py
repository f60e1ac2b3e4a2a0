"""Options of the commands that measure in order to find an excitation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .campaign_options import DryRun, Realizations, Seed, Set, described_campaign, print_estimate

if TYPE_CHECKING:
    from fjr_bringup.campaign.plan import Campaign
    from fjr_bringup.design.bench import Bench

TorqueLimit = Annotated[
    float, typer.Option(min=0.0, help="Peak torque in N m that the rig may not exceed.")
]
PositionLimit = Annotated[
    float, typer.Option(min=0.0, help="Peak motor position in rad that the rig may not exceed.")
]
Graph = Annotated[
    bool, typer.Option("--graph", help="Measure on the ROS graph instead of in batch.")
]


@dataclass(frozen=True)
class SearchOptions:
    """Options of `amplitude` and `shape`: what is measured, and where."""

    torque_limit: TorqueLimit = math.inf
    position_limit: PositionLimit = math.inf
    realizations: Realizations = None
    seed: Seed = None
    settings: Set = None
    graph: Graph = False
    dry_run: DryRun = False

    def campaign(self, rig: Path | None, level: float | None = None) -> Campaign:
        """Return the campaign to measure by, of one amplitude of a line in rad if it is given."""
        return described_campaign(
            rig,
            self.settings,
            amplitudes_rad=None if level is None else (level,),
            realizations=self.realizations,
            seed=self.seed,
        )

    def print_estimate(self, campaign: Campaign, passes: int) -> None:
        """Print what one pass over the campaign's greatest amplitude takes, and the most passes."""
        from fjr_bringup.design.bench import altered

        one = altered(campaign, amplitudes_rad=campaign.values["excitation"]["amplitudes_rad"][-1:])
        print_estimate(one, None, on_graph=self.graph, bags=self.graph)
        typer.echo(f"That is one pass; there are {passes} at the most.")

    def bench(self, out: Path) -> Bench:
        """Return the ROS graph, with bags below `out`, or the batch simulation, as asked for."""
        from fjr_bringup.design.bench import batch_bench, graph_bench

        return graph_bench(out) if self.graph else batch_bench


def tell(sentence: str) -> None:
    """Print a sentence about the measurement under way on stderr."""
    typer.echo(sentence, err=True)
