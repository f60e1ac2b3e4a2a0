"""What was measured, from whatever source: the one reader of experiments.

A folder of bags goes in; grid, levels, realizations and their samples come out, the same for
analysis and diagnosis. Begin with `any_folder.open_folder`: steady periods or records? Periods are
an `experiment_folder.ExperimentFolder`, which says what the bags are together (`experiment_bag`),
`described` by themselves or `undescribed` and found in their signals (`discover`). `realization`
reduces a bag to spectra in one pass, `periodic` holds an experiment whole, cut into its periods,
`records` whatever does not repeat; `lines`, `spectra`, `noise`, `record_noise` and `encoder_step`
are what these rest on. `driven` and `units` doubt wrong signs and units, `drive_off` leaves out
times of records at which a closed brake holds the axis. `importers` turn foreign files into bags
(`importers.importer.import_files`).

    >>> from fjr_records import open_experiment, read_experiment
    >>> [(bag.level, bag.realization) for bag in open_experiment("rig").bags]
    [(0, 0), (0, 1), (1, 0), (1, 1)]
    >>> first = read_experiment("rig").realizations[0]
    >>> first.position.shape  # in rad; periods, the transient ones first, by samples of a period
    (4, 1000)

    >>> import numpy as np
    >>> from fjr_records import ImportOptions, import_files, parse_map
    >>> columns = {"theta": first.position.ravel(), "i": first.torque.ravel() / 0.25}
    >>> np.savez("log.npz", t=np.arange(4000), **columns)
    >>> asked = ImportOptions(parse_map(["torque=i:0.25", "position=theta", "time=t:ms"]))
    >>> [(description, bag)] = import_files(["log.npz"], "imported", asked)
    >>> description.kind, description.sample_rate_hz, str(bag)
    ('record', 1000.0, 'imported/level_0_realization_000')
"""

from typing import TYPE_CHECKING

from fjr_kit.public_names import deferred_names

if TYPE_CHECKING:
    from .experiment_bag import Override
    from .experiment_folder import ExperimentFolder, open_experiment
    from .importers.import_map import parse_map
    from .importers.importer import import_files
    from .importers.record_file import ImportOptions
    from .periodic import RecordedExperiment, read_experiment
else:
    __getattr__, __dir__ = deferred_names(__name__)

__all__ = [
    "ExperimentFolder",
    "ImportOptions",
    "Override",
    "RecordedExperiment",
    "import_files",
    "open_experiment",
    "parse_map",
    "read_experiment",
]
