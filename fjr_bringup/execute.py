"""What `fjr run`, `fjr simulate` and `fjr demo` do."""

from __future__ import annotations

import itertools
import shlex
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

import typer

from fjr_interface.errors import InputError
from fjr_interface.parameter_file import parse_value

from .campaign import CAMPAIGN_FILE, GROUPS, Campaign
from .guard import INTERRUPTED, needing_ros
from .progress import CampaignProgress

Overrides = dict[str, dict[str, Any]]
Runner = Callable[..., list[Path]]

DEMO: Overrides = {
    "excitation": {
        "amplitudes_rad": (7e-3,),
        "realizations": 7,
        "periods": 2,
        "transient_periods": 1,
    },
    "simulator": {"noise_std_rad": 2e-5},
}
"""The paper's rig near its best amplitude, with the noise of an encoder of about 16 bits."""


def parse_settings(settings: Sequence[str]) -> Overrides:
    """Parse `node.parameter=value`; raise InputError with one sentence."""
    overrides: Overrides = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        node, dot, parameter = name.strip().partition(".")
        if not equals or not dot or node not in GROUPS:
            raise InputError(
                f"--set {setting}: write NODE.PARAMETER=VALUE, where NODE is one of "
                f"{', '.join(GROUPS)}."
            )
        overrides.setdefault(node, {})[parameter.strip()] = parse_value(text, f"--set {setting}")
    return overrides


def overridden(settings: Sequence[str] | None, **excitation: Any) -> Overrides:
    """Parse settings (see `parse_settings`); values of the excitation win over them, not None."""
    overrides = parse_settings(settings or [])
    given = {name: value for name, value in excitation.items() if value is not None}
    overrides["excitation"] = {**overrides.get("excitation", {}), **given}
    return overrides


def run_in_graph(
    rig: Path | None, out: Path | None, overrides: Overrides, *, composed: bool = False
) -> Path:
    """Run a campaign through the ROS graph; return its folder (see `_execute`)."""
    with needing_ros(", or use fjr simulate"):
        from .graph_run import run_campaign

    runner = partial(run_campaign, composed=composed)
    return _execute("run", runner, rig, out, overrides)


def simulate_in_batch(
    rig: Path | None, out: Path | None, overrides: Overrides, *, workers: int | None = None
) -> Path:
    """Make a campaign through the batch simulation; return its folder (see `_execute`)."""
    from .batch_run import simulate_campaign

    return _execute("simulate", partial(simulate_campaign, workers=workers), rig, out, overrides)


def run_demo(folder: Path) -> Path:
    """Run and analyze the demonstration; return the path of its report."""
    from bla_analyzer.plan import Override

    from .analyze import analyze_folder

    run_in_graph(None, folder, DEMO)
    return analyze_folder(folder, None, "robust", [], None, Override())


def _execute(
    command: str,
    runner: Runner,
    rig: Path | None,
    out: Path | None,
    overrides: Mapping[str, Mapping[str, Any]],
) -> Path:
    """Run what a folder lacks of a campaign.

    Args:
        command: name of the command, to say how to resume.
        runner: `run_campaign` or `simulate_campaign`.
        rig: parameter file; None for the folder's own or the paper's.
        out: experiment folder; None for a new one.
        overrides: values that win over the file.

    Raises:
        InputError: bad parameters or folder, or a campaign that failed.
        typer.Exit: Ctrl-C; what is there and how to go on was said.
    """
    folder = out or _new_folder()
    own = folder / CAMPAIGN_FILE
    campaign = Campaign.create(own if rig is None and own.exists() else rig, overrides)
    try:
        with CampaignProgress() as progress:
            runner(campaign, folder, progress=progress)
    except KeyboardInterrupt:
        there = campaign.recorded(folder)
        resume = shlex.join(["fjr", command, "--out", str(folder)])
        typer.echo(
            f"Interrupted: {there} of {len(campaign.runs)} bags are finished and kept in {folder}; "
            f"to go on: {resume}",
            err=True,
        )
        raise typer.Exit(INTERRUPTED) from None
    return folder


def _new_folder() -> Path:
    stem = Path("experiments") / f"{datetime.now():%Y-%m-%d_%H%M%S}"
    numbered = (stem.with_name(f"{stem.name}-{number}") for number in itertools.count(2))
    return next(name for name in itertools.chain([stem], numbered) if not name.exists())
