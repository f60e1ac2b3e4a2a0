"""Analysis of a folder of bags: BLA, noise and distortion of each level, as a `Result`.

What the excitation is decides the way: multisines go to `periodic_analysis`, all else goes to
`record_analysis`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import get_args

from fjr_interface.bags.files import find_bags
from fjr_interface.bags.signals import DEFAULT, SignalMap
from fjr_interface.experiment import RecordDescription
from fjr_interface.resampling.accuracy import Resampling
from fjr_interface.resampling.resampled_reader import open_bag
from fjr_kit.errors import InputError
from fjr_kit.telling import CountedProgress
from fjr_records.discover import NoPeriodError
from fjr_records.experiment_bag import Override
from fjr_records.experiment_folder import ExperimentFolder, open_experiment
from fjr_records.records import read_records, reference_optional

from .compare.metrics import ReferenceModel
from .periodic_analysis import analyze_periodic
from .record_analysis import analyze_records
from .results.result import Method, Result


def analyze(
    folder: Path | str,
    *,
    method: Method | None = None,
    signal_map: SignalMap = DEFAULT,
    models: Sequence[ReferenceModel] = (),
    override: Override | None = None,
    resampling: Resampling | None = None,
    progress: CountedProgress | None = None,
) -> Result:
    """Analyze all bags of an experiment folder.

    Args:
        folder: experiment folder, or one bag.
        method: robust (over realizations), fast (first realization of each level, by its detection
            lines) or local (local polynomials, any excitation); None for what fits: multisines of
            two or more realizations robust, of one fast if it has odd detection lines and two
            periods, all else local.
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
    if method not in (None, *get_args(Method)):
        raise InputError(f"method must be robust, fast or local, not {method!r}.")
    experiment = _periodic(folder, signal_map, override, resampling)
    if isinstance(experiment, NoPeriodError):
        if method in ("robust", "fast"):
            raise experiment
        sources = replace(signal_map, link=None)
        records = read_records(folder, sources, resampling=resampling)
        records = replace(records, notes=(_not_periodic(experiment), *records.notes))
        return analyze_records(records, models)
    has_reference = signal_map.reference is not None
    return analyze_periodic(experiment, method, models, has_reference, progress)


def _periodic(
    folder: Path | str,
    signal_map: SignalMap,
    override: Override | None,
    resampling: Resampling | None,
) -> ExperimentFolder | NoPeriodError:
    """Return the experiment, or why it is none of multisines.

    Raises:
        InputError: bags of both kinds, or bags that are damaged.
    """
    optional = reference_optional(signal_map)
    readers = [open_bag(bag, optional, resampling) for bag in find_bags(folder)]
    records = [r.path.name for r in readers if isinstance(r.experiment, RecordDescription)]
    if records:
        if len(records) < len(readers):
            other = next(r.path.name for r in readers if r.path.name not in records)
            raise InputError(
                f"{folder}: {records[0]} is a record that is not periodic but {other} is a "
                "multisine; put them into separate folders."
            )
        return NoPeriodError(
            f"{folder}: described as records that are not periodic; robust and fast method are for "
            "multisines, so leave the method out."
        )
    try:
        return open_experiment(folder, signal_map, override=override, resampling=resampling)
    except NoPeriodError as error:
        if any(r.experiment is not None for r in readers) or override not in (None, Override()):
            raise
        return error


def _not_periodic(why: NoPeriodError) -> str:
    return f"Not analysed as periodic: {str(why).partition('; ')[0].rstrip('.')}."
