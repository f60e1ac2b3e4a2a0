"""Analysis of multisines: the BLA of each level from its realizations and periods."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from itertools import groupby

import numpy as np

from fjr_kit.check import Check
from fjr_kit.errors import InputError
from fjr_kit.telling import CountedProgress
from fjr_records.experiment_bag import ExperimentBag
from fjr_records.experiment_folder import ExperimentFolder
from fjr_records.lines import Grid, Lines
from fjr_records.realization import Realization, read_realization, signal_blocks
from fjr_records.spectra import RealizationSpectra

from .bla.arbitrary import arbitrary_bla, run_of_lines
from .bla.fast import fast_bla
from .bla.repeats import pooled, repeat_groups
from .bla.robust import INPUT_VARIANCE_LIMIT, robust_bla
from .bla.sensitivity import of_this_loop
from .checks import check_realization, periodicity, reliable_lines
from .compare.metrics import ReferenceModel, compare
from .distortion.levels import line_levels
from .results.result import BlaEstimate, LevelResult, Method, Result


def analyze_periodic(
    experiment: ExperimentFolder,
    method: Method | None,
    models: Sequence[ReferenceModel],
    has_reference: bool,
    progress: CountedProgress | None,
) -> Result:
    """Estimate the BLA of each level of an experiment of multisines.

    Args:
        experiment: its bags.
        method: robust, fast or local; None for what fits.
        models: models to compare the BLA with.
        has_reference: whether the bags' reference is read, or the torque stands for it.
        progress: called after each bag.

    Raises:
        InputError: data that the method cannot use, or a response that is periodic at no level.
    """
    realizations = _read(experiment, progress)
    levels: list[LevelResult] = []
    checks: list[Check] = []
    notes = [*experiment.notes]
    if 0 < sum(one.spectra.link is not None for one in realizations) < len(realizations):
        notes.append(
            "Some bags have a link position and some have none; levels that lack it somewhere are "
            "those of one output."
        )
    if not has_reference:
        notes.append("No reference is read: the torque stands for it, as in an open loop.")
    for level, group in groupby(realizations, key=lambda one: one.level):
        result, more_checks, more_notes = _analyze_level(
            level, list(group), experiment, method, models
        )
        levels.append(result)
        checks.extend(more_checks)
        notes.extend(more_notes)
    if all(level.bla is None for level in levels):
        raise InputError(f"{experiment.source}: {notes[-len(levels)]}")
    return Result(
        source=experiment.source,
        excitation="periodic",
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


def _read(experiment: ExperimentFolder, progress: CountedProgress | None) -> list[Realization]:
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
    method: Method | None,
    models: Sequence[ReferenceModel],
) -> tuple[LevelResult, list[Check], list[str]]:
    lines = experiment.grid.lines
    checks = [check for one in group for check in check_realization(one, lines.excited)]
    groups, notes = _by_reference(level, group, experiment)
    if any(one.spectra.link is None for one in group):
        groups = [[_without_link(one) for one in members] for members in groups]
    spectra = [pooled([one.spectra for one in members]) for members in groups]
    chosen = method or _fitting_method(spectra, lines)
    used = spectra[:1] if chosen == "fast" else spectra
    reason = _refusal(groups[0] if chosen == "fast" else group, len(spectra), chosen)
    bla = None
    if reason is None:
        bla = _estimate(used, experiment.grid, chosen)
        bla = of_this_loop(bla, experiment.controller, experiment.grid.sample_rate_hz)
        checks.append(reliable_lines(level, bla))
    notes += [reason] if reason else _caveats(len(spectra), group, checks, bla)
    result = _level_result(level, group, used, experiment, bla, models)
    return result, checks, [f"level {level}: {note}" for note in notes]


def _without_link(one: Realization) -> Realization:
    return replace(one, spectra=replace(one.spectra, link=None))


def _by_reference(
    level: int, group: Sequence[Realization], experiment: ExperimentFolder
) -> tuple[list[list[Realization]], list[str]]:
    """Return the realizations of each reference, and what to say where there are repeats."""
    described = {
        bag.realization: bag.experiment.repeat_of for bag in experiment.bags if bag.level == level
    }
    numbers = [one.realization for one in group]
    found = repeat_groups(
        [one.spectra for one in group], [described[number] for number in numbers], numbers
    )
    notes = []
    if len(found) < len(group):
        notes.append(
            f"{len(group)} realizations play {len(found)} different references; those of the same "
            "reference are averaged as further periods of one, and what differs between them "
            "counts as noise."
        )
    return [[group[i] for i in members] for members in found], notes


def _fitting_method(spectra: Sequence[RealizationSpectra], lines: Lines) -> Method:
    if len(spectra) > 1:
        return "robust"
    return "fast" if lines.odd.size and spectra[0].periods > 1 else "local"


def _estimate(spectra: Sequence[RealizationSpectra], grid: Grid, method: Method) -> BlaEstimate:
    if method == "robust":
        return robust_bla(spectra, grid.lines.excited)
    if method == "fast":
        return fast_bla(spectra[0], grid.lines)
    runs = [run_of_lines(one, grid.lines.excited) for one in spectra]
    return arbitrary_bla(runs, grid.sample_rate_hz, at_hz=runs[0].frequency_hz).bla


def _level_result(
    level: int,
    group: Sequence[Realization],
    spectra: Sequence[RealizationSpectra],
    experiment: ExperimentFolder,
    bla: BlaEstimate | None,
    models: Sequence[ReferenceModel],
) -> LevelResult:
    grid = experiment.grid
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
        left_out_hz=np.empty(0),
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


def _refusal(group: Sequence[Realization], references: int, method: Method) -> str | None:
    """Return why these realizations allow no BLA, or None."""
    failed = [check for check in map(periodicity, group) if not check.passed]
    if failed:
        worst = max(failed, key=lambda check: check.value)
        return (
            f"the response is not periodic in {len(failed)} of {len(group)} realizations, so there "
            f"is no BLA (up to {worst.value:.2g} of y differs from period to period); lower the "
            "amplitude or raise the sample rate."
        )
    if method == "robust" and references == 1:
        return (
            "the robust method needs two or more realizations with different references and has "
            "one; record more, or leave the method out."
        )
    return None


def _caveats(
    references: int, group: Sequence[Realization], checks: Sequence[Check], bla: BlaEstimate | None
) -> list[str]:
    """Return what a reader of the BLA must know."""
    assert bla is not None
    notes = []
    if bla.method == "fast" and references > 1:
        notes.append(f"the fast method uses the first of {references} realizations.")
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
