"""From an experiment to the Best Linear Approximation, with its noise and its distortion.

A folder of bags goes in, a `results.result.Result` and its report come out. Begin with `analysis`,
which leads to `periodic_analysis` of multisines or `record_analysis` of all else; `checks` says
whether the runs are fit for it. The estimators are in `bla` (robust and fast method, local
polynomial; paper eq. 11), levels of distortion in `distortion`, the distance from models (paper
eq. 14) and the best amplitude in `compare`, a parametric model in `fit`. `output` writes results
(`results`) and report (`report`). No ROS is needed.

    >>> from bla_analyzer import analyze, load_result, write_result
    >>> bla = analyze("rig").levels[1].bla
    >>> bla.frequency_hz.shape, bla.g.shape  # Hz; complex, rad/(N m)
    ((17,), (17,))
    >>> page = write_result(analyze("rig"), "rig/analysis", figures=False)
    >>> len(load_result("rig/analysis/result.json").levels)
    2

`fit` makes a parametric model of it: `fit_bla`, `write_fit`. `to_frd` gives the BLA of a level to
python-control, `to_control` its model.
"""

from typing import TYPE_CHECKING

from fjr_kit.public_names import deferred_names

if TYPE_CHECKING:
    from .analysis import analyze
    from .compare.metrics import ReferenceModel
    from .fit.fit_control import to_control
    from .fit.fit_output import write_fit
    from .fit.fit_types import Fit
    from .fit.fitting import fit_bla
    from .output import write_result
    from .results.result import Result, load_result
    from .results.tables import to_frd
else:
    __getattr__, __dir__ = deferred_names(__name__)

__all__ = [
    "Fit",
    "ReferenceModel",
    "Result",
    "analyze",
    "fit_bla",
    "load_result",
    "to_control",
    "to_frd",
    "write_fit",
    "write_result",
]
