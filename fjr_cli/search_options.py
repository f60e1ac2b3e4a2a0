"""Options of the commands that measure in order to find an excitation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
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


def bench_of(graph: bool, out: Path) -> Bench:
    """Return the ROS graph, with bags below `out`, or the batch simulation, as asked for."""
    from fjr_bringup.design.bench import batch_bench, graph_bench

    return graph_bench(out) if graph else batch_bench


def tell(sentence: str) -> None:
    """Print a sentence about the measurement under way on stderr."""
    typer.echo(sentence, err=True)
