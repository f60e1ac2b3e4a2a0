"""Analysis of a folder of bags: BLA, noise and distortion of each level, as a `Result`.

What the excitation is decides the way: multisines go to `periodic_analysis`, all else goes to
`record_analysis`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import get_args

from fjr_interface.bags.signals import DEFAULT, SignalMap
from fjr_interface.resampling.accuracy import Resampling
from fjr_kit.errors import InputError
from fjr_kit.telling import CountedProgress
from fjr_records.any_folder import NOT_PERIODIC, open_folder
from fjr_records.experiment_bag import Override
from fjr_records.records import RecordSet

from .checks import signs
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
    opened = open_folder(folder, signal_map, override=override, resampling=resampling)
    if isinstance(opened, RecordSet):
        return _with_signs(_of_records(opened, method, models))
    has_reference = signal_map.reference is not None
    found = analyze_periodic(opened, method, models, has_reference, progress)
    return _with_signs(found)


def _with_signs(result: Result) -> Result:
    """Return a result with a check of the signs of each level."""
    made = tuple(signs(level.level, level.signals) for level in result.levels)
    return result.model_copy(update={"checks": (*result.checks, *made)})


def _of_records(
    records: RecordSet, method: Method | None, models: Sequence[ReferenceModel]
) -> Result:
    """Analyze records; an error says as well why they are not taken as periodic."""
    try:
        if method in ("robust", "fast"):
            raise InputError(
                f"{records.source}: holds records that are not periodic, and the {method} method "
                "is for multisines; leave the method out."
            )
        return analyze_records(records, models)
    except InputError as error:
        why = [note for note in records.notes if note.startswith(NOT_PERIODIC)]
        raise InputError(" ".join([str(error), *why])) from None
