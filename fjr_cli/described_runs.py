"""The runs that `--record` and `--controller` describe, in place of a campaign's multisines."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .campaign_options import CampaignOptions

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


@dataclass(frozen=True)
class RunOptions:
    """Options of `plan` and `simulate`: runs in place of a campaign's multisines."""

    controller: Controller = None
    record: Record = None
    duration: Duration = None

    @property
    def given(self) -> bool:
        """Whether they describe any runs."""
        return self.record is not None or self.controller is not None

    def own_settings(self, options: CampaignOptions) -> list[str]:
        """Return the settings that are for a record; raise InputError if options do not fit."""
        from fjr_kit.errors import InputError

        own = [each for each in options.settings or [] if each.strip().startswith("record.")]
        if self.record is None and (own or self.duration is not None):
            raise InputError(
                "--duration and --set record.NAME are for a record; give --record too."
            )
        cut = options.periods is not None or options.transient_periods is not None
        if self.record is not None and cut:
            raise InputError(
                "A record has no periods; leave --periods and --transient-periods out."
            )
        return own

    def runs(self, campaign: Campaign, settings: list[str]) -> tuple[list[Run], np.ndarray | None]:
        """Return the descriptions of all runs, and the reference where a file holds it.

        Args:
            campaign: the campaign that options describe.
            settings: `record.NAME=VALUE`.

        Raises:
            InputError: a bad file, setting or value, or options that do not fit together.
        """
        from excitation_node.record_experiment import KINDS, RECORD, describe_record
        from fjr_bringup.campaign.settings import parse_settings

        excitation, law = campaign.values["excitation"], self._law(campaign)
        if self.record is None:
            told = {"controller": law}
            return [campaign.experiment(*r).model_copy(update=told) for r in campaign.runs], None
        if self.record not in KINDS:
            return self._of_file(self.record, excitation, settings, law)
        given = parse_settings(settings, ["record"]).get("record", {})
        length = {} if self.duration is None else {"duration_s": self.duration}
        values = RECORD.check({**given, **length}, "record")
        return [
            describe_record(self.record, excitation, values, *r, law) for r in campaign.runs
        ], None

    def _law(self, campaign: Campaign) -> dict[str, Any]:
        """Return the description of the controller."""
        from controller_node import controller_file, pd_filtered
        from fjr_kit.errors import InputError

        if self.controller is None:
            return pd_filtered.describe(campaign.values["controller"])
        structure = controller_file.read_controller(self.controller)
        rate = campaign.values["excitation"]["sample_rate_hz"]
        law = controller_file.describe(structure, rate, str(self.controller))
        if structure.steps(rate, f"{self.controller}: controller") > 1 and self.record is None:
            raise InputError(
                f"{self.controller}: controller.rate_hz is above the {rate:g} Hz of the samples, "
                "which records alone can have; add --record, or leave rate_hz out."
            )
        if "unknown" in law:
            raise InputError(
                f"{self.controller}: {law['unknown'][0]} is unknown; give its value here."
            )
        return law

    def _of_file(
        self, record: str, excitation: dict[str, Any], settings: list[str], law: dict[str, Any]
    ) -> tuple[list[Run], np.ndarray]:
        """Return the runs that play a file of positions, and these."""
        from excitation_node.record_experiment import KINDS, read_reference
        from fjr_interface.experiment import RecordDescription
        from fjr_kit.errors import InputError

        if settings or self.duration is not None or len(excitation["amplitudes_rad"]) > 1:
            raise InputError(
                f"{record} is played as it is; leave levels, duration and record.* out."
            )
        if not Path(record).is_file():
            raise InputError(
                f"--record {record}: there is no such file; kinds are {', '.join(KINDS)}."
            )
        reference = read_reference(Path(record))
        runs: list[Run] = [
            RecordDescription.of(
                record,
                sample_rate_hz=excitation["sample_rate_hz"],
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
