"""`fjr check`: what is in a bag, and what is wrong with it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .cli_errors import reports_errors
from .record_options import MapSignals

FOUND = 1
"""Exit status where something is wrong with a bag."""


@reports_errors(kept="nothing was written")
def check(
    bags: Annotated[list[Path], typer.Argument(metavar="BAG...", help="Bags, or folders of bags.")],
    topics: Annotated[
        list[str] | None,
        typer.Option(
            "--topic",
            metavar="TOPIC",
            help="Only this topic, which must have messages; the end of its name is enough: "
            "joint_states. Repeatable.",
        ),
    ] = None,
    signal_map: MapSignals = None,
) -> None:
    """Audit bags of any rig: rate, jitter, loss, stamps, QoS and message definitions of each topic.

    Where the bag has the rig's topics, or --map names the signals of another rig, each of their
    samples is checked as well, as by fjr analyze. Exit status: 0 if all is well, 1 if something is
    wrong, 2 if there is no such bag or topic.
    """
    from rich.console import Console

    from fjr_interface.bags.files import find_bags
    from fjr_interface.bags.signals import SignalMap

    from .check_summary import audited

    sources = SignalMap.parse(signal_map) if signal_map else None
    found = [bag for folder in bags for bag in find_bags(folder)]
    console = Console()
    well = [audited(bag, tuple(topics or ()), sources, console) for bag in found]
    if len(found) > 1:
        console.print(f"{sum(well)} of {len(found)} bags are well.", highlight=False)
    if not all(well):
        raise typer.Exit(FOUND)
