"""What `fjr run`, `fjr simulate` and `fjr demo` share: a campaign's bags come into its folder."""

from __future__ import annotations

import itertools
import shlex
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from fjr_bringup.campaign.plan import Campaign
from fjr_bringup.campaign.progress import CampaignProgress
from fjr_kit.folder_lock import locked_folder

from .cli_errors import INTERRUPTED, leave

Runner = Callable[..., list[Path]]
"""`run_campaign` or `simulate_campaign`: records what a folder lacks of a campaign."""


def fill_folder(command: str, runner: Runner, campaign: Campaign, folder: Path) -> None:
    """Record what a folder lacks of a campaign; at Ctrl-C, say what is there and how to go on.

    Args:
        command: name of the command, to say how to resume.
        runner: what records.
        campaign: what to record.
        folder: experiment folder.

    Raises:
        InputError: a bad folder, or a campaign that failed.
        typer.Exit: Ctrl-C.
    """
    try:
        with locked_folder(folder), CampaignProgress() as progress:
            runner(campaign, folder, progress=progress)
    except KeyboardInterrupt:
        there = campaign.recorded(folder)
        resume = shlex.join(["fjr", command, "--out", str(folder)])
        leave(
            f"Interrupted: {there} of {len(campaign.runs)} bags are finished and kept in {folder}; "
            f"to go on: {resume}",
            INTERRUPTED,
        )


def new_folder() -> Path:
    """Return a folder below ./experiments that does not exist yet, named by the time of day."""
    stem = Path("experiments") / f"{datetime.now():%Y-%m-%d_%H%M%S}"
    numbered = (stem.with_name(f"{stem.name}-{number}") for number in itertools.count(2))
    return next(name for name in itertools.chain([stem], numbered) if not name.exists())
