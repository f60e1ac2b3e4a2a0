"""`fjr record`: a rig started by hand, or the topics of any other, recorded and audited."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fjr_kit.errors import InputError, needing_ros

from .cli_errors import reports_errors
from .graph_options import RIG, Namespace


@reports_errors(kept="what was recorded whole is kept")
def record(
    out: Annotated[
        Path,
        typer.Option(
            metavar="FOLDER", help="Experiment folder; with --topic or --all, the bag, a new one."
        ),
    ],
    topics: Annotated[
        list[str] | None,
        typer.Option(
            "--topic",
            metavar="TOPIC",
            help="Record this topic of any rig instead: /joint_states. Repeatable.",
        ),
    ] = None,
    all_topics: Annotated[
        bool, typer.Option("--all", help="Record all topics that are published now.")
    ] = False,
    duration: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            metavar="S",
            help="Length of a bag of topics, from the first message on; default: until Ctrl-C.",
        ),
    ] = None,
    count: Annotated[
        int, typer.Option(min=1, help="Number of realizations of the rig, one bag each.")
    ] = 1,
    link: Annotated[
        bool,
        typer.Option("--link", help="The rig has a second encoder: record link_position, too."),
    ] = False,
    namespace: Namespace = RIG,
) -> None:
    """Record a rig that was started by hand, or chosen topics of any rig, and audit the bags.

    Without --topic and --all, each realization that the rig's nodes play becomes a bag, as in
    fjr run; one that is under way is passed over. Ctrl-C ends a bag after its last whole period.
    Topics are recorded until Ctrl-C. Works without an installed ROS. Exit status as of fjr check.
    """
    chosen = bool(topics) or all_topics
    if topics and all_topics:
        raise InputError("--topic and --all exclude each other.")
    if duration is not None and not chosen:
        raise InputError("--duration is for topics; a realization ends by itself.")
    if chosen and count != 1:
        raise InputError("--count is for realizations of the rig, not for topics.")
    if chosen and link:
        raise InputError("--link is for realizations of the rig; name link_position as a --topic.")
    for topic in topics or ():
        if not topic.startswith("/"):
            raise InputError(f"--topic {topic}: write the whole name, such as /{topic}.")
    with needing_ros():
        from fjr_bringup.graph.hand_recorder import record_by_hand
        from fjr_bringup.graph.topic_recorder import record_topics
    from rich.console import Console

    from fjr_bringup.campaign.progress import CampaignProgress
    from fjr_interface.topics import LINK_POSITION, SIGNALS
    from fjr_kit.folder_lock import locked_folder
    from fjr_kit.progress import ProgressLine

    from .check import FOUND
    from .check_summary import audited

    well = []

    def audit(bag: Path) -> None:
        well.append(audited(bag, (), None, Console()))

    if chosen:
        with ProgressLine() as line:
            record_topics(out, topics or (), duration, line)
        audit(out)
    else:
        with locked_folder(out), CampaignProgress(done="recorded") as progress:
            signals = (*SIGNALS, LINK_POSITION) if link else SIGNALS
            record_by_hand(out, count, progress, audit, namespace, signals)
    typer.echo(out)
    if not all(well):
        raise typer.Exit(FOUND)
