"""Analysis of a folder of bags: BLA, noise and distortion of each level, as a `Result`."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import numpy as np

from fjr_interface.bags.reader import DEFAULT, SignalMap
from fjr_interface.resampling.accuracy import Resampling
from fjr_kit.check import Check
from fjr_kit.errors import InputError
from fjr_records.experiment_bag import ExperimentBag, Override
from fjr_records.experiment_folder import ExperimentFolder, open_experiment
from fjr_records.realization import Realization, read_realization, signal_blocks

from .bla.fast import fast_bla
from .bla.robust import INPUT_VARIANCE_LIMIT, robust_bla
from .checks import check_realization, periodicity
from .compare.metrics import ReferenceModel, compare
from .distortion.levels import line_levels
from .results.result import BlaEstimate, LevelResult, Method, Result

Progress = Callable[[int, int, str], None]
"""Called after each bag with (bags done, bags, name of the bag)."""

SAME_PHASES = 0.05
"""Two references whose spectra differ by less than this (relative) are the same realization."""


def analyze(
    folder: Path | str,
    *,
    method: Method = "robust",
    signal_map: SignalMap = DEFAULT,
    models: Sequence[ReferenceModel] = (),
    override: Override | None = None,
    resampling: Resampling | None = None,
    progress: Progress | None = None,
) -> Result:
    """Analyze all bags of an experiment folder.

    Args:
        folder: experiment folder, or one bag.
        method: robust (over realizations) or fast (first realization of each level).
        signal_map: which topics and fields are reference, torque and position.
        models: models to compare the BLA with.
        override: period, transient and number of periods, instead of what the bags say.
        resampling: how to bring unevenly sampled bags onto an even grid; None refuses them.
        progress: called after each bag.

    Returns:
        For each level the BLA (paper eq. 11) in rad/(N m) with its variances at the excited lines,
        the spectra of all lines in rad and N m, and the distance from each model in dB^2.

    Raises:
        InputError: bags that are not whole or do not belong together, data that the method cannot
            use, or a response that is periodic at no level.
    """
    if method not in ("robust", "fast"):
        raise InputError(f"method must be robust or fast, not {method!r}.")
    sources = replace(signal_map, link=None)
    experiment = open_experiment(folder, sources, override=override, resampling=resampling)
    realizations = _read(experiment, progress)
    levels: list[LevelResult] = []
    checks: list[Check] = []
    notes = [*experiment.notes]
    if sources.reference is None:
        notes.append("No reference is read: the torque stands for it, as in an open loop.")
    for level, group in groupby(realizations, key=lambda one: one.level):
        result, more_checks, more_notes = _analyze_level(
            level, list(group), experiment, method, models
        )
        levels.append(result)
        checks.extend(more_checks)
        notes.extend(more_notes)
    if all(level.bla is None for level in levels):
        raise InputError(f"{folder}: {notes[-len(levels)]}")
    return Result(
        source=str(folder),
        sample_rate_hz=experiment.grid.sample_rate_hz,
        samples_per_period=experiment.grid.samples_per_period,
        periods=experiment.grid.periods,
        transient_periods=experiment.grid.transient_periods,
        described=experiment.described,
        bags=tuple(bag.name for bag in experiment.bags),
        levels=tuple(levels),
        checks=tuple(checks),
        notes=tuple(notes),
        controller=experiment.controller,
    )


def _read(experiment: ExperimentFolder, progress: Progress | None) -> list[Realization]:
    """Read all bags side by side; the result is in the order of the plan."""
    bags = experiment.bags
    firsts = {bag.level: bag.realization for bag in reversed(bags)}
    with ThreadPoolExecutor(min(len(bags), os.cpu_count() or 1, 8)) as pool:
        tasks = {
            pool.submit(_read_bag, bag, experiment, firsts[bag.level] == bag.realization): bag.name
            for bag in bags
        }
        try:
            for done, task in enumerate(as_completed(tasks), start=1):
                task.result()
                if progress:
                    progress(done, len(bags), tasks[task])
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return [task.result() for task in tasks]


def _read_bag(bag: ExperimentBag, experiment: ExperimentFolder, keep_signals: bool) -> Realization:
    grid = experiment.grid
    periods = signal_blocks(bag.reader, grid.samples_per_period)
    return read_realization(bag.name, bag.level, bag.realization, periods, grid, keep_signals)


def _analyze_level(
    level: int,
    group: Sequence[Realization],
    experiment: ExperimentFolder,
    method: Method,
    models: Sequence[ReferenceModel],
) -> tuple[LevelResult, list[Check], list[str]]:
    grid = experiment.grid
    checks = [check for one in group for check in check_realization(one, grid.lines.excited)]
    used = group if method == "robust" else group[:1]
    reason = _refusal(used, method)
    bla = None
    if reason is None and method == "robust":
        bla = robust_bla([one.spectra for one in used], grid.lines.excited)
    elif reason is None:
        bla = fast_bla(used[0].spectra, grid.lines)
    notes = [reason] if reason else _caveats(group, checks, bla)
    result = _level_result(level, group, used, experiment, bla, models)
    return result, checks, [f"level {level}: {note}" for note in notes]


def _level_result(
    level: int,
    group: Sequence[Realization],
    used: Sequence[Realization],
    experiment: ExperimentFolder,
    bla: BlaEstimate | None,
    models: Sequence[ReferenceModel],
) -> LevelResult:
    grid = experiment.grid
    spectra = [one.spectra for one in used]
    g = None if bla is None else bla.g
    rms = np.sqrt(np.mean([one.mean_square for one in group], axis=0))
    peak = np.max([one.peak for one in group], axis=0)
    signals = group[0].signals
    assert signals is not None
    return LevelResult(
        level=level,
        amplitude_rad=next(
            b.experiment.amplitudes_rad for b in experiment.bags if b.level == level
        ),
        bla=bla,
        excited=line_levels(spectra, grid.lines, grid.lines.excited, g),
        odd=line_levels(spectra, grid.lines, grid.lines.odd, g),
        even=line_levels(spectra, grid.lines, grid.lines.even, g),
        comparisons=tuple(
            compare(bla, model, grid.sample_rate_hz) for model in models if bla is not None
        ),
        signals=signals,
        reference_rms_rad=float(rms[0]),
        torque_rms_nm=float(rms[1]),
        position_rms_rad=float(rms[2]),
        torque_peak_nm=float(peak[1]),
        position_peak_rad=float(peak[2]),
    )


def _refusal(group: Sequence[Realization], method: Method) -> str | None:
    """Return why these realizations allow no BLA, or None."""
    failed = [check for check in map(periodicity, group) if not check.passed]
    if failed:
        worst = max(failed, key=lambda check: check.value)
        return (
            f"the response is not periodic in {len(failed)} of {len(group)} realizations, so there "
            f"is no BLA (up to {worst.value:.2g} of y differs from period to period); lower the "
            "amplitude or raise the sample rate."
        )
    if method == "robust" and len(group) == 1:
        return (
            "the robust method needs two or more realizations and has one; record more, or use the "
            "fast method."
        )
    if method == "robust":
        _refuse_duplicates(group)
    return None


def _refuse_duplicates(group: Sequence[Realization]) -> None:
    references = np.array([one.spectra.reference for one in group])
    scale = np.linalg.norm(references, axis=1)
    for i, one in enumerate(group):
        same = np.linalg.norm(references[i + 1 :] - references[i], axis=1) < SAME_PHASES * scale[i]
        if same.any():
            other = group[i + 1 + int(same.argmax())]
            raise InputError(
                f"{one.name} and {other.name} play the same reference, but the robust method needs "
                "new phases in each realization; remove one of them or use the fast method."
            )


def _caveats(
    group: Sequence[Realization], checks: Sequence[Check], bla: BlaEstimate | None
) -> list[str]:
    """Return what a reader of the BLA must know."""
    assert bla is not None
    notes = []
    if bla.method == "fast" and len(group) > 1:
        notes.append(f"the fast method uses the first of {len(group)} realizations.")
    if bla.method == "fast" and np.isnan(bla.var_total).all():
        notes.append("there are no odd detection lines, so the total variance is unknown.")
    if bla.periods == 1:
        notes.append(
            "with one period the noise is unknown, and neither periodicity nor transient is "
            "checked."
        )
    for name, what in (
        ("transient", "the transient has not decayed"),
        ("input_snr", f"the noise on the torque exceeds {INPUT_VARIANCE_LIMIT:g} of its power"),
    ):
        failed = sum(check.name == name and not check.passed for check in checks)
        if failed:
            notes.append(f"{what} in {failed} of {len(group)} realizations.")
    doubtful = np.flatnonzero(~bla.reliable & np.isfinite(bla.input_relative_variance))
    if doubtful.size:
        notes.append(
            f"Var(U)/|U|^2 exceeds {INPUT_VARIANCE_LIMIT:g} at {doubtful.size} of "
            f"{bla.reliable.size} lines (first at {bla.frequency_hz[doubtful[0]]:g} Hz), where the "
            "BLA may be biased."
        )
    return notes
