"""`fjr plan`: what an experiment could show, and the quickest one that reaches a target error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .campaign_options import CampaignOptions, Rig
from .cli_errors import reports_errors
from .described_runs import RunOptions
from .option_groups import takes_groups
from .result_options import datasheet_tolerance, effect_names, names_in

if TYPE_CHECKING:
    from fjr_bringup.campaign.plan import Campaign
    from fjr_records.periodic import RecordedExperiment
    from fjr_records.records import RecordSet

ACCURACY = "How accurate a BLA (with --target-db)"
SHOWN = "What it could show (with --nominal, or without FOLDER)"


@reports_errors(kept="nothing was written")
@takes_groups
def plan(
    *,
    folder: Annotated[
        Path | None,
        typer.Argument(
            help="Pilot bags: a few realizations at one or several amplitudes. Without them, the "
            "campaign that --rig, --level and the others describe, as for fjr simulate."
        ),
    ] = None,
    target_db: Annotated[
        float | None,
        typer.Option(
            min=1e-3,
            help="Propose the quickest experiment whose 95 % bound of the error of |G| is at most "
            "this (dB) on 95 % of the lines of the band; needs pilot bags.",
            rich_help_panel=ACCURACY,
        ),
    ] = None,
    band: Annotated[
        tuple[float, float],
        typer.Option(
            metavar="LOW HIGH",
            help="Frequency band of --target-db in Hz.",
            rich_help_panel=ACCURACY,
        ),
    ] = (1.0, 50.0),
    rig_time: Annotated[
        float,
        typer.Option(
            min=1.0, help="Time that the rig can be used, in s.", rich_help_panel=ACCURACY
        ),
    ] = 3600.0,
    resolution: Annotated[
        float | None,
        typer.Option(
            help="Coarsest line spacing in Hz allowed; default: that of the pilot.",
            rich_help_panel=ACCURACY,
        ),
    ] = None,
    nominal: Annotated[
        str | None,
        typer.Option(
            metavar="paper|FILE",
            help="Datasheet of the bare plant as for fjr diagnose: say which of its parameters, "
            "and which effects beside them, the experiment could show. Default for a plan: --rig.",
            rich_help_panel=SHOWN,
        ),
    ] = None,
    effects: Annotated[
        list[str] | None, effect_names("Look at these effects only; default: the catalogue.", SHOWN)
    ] = None,
    tolerance: Annotated[float, datasheet_tolerance(SHOWN)] = 0.1,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write plan.json there.", rich_help_panel=SHOWN),
    ] = None,
    rig: Rig = None,
    options: CampaignOptions,
    described: RunOptions,
) -> None:
    """Predict, before a campaign is recorded, what a diagnosis could show or what a BLA needs.

    FOLDER --target-db X proposes how many realizations (M) and periods (P) a BLA needs, and which
    amplitude and grid, from the noise and distortion of pilot bags. FOLDER --nominal FILE predicts
    how well a diagnosis of such bags would know the datasheet's parameters, and how large each
    effect must be to be named. Without FOLDER it predicts the same for a campaign, or for records,
    that nobody has recorded yet.
    """
    from fjr_kit.errors import InputError

    planned = {"rig": rig, **vars(options), **vars(described)}
    given = [name for name, value in planned.items() if value is not None]
    if folder is None and target_db is not None:
        raise InputError("--target-db needs pilot bags, by which noise and distortion are known.")
    if folder is not None and given:
        name = {"settings": "set"}.get(given[0], given[0].replace("_", "-"))
        raise InputError(f"--{name} describes a plan; leave it out, or leave {folder} out.")
    if folder is not None and target_db is None and nominal is None:
        raise InputError(
            "Give --nominal for what the bags could show, --target-db for what a BLA takes, or "
            "both."
        )
    if folder is not None and target_db is not None:
        _propose(folder, target_db, band, rig_time, resolution)
    if folder is not None and nominal is None:
        return
    asked = names_in(effects)
    if folder is not None:
        _foresee_bags(folder, str(nominal), tolerance, asked, out)
        return
    own = described.own_settings(options)
    campaign = options.campaign(rig, without=own)
    source = str(nominal or rig or "the plan")
    _foresee_plan(campaign, described, own, nominal, source, tolerance, asked, out)


def _propose(
    folder: Path,
    target_db: float,
    band: tuple[float, float],
    rig_time: float,
    resolution: float | None,
) -> None:
    from fjr_bringup.design.planner import propose, read_pilots

    found = propose(read_pilots(folder), target_db, band, rig_time, resolution_hz=resolution)
    typer.echo(
        f"amplitude of a line {found.amplitude_rad:.4g} rad, M {found.realizations}, P "
        f"{found.periods}, {found.transient_periods} discarded periods, line spacing "
        f"{found.base_frequency_hz:g} Hz: {found.time_s:.0f} s of rig time, error "
        f"{found.error_db:.3g} dB from {band[0]:g} to {band[1]:g} Hz."
    )
    if found.error_db > target_db:
        typer.echo(
            f"The target of {target_db:g} dB is out of reach within {rig_time:g} s; this is the "
            "best that fits."
        )
    typer.echo(
        f"fjr run --level {found.amplitude_rad:.5g} --realizations {found.realizations} --periods "
        f"{found.periods} --transient-periods {found.transient_periods} "
        f"--set excitation.base_frequency_hz={found.base_frequency_hz:g} "
        f"--set excitation.f_min_hz={found.base_frequency_hz:g}"
    )


def _foresee_bags(
    folder: Path, nominal: str, tolerance: float, effects: list[str] | None, out: Path | None
) -> None:
    from fjr_records.periodic import RecordedExperiment
    from gap_diagnosis.any_record import read_any
    from gap_diagnosis.model.nominal import read_nominal, refuse_too_stiff, refuse_wrong_units

    values = read_nominal(nominal)
    recorded = read_any(folder)
    refuse_too_stiff(values, recorded.sample_rate_hz, nominal)
    if isinstance(recorded, RecordedExperiment):
        warning = refuse_wrong_units(recorded, values, nominal)
        if warning:
            typer.echo(f"Warning: {warning}", err=True)
    _foresee(recorded, values, None, tolerance, effects, out)


def _foresee_plan(
    campaign: Campaign,
    described: RunOptions,
    settings: list[str],
    nominal: str | None,
    source: str,
    tolerance: float,
    effects: list[str] | None,
    out: Path | None,
) -> None:
    from fjr_bringup.campaign.plan import Campaign
    from fjr_bringup.design.planned import planned_record
    from fjr_sim_node.plant import PLANT
    from gap_diagnosis.model.nominal import read_nominal, refuse_effects, refuse_too_stiff

    if nominal is not None:
        own = {**campaign.values["simulator"], **read_nominal(nominal)}
        campaign = Campaign({**campaign.values, "simulator": own})
    where = f"{source}: /rig/simulator"
    simulator = campaign.values["simulator"]
    refuse_effects(simulator, where)
    values = {name: float(simulator[name]) for name in PLANT.names}
    refuse_too_stiff(values, simulator["sample_rate_hz"], where)
    runs, reference = described.runs(campaign, settings) if described.given else (None, None)
    _foresee(
        planned_record(campaign, runs, reference),
        values,
        campaign.values["excitation"]["realizations"],
        tolerance,
        effects,
        out,
    )


def _foresee(
    recorded: RecordedExperiment | RecordSet,
    values: dict[str, float],
    realizations: int | None,
    tolerance: float,
    effects: list[str] | None,
    out: Path | None,
) -> None:
    from rich.console import Console

    from fjr_kit.atomic import result_folder
    from fjr_kit.progress import ProgressLine
    from gap_diagnosis.foresight.foresee import foresee

    from .plan_summary import print_foresight

    with ProgressLine(transient=True) as progress:
        found = foresee(
            recorded, values, realizations=realizations, tolerance=tolerance, effects=effects,
            progress=progress.report,
        )  # fmt: skip
    if out is not None:
        with result_folder(out, ("plan.json",)) as place:
            (place / "plan.json").write_text(found.to_json(), encoding="utf-8")
    print_foresight(found, Console())
    if out is not None:
        typer.echo(out / "plan.json")
