"""A campaign: every level and realization of one experiment on one rig, and its folder of bags."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from controller_node import pd_filtered
from excitation_node import multisine
from fjr_interface.bags.folder_names import bag_folder
from fjr_interface.bags.reader import audit
from fjr_interface.experiment import Experiment
from fjr_interface.parameter_file import load_parameter_file, save_parameter_file
from fjr_interface.parameters import Value
from fjr_kit.errors import InputError
from fjr_sim_node.simulation.simulator import SIMULATOR, encoder_noise

GROUPS = {
    "excitation": multisine.EXCITATION,
    "controller": pd_filtered.CONTROLLER,
    "simulator": SIMULATOR,
}
"""The parameters of each node that fix a campaign."""

CAMPAIGN_FILE = "campaign.yaml"
"""The parameter file in a campaign's folder; `--params-file` of the nodes takes it as it is."""

MOST_LEVELS = 1000
"""Most amplitudes of one campaign: each is checked before anything starts."""


@dataclass(frozen=True)
class Campaign:
    """All parameters of a campaign, checked, by node.

    Attributes:
        values: {node: {parameter: value}} for excitation, controller and simulator.
    """

    values: dict[str, dict[str, Value]]

    @classmethod
    def create(
        cls,
        file: Path | str | None = None,
        overrides: Mapping[str, Mapping[str, Any]] | None = None,
    ) -> Campaign:
        """Check everything before anything starts.

        Args:
            file: ROS parameter file; None for the paper's rig and the default experiment.
            overrides: {node: {parameter: value}} that win over the file; nodes are excitation,
                controller and simulator, their parameters those of EXCITATION, CONTROLLER and
                SIMULATOR, with the units stated there.

        Raises:
            InputError: a bad file or value, or values that don't fit together.
        """
        given = load_parameter_file(file, groups=GROUPS) if file else {}
        values = {}
        for node, group in GROUPS.items():
            source = f"{file}: {node}" if file else node
            merged = {**given.get(node, {}), **(overrides or {}).get(node, {})}
            values[node] = group.check(merged, source)
        rates = {node: node_values["sample_rate_hz"] for node, node_values in values.items()}
        if len(set(rates.values())) > 1:
            listed = ", ".join(f"{node} {rate:g}" for node, rate in rates.items())
            raise InputError(f"sample_rate_hz differs ({listed}); give all nodes the same.")
        campaign = cls(values)
        if campaign.levels > MOST_LEVELS:
            raise InputError(
                f"amplitudes_rad holds {campaign.levels} amplitudes; give at most {MOST_LEVELS}."
            )
        for level in range(campaign.levels):
            campaign.experiment(level, 0)
        encoder_noise(values["simulator"], campaign.experiment(0, 0))
        return campaign

    @property
    def levels(self) -> int:
        """Number of levels."""
        return len(self.values["excitation"]["amplitudes_rad"])

    @property
    def runs(self) -> list[tuple[int, int]]:
        """All (level, realization), in the order in which they are run."""
        numbers = range(self.values["excitation"]["realizations"])
        all_runs = [(level, number) for level in range(self.levels) for number in numbers]
        if self.values["excitation"]["order"] == "interleaved":
            all_runs.sort(key=lambda run: run[1])
        return all_runs

    def experiment(self, level: int, realization: int) -> Experiment:
        """Return the description of one realization."""
        controller = pd_filtered.describe(self.values["controller"])
        return multisine.describe(self.values["excitation"], level, realization, controller)

    def open_folder(self, folder: Path) -> list[tuple[int, int]]:
        """Make the folder, or take up the campaign that was interrupted in it.

        Returns:
            The runs that have no whole bag yet.

        Raises:
            InputError: the folder holds another campaign, something else, or a damaged bag.
        """
        file = folder / CAMPAIGN_FILE
        if file.exists():
            self._refuse_other(file)
        elif folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InputError(f"{folder} exists and holds no campaign; name another --out folder.")
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{folder} cannot be made: {error.strerror}.") from None
        if not file.exists():
            save_parameter_file(file, self.values, GROUPS)
        return [run for run in self.runs if not self._has_whole_bag(folder, *run)]

    def recorded(self, folder: Path) -> int:
        """Return how many bags of the campaign are in a folder."""
        return sum(bag_folder(folder, *run).exists() for run in self.runs)

    def _refuse_other(self, file: Path) -> None:
        there = load_parameter_file(file, groups=GROUPS)
        for node, group in GROUPS.items():
            recorded = group.check(there.get(node, {}), f"{file}: {node}")
            for name, value in self.values[node].items():
                if recorded[name] != value:
                    raise InputError(
                        f"{file}: {node}.{name} is {recorded[name]}, not {value}: another campaign "
                        "is in this folder; name another --out folder or give the same values."
                    )

    def _has_whole_bag(self, folder: Path, level: int, realization: int) -> bool:
        bag = bag_folder(folder, level, realization)
        if not bag.exists():
            return False
        audit(bag)
        return True
