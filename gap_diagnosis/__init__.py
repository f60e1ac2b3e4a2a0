"""The sim-to-real gap: where it lies, which unmodelled effect causes it, how far it shrinks.

A recorded experiment and a nominal (datasheet) go in, an `outcome.diagnosis.Diagnosis` and its
report come out. `any_record` chooses the way: steady periods go through `investigation`, whatever
does not repeat through `record_investigation`. Both lead through the stages: `gates` (are periods
fit for a diagnosis?), `where` (residual maps, what a remainder looks like), `which` (fits of
effects, their attribution), `how_far` (the gap held out from the fits), `next_experiment`,
`report`. All simulate through `model`. `judgement` and `record_judgement` draw the verdict from
what the stages found. `foresight` says beforehand what they could find.

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
    from .any_record import diagnose
    from .foresight.foresee import foresee
    from .foresight.foreseen import Foresight
    from .investigation import Investigation, investigate
    from .model.nominal import read_nominal
    from .outcome.diagnosis import Diagnosis
    from .record_investigation import RecordInvestigation, investigate_records
    from .report.gap_output import write_diagnosis
else:
    __getattr__, __dir__ = deferred_names(__name__)

__all__ = [
    "Diagnosis",
    "Foresight",
    "Investigation",
    "RecordInvestigation",
    "diagnose",
    "foresee",
    "investigate",
    "investigate_records",
    "read_nominal",
    "write_diagnosis",
]
