"""`fjr simulate`: a campaign, or records, through the batch simulation."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .campaign_options import (
    Levels,
    Out,
    Periods,
    Realizations,
    Rig,
    Seed,
    Set,
    TransientPeriods,
    described_campaign,
)
from .cli_errors import reports_errors
from .worker_options import Workers

if TYPE_CHECKING:
    from fjr_bringup.campaign.plan import Campaign
    from fjr_sim_node.simulation.simulator import Run

Controller = Annotated[
    Path | None,
    typer.Option(
        "--controller",
        metavar="FILE",
        help="Controller file as for fjr import, all gains known, instead of the controller node's "
        "law. The folder must be a new one.",
    ),
]
Record = Annotated[
    str | None,
    typer.Option(
        "--record",
        metavar="KIND|FILE",
        help="Instead of a multisine: chirp, noise, trapezoid, steps, or a text file with one "
        "position in rad a line. The folder must be a new one.",
    ),
]
Duration = Annotated[float | None, typer.Option(help="Length of each record in seconds.")]


@reports_errors(kept="nothing was recorded")
def simulate(
    rig: Rig = None,
    out: Out = None,
    level: Levels = None,
    realizations: Realizations = None,
    periods: Periods = None,
    transient_periods: TransientPeriods = None,
    seed: Seed = None,
    settings: Set = None,
    controller: Controller = None,
    record: Record = None,
    duration: Duration = None,
    workers: Workers = None,
) -> None:
    """Make the same campaign, with the same bags, without ROS and as fast as the machine can.

    With --record the reference does not repeat; --set record.NAME=VALUE sets what a chirp or a move
    needs. With --controller the loop is closed by any linear law, which the controller node does
    not play.
    """
    from fjr_bringup.campaign.batch_run import simulate_campaign
    from fjr_kit.errors import InputError

    from .campaign_folder import fill_folder, new_folder

    folder = out or new_folder()
    own = [setting for setting in settings or [] if setting.strip().startswith("record.")]
    if record is None and (own or duration is not None):
        raise InputError("--duration and --set record.NAME are for a record; give --record too.")
    if record is not None and (periods is not None or transient_periods is not None):
        raise InputError("A record has no periods; leave --periods and --transient-periods out.")
    campaign = described_campaign(
        rig,
        [setting for setting in settings or [] if setting not in own],
        folder,
        amplitudes_rad=tuple(level) if level else None,
        realizations=realizations,
        periods=periods,
        transient_periods=transient_periods,
        seed=seed,
    )
    if record is None and controller is None:
        fill_folder("simulate", partial(simulate_campaign, workers=workers), campaign, folder)
    else:
        _simulate_described(campaign, folder, controller, record, duration, own, workers)
    typer.echo(folder)


def _simulate_described(
    campaign: Campaign,
    folder: Path,
    controller: Path | None,
    record: str | None,
    duration: float | None,
    settings: list[str],
    workers: int | None,
) -> None:
    from controller_node import controller_file, pd_filtered
    from excitation_node.record_experiment import KINDS, RECORD, describe_record, read_reference
    from fjr_bringup.campaign.batch_run import simulate_runs
    from fjr_bringup.campaign.progress import CampaignProgress
    from fjr_bringup.campaign.settings import parse_settings
    from fjr_interface.experiment import RecordDescription
    from fjr_kit.errors import InputError

    if folder.exists():
        raise InputError(f"{folder}: exists already; choose another folder or remove it.")
    excitation = campaign.values["excitation"]
    rate = excitation["sample_rate_hz"]
    law = pd_filtered.describe(campaign.values["controller"])
    if controller is not None:
        structure = controller_file.read_controller(controller)
        law = controller_file.describe(structure, rate, str(controller))
        if "unknown" in law:
            raise InputError(f"{controller}: {law['unknown'][0]} is unknown; give its value here.")
    reference = None
    runs: list[Run]
    if record is None:
        runs = [
            campaign.experiment(*run).model_copy(update={"controller": law})
            for run in campaign.runs
        ]
    elif record in KINDS:
        given = parse_settings(settings, ["record"]).get("record", {})
        values = RECORD.check(
            {**given, **({} if duration is None else {"duration_s": duration})}, "record"
        )
        runs = [describe_record(record, excitation, values, *run, law) for run in campaign.runs]
    else:
        if settings or duration is not None or len(excitation["amplitudes_rad"]) > 1:
            raise InputError(
                f"{record} is played as it is; leave levels, duration and record.* out."
            )
        if not Path(record).is_file():
            raise InputError(
                f"--record {record}: there is no such file; kinds are {', '.join(KINDS)}."
            )
        reference = read_reference(Path(record))
        runs = [
            RecordDescription.of(
                record,
                sample_rate_hz=rate,
                samples=reference.size,
                realization=number,
                realizations=excitation["realizations"],
                repeat_of=0 if number else None,
                controller=law,
                excitation={"kind": "file", "file": Path(record).name},
            )
            for number in range(excitation["realizations"])
        ]
    with CampaignProgress() as progress:
        seconds = [(run.samples or 0) / rate for run in runs]
        progress.expect_s(sum(seconds))
        simulate_runs(
            campaign.values["simulator"],
            runs,
            folder,
            reference=reference,
            progress=progress,
            workers=workers,
        )
