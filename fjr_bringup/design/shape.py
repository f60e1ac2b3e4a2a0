"""`fjr shape`: the loop of algorithm 1 around a rig, until the torque spectrum is as desired."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from bla_analyzer.bla.robust import turned
from bla_analyzer.checks import TRANSIENT_LIMIT
from excitation_node.shaping import (
    Response,
    ShapingGoal,
    flatness_db,
    next_amplitudes,
    within_limits,
)
from fjr_kit.errors import InputError
from fjr_kit.telling import Progress

from ..campaign.plan import Campaign
from .bench import Bench, altered
from .measured import MeasuredLevel, require_periodic


@dataclass(frozen=True)
class Iteration:
    """One pass of the loop: the campaign that was played and what it gave."""

    campaign: Campaign
    level: MeasuredLevel
    response: Response
    flatness_db: float


def response_of(level: MeasuredLevel) -> Response:
    """Return what the shaping step needs of a measured level."""
    torque, _ = turned(level.spectra, level.lines.excited)
    return Response(
        level.amplitudes_rad,
        np.abs(torque.mean(axis=0)),
        float(level.peak[1]),
        float(level.peak[2]),
    )


def lines_rms(response: Response) -> float:
    """Return the torque rms of the excited lines (N m)."""
    return float(np.sqrt(np.sum(response.torque_nm**2) / 2.0))


def shaped(campaign: Campaign, amplitudes_rad: np.ndarray, soft_start_s: float) -> Campaign:
    """Return the campaign with these amplitudes of the lines; its level is their rms."""
    level = float(np.sqrt(np.mean(amplitudes_rad**2)))
    shape = tuple((amplitudes_rad / level).tolist())
    return altered(campaign, amplitudes_rad=(level,), line_shape=shape, soft_start_s=soft_start_s)


def shape(
    campaign: Campaign,
    bench: Bench,
    goal: ShapingGoal | None = None,
    *,
    desired: np.ndarray | float = 1.0,
    iterations: int = 10,
    say: Progress = lambda _: None,
    **limits: Any,
) -> list[Iteration]:
    """Shape the torque spectrum of the campaign's first level.

    Args:
        campaign: rig and experiment; one level is played, from rest with a soft start over the
            discarded periods; the last of them, or half of a single one, lets the loop settle.
        bench: where to measure.
        goal: what to aim at; None keeps the torque rms of the first pass.
        desired: U_des over the excited lines, relative.
        iterations: greatest number of passes after the first.
        say: told about each pass.
        limits: values of the goal that win, such as tolerance_db.

    Returns:
        All passes, the first one unshaped; the last one meets tolerance and limits.

    Raises:
        InputError: the torque spectrum is not as desired after the last pass, a response is not
            periodic, or a limit leaves no room.
    """
    _require_room(campaign)
    excitation = campaign.values["excitation"]
    campaign = altered(campaign, amplitudes_rad=excitation["amplitudes_rad"][:1])
    rising = max(excitation["transient_periods"] - 1, 0.5)
    soft_start_s = rising / excitation["base_frequency_hz"]
    passes = [_play(campaign, bench, 0, desired, say)]
    goal = goal or ShapingGoal(lines_rms(passes[0].response))
    goal = dataclasses.replace(goal, **limits)
    while passes[-1].flatness_db > goal.tolerance_db or not within_limits(
        passes[-1].response, goal
    ):
        if len(passes) > iterations:
            raise InputError(_failure(passes[-1], goal, iterations))
        amplitudes = next_amplitudes(passes[-1].response, goal, desired)
        following = shaped(campaign, amplitudes, soft_start_s)
        passes.append(_play(following, bench, len(passes), desired, say))
    return passes


def _require_room(campaign: Campaign) -> None:
    discarded = campaign.values["excitation"]["transient_periods"]
    if discarded < 1:
        raise InputError(
            "A shaped excitation rises softly in the discarded periods; set "
            "excitation.transient_periods to 1 or more."
        )


def _play(
    campaign: Campaign, bench: Bench, number: int, desired: np.ndarray | float, say: Progress
) -> Iteration:
    level = bench(campaign, f"pass_{number}")
    require_periodic(level, f"pass {number}")
    response = response_of(level)
    one = Iteration(campaign, level, response, flatness_db(response.torque_nm, desired))
    if max(realization.transient for realization in level.realizations) > TRANSIENT_LIMIT:
        say(f"pass {number}: the transient has not decayed; raise excitation.transient_periods.")
    say(
        f"pass {number}: torque spectrum {one.flatness_db:.2f} dB from the desired one, torque "
        f"rms {level.rms[1]:.4g} N m, peak {level.peak[1]:.4g} N m, position peak "
        f"{level.peak[2]:.3g} rad"
    )
    return one


def _failure(last: Iteration, goal: ShapingGoal, iterations: int) -> str:
    return (
        f"After {iterations} iterations the torque spectrum is {last.flatness_db:.2f} dB from the "
        f"desired one (tolerance {goal.tolerance_db:g} dB), torque peak "
        f"{last.response.torque_peak_nm:.4g} N m, position peak "
        f"{last.response.position_peak_rad:.3g} rad; raise the tolerance, the realizations or the "
        "limits, or begin higher than f_min_hz."
    )
