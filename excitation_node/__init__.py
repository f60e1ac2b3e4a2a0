"""Excitation: odd random-phase multisines, records, spectrum shaping, and the node that streams.

Parameters go in, an experiment description and the samples of its reference come out. Begin with
`multisine` (grid of lines, phases, signal; paper eq. 13); `records` makes chirps, noise, moves and
steps, which do not repeat, `record_experiment` describes them; `shaping` is the paper's algorithm
1; `node` streams the multisine ahead of the lockstep.

    >>> from excitation_node import EXCITATION, describe, reference
    >>> values = EXCITATION.check({"amplitudes_rad": [0.007], "periods": 2, "transient_periods": 1})
    >>> experiment = describe(values, level=0, realization=0)
    >>> experiment.samples_per_period, len(experiment.excited_harmonics)
    (10000, 167)
    >>> reference(experiment).shape  # in rad, transient included
    (30000,)
"""

from typing import TYPE_CHECKING

from fjr_kit.public_names import deferred_names

if TYPE_CHECKING:
    from .multisine import EXCITATION, describe, reference
else:
    __getattr__, __dir__ = deferred_names(__name__)

__all__ = ["EXCITATION", "describe", "reference"]
