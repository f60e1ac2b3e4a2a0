"""The runs that `--record` and `--controller` describe, in place of a campaign's multisines."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    import numpy as np

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


def own_settings(
    settings: list[str] | None,
    record: str | None,
    duration: float | None,
    periods: int | None,
    transient_periods: int | None,
) -> list[str]:
    """Return the settings that are for a record; raise InputError if options do not fit."""
    from fjr_kit.errors import InputError

    own = [setting for setting in settings or [] if setting.strip().startswith("record.")]
    if record is None and (own or duration is not None):
        raise InputError("--duration and --set record.NAME are for a record; give --record too.")
    if record is not None and (periods is not None or transient_periods is not None):
        raise InputError("A record has no periods; leave --periods and --transient-periods out.")
    return own


def described_runs(
    campaign: Campaign,
    controller: Path | None,
    record: str | None,
    duration: float | None,
    settings: list[str],
) -> tuple[list[Run], np.ndarray | None]:
    """Return the descriptions of all runs, and the reference where a file holds it.

    Args:
        campaign: the campaign that options describe.
        controller: controller file.
        record: kind of record, or file of its positions.
        duration: of each record, s.
        settings: `record.NAME=VALUE`.

    Raises:
        InputError: a bad file, setting or value, or options that do not fit together.
    """
    from controller_node import controller_file, pd_filtered
    from excitation_node.record_experiment import KINDS, RECORD, describe_record, read_reference
    from fjr_bringup.campaign.settings import parse_settings
    from fjr_interface.experiment import RecordDescription
    from fjr_kit.errors import InputError

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
    return runs, reference
