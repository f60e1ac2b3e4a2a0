"""What a folder holds: an experiment of steady periods, or records as they came.

Analysis, diagnosis and plan all ask here, so that they agree on what is periodic and what is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from fjr_interface.bags.files import find_bags
from fjr_interface.bags.reader import BagReader
from fjr_interface.bags.signals import DEFAULT, SignalMap
from fjr_interface.experiment import Experiment, RecordDescription
from fjr_interface.resampling.accuracy import Resampling
from fjr_kit.errors import InputError

from .discover import NoPeriodError
from .drive_off import without_off_times
from .experiment_bag import Override
from .experiment_folder import ExperimentFolder, open_experiment
from .records import RecordSet, read_records, reference_optional

NOT_PERIODIC = "Taken as records, since no steady periods were found"


def open_folder(
    folder: Path | str,
    signal_map: SignalMap = DEFAULT,
    *,
    override: Override | None = None,
    resampling: Resampling | None = None,
    as_records: bool = False,
) -> ExperimentFolder | RecordSet:
    """Open a folder as an experiment of steady periods where it has them, else read its records.

    Bags say by their description which they are. Of bags without one the period is looked for; if
    there is none they are records, and a note says why. Times of records at which the drive is off
    are left out.

    Args:
        folder: experiment folder, or one bag.
        signal_map: which topics and fields are the signals.
        override: period, transient and number of periods, instead of what the bags say.
        resampling: how to bring unevenly sampled bags onto an even grid; None refuses them.
        as_records: whether to take steady periods as records, too.

    Raises:
        InputError: see `open_experiment` and `read_records`; bags of both kinds, or periods that
            are set for records.
    """
    override = override or Override()
    override.check()
    readers = [BagReader(bag, reference_optional(signal_map)) for bag in find_bags(folder)]
    if as_records or _hold_records(folder, readers):
        if override != Override():
            raise InputError(
                f"{folder}: records are not cut into periods; leave out the number of periods, of "
                "transient periods and of samples per period."
            )
        return without_off_times(read_records(folder, signal_map, resampling=resampling))
    try:
        return open_experiment(folder, signal_map, override=override, resampling=resampling)
    except NoPeriodError as error:
        if override != Override() or any(r.experiment is not None for r in readers):
            raise
        records = without_off_times(read_records(folder, signal_map, resampling=resampling))
        why = f"{NOT_PERIODIC} ({str(error).rstrip('.')})."
        return replace(records, notes=(why, *records.notes))


def _hold_records(folder: Path | str, readers: Sequence[BagReader]) -> bool:
    """Tell whether bags are described as records; raise InputError if others are multisines."""
    records = [r.path.name for r in readers if isinstance(r.experiment, RecordDescription)]
    periodic = [r.path.name for r in readers if isinstance(r.experiment, Experiment)]
    if records and periodic:
        raise InputError(
            f"{folder}: {records[0]} is a record that is not periodic but {periodic[0]} is a "
            "multisine; put them into separate folders."
        )
    return bool(records)
