"""The sim-to-real gap: where it lies, which unmodelled effect causes it, how far it shrinks.

A recorded experiment and a nominal (datasheet) go in, an `outcome.diagnosis.Diagnosis` and its
report come out. Begin with `investigation`, which leads through the stages: `gates` (is the record
fit for a diagnosis?), `where` (residual maps), `which` (fits of effects, their attribution),
`how_far` (the gap held out from the fits), `next_experiment`, `report`. All simulate through
`model`. `judgement` and `notes` draw the verdict from what the stages found.

    >>> from gap_diagnosis import diagnose, read_nominal
    >>> diagnosis = diagnose("rig", read_nominal("paper"))
    >>> diagnosis.verdict, diagnosis.equivalent
    ('ambiguous', [['backlash', 'piecewise_stiffness']])
    >>> round(diagnosis.parameters["backlash.half_gap_rad"].value, 4)  # rad
    0.001
"""

from typing import TYPE_CHECKING

from fjr_kit.public_names import deferred_names

if TYPE_CHECKING:
    from .investigation import Investigation, diagnose, investigate
    from .model.nominal import read_nominal
    from .outcome.diagnosis import Diagnosis
    from .report.gap_output import write_diagnosis
else:
    __getattr__, __dir__ = deferred_names(__name__)

__all__ = [
    "Diagnosis",
    "Investigation",
    "diagnose",
    "investigate",
    "read_nominal",
    "write_diagnosis",
]
