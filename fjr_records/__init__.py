"""What was measured, from whatever source: the one reader of experiments.

A folder of bags goes in; grid, levels, realizations and their samples come out, the same for
analysis and diagnosis. Begin with `experiment_folder.open_experiment`: what the bags are together,
`described` by themselves or `undescribed` and found in their signals (`discover`). `realization`
reduces a bag to spectra in one pass, `periodic` holds an experiment whole, cut into its periods,
`records` whatever does not repeat; `lines`, `spectra`, `noise` and `encoder_step` are what these
rest on. `importers` turn foreign files into bags.

    >>> from fjr_records import open_experiment, read_experiment
    >>> [(bag.level, bag.realization) for bag in open_experiment("rig").bags]
    [(0, 0), (0, 1), (1, 0), (1, 1)]
    >>> first = read_experiment("rig").realizations[0]
    >>> first.position.shape  # in rad; periods, the transient ones first, by samples of a period
    (4, 1000)
"""

from typing import TYPE_CHECKING

from fjr_kit.public_names import deferred_names

if TYPE_CHECKING:
    from .experiment_bag import Override
    from .experiment_folder import ExperimentFolder, open_experiment
    from .periodic import RecordedExperiment, read_experiment
else:
    __getattr__, __dir__ = deferred_names(__name__)

__all__ = [
    "ExperimentFolder",
    "Override",
    "RecordedExperiment",
    "open_experiment",
    "read_experiment",
]
