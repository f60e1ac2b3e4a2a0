"""Parameter files, one per experiment of the paper: each is what `fjr paper` runs there."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from workspace import EXPERIMENTS

from excitation_node.shaping import flatness_db
from fjr_bringup.campaign.plan import Campaign
from fjr_bringup.design.measured import simulate_level
from fjr_bringup.design.shape import lines_rms, response_of
from fjr_validation.paper import fig4, fig5, fig7_to_9
from fjr_validation.paper.levels import campaign_of
from fjr_validation.paper.settings import CASES, FULL

OPTIMUM_RAD = 6.8e-3
"""`fig4.optimum_amplitude` of the full run, docs/paper.md."""


def load(name: str) -> Campaign:
    """Load the file of this name."""
    (file,) = (file for file in EXPERIMENTS if file.stem == name)
    return Campaign.create(file)


def played(parameters: Mapping[str, Any]) -> Campaign:
    """Return the campaign of a task of `fjr paper`, from the arguments of its function."""
    given = dict(parameters)
    realizations = given.pop("realizations", given.pop("candidates", 1))
    periods = given.pop("periods", fig7_to_9.FAST_PERIODS)
    return campaign_of(given.pop("amplitude_rad"), realizations, periods, **given)


FAST_AND_ROBUST = {
    "fig7": "fig7_noise",
    "fig8": "fig8_noise",
    "fig9_friction": "fig9_friction_noise",
    "fig9_transmission": "fig9_transmission_noise",
    "optimum": "fig9_both_noise",
}


@pytest.mark.parametrize(("name", "task_name"), FAST_AND_ROBUST.items())
def test_figs_7_to_9_are_those_of_the_reproduction(name: str, task_name: str) -> None:
    (task,) = (task for task in fig7_to_9.tasks(FULL, OPTIMUM_RAD) if task.name == task_name)
    assert load(name).values == played(task.parameters).values


@pytest.mark.parametrize("case", CASES)
def test_fig_4_is_that_of_the_reproduction_at_all_amplitudes(case: str) -> None:
    campaign = load(f"fig4_{case}")
    tasks = [task for task in fig4.tasks(FULL) if task.name.startswith(f"sweep_{case}_")]
    assert campaign.levels == len(tasks) == 25
    for amplitude, task in zip(campaign.values["excitation"]["amplitudes_rad"], tasks, strict=True):
        expected = played(task.parameters).values
        excitation = {**campaign.values["excitation"], "amplitudes_rad": (amplitude,)}
        assert {**campaign.values, "excitation": excitation} == expected


def test_fig_5_starts_from_the_experiment_of_the_reproduction() -> None:
    expected = campaign_of(
        OPTIMUM_RAD,
        fig5.SHAPING_REALIZATIONS,
        fig5.SHAPING_PERIODS,
        transient_periods=fig5.TRANSIENT_PERIODS,
    )
    assert load("fig5_unshaped").values == expected.values


def test_the_shaped_excitation_gives_a_flat_torque_spectrum() -> None:
    unshaped, shaped = load("fig5_unshaped"), load("shaped")
    differing = {"amplitudes_rad", "line_shape", "soft_start_s"}
    for name, value in unshaped.values["excitation"].items():
        assert name in differing or shaped.values["excitation"][name] == value
    before = response_of(simulate_level(unshaped, 0, range(8)))
    after = [response_of(simulate_level(shaped, level, range(8))) for level in (0, 1)]
    assert flatness_db(before.torque_nm, 1.0) > 5.0
    assert max(flatness_db(each.torque_nm, 1.0) for each in after) < 0.5
    torque = np.array([lines_rms(each) for each in (*after, before)])
    np.testing.assert_allclose(torque, [86.0, 130.0, 130.0], atol=1.0)


def test_no_file_is_forgotten() -> None:
    named = {"fig5_unshaped", "shaped", *FAST_AND_ROBUST, *(f"fig4_{case}" for case in CASES)}
    assert {Path(file).stem for file in EXPERIMENTS} == named
