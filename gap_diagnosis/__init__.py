"""The sim-to-real gap: where it lies, which unmodelled effect causes it, how far it shrinks.

Recorded runs and a nominal (datasheet) go in, an `outcome.diagnosis.Diagnosis` and its report come
out. `any_record` reads what a folder holds; `investigation` leads from runs to a verdict: fits of
one explanation (`starts`, `fits`), the search over explanations (`searching`, by `which`), what of
it is kept, and how sure (`verdict`), both `by_turns`, and the gap on data that no fit has seen
(`how_far`). Where fits end at a limit, `further_looks` asks for another one. An experiment of
steady periods comes through `steady_periods`: `gates` before it (are the periods fit for a
diagnosis?), residual maps (`where`), BLA and `next_experiment` after it. All simulate through
`model`; `report` writes what was found. `foresight` says beforehand what could be found.

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
    from .any_record import diagnose, investigate
    from .foresight.foresee import foresee
    from .foresight.foreseen import Foresight
    from .investigation import Investigation
    from .model.nominal import read_nominal
    from .outcome.diagnosis import Diagnosis
    from .report.gap_output import write_diagnosis
else:
    __getattr__, __dir__ = deferred_names(__name__)

__all__ = [
    "Diagnosis",
    "Foresight",
    "Investigation",
    "diagnose",
    "foresee",
    "investigate",
    "read_nominal",
    "write_diagnosis",
]
