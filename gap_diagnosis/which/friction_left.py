"""Whether what an explanation of records lacks is friction."""

from __future__ import annotations

import numpy as np

from fjr_sim_node import effects as fx

from ..fits.cell_fits import CellFitter
from ..fits.comparison import CellFit
from ..where.remainder import share_of_velocity

FRICTION = tuple(effect.identifier for effect in fx.FRICTION)
"""Effects that are laws of friction."""
_MOST = 0.5  # of the missing torque: what goes with velocity beyond that is friction before all


def lacks_friction(fitter: CellFitter, fit: CellFit) -> bool:
    """Tell whether most of the torque that a fit lacks on the fitted runs goes with velocity."""
    evidence = fitter.evidence
    runs = np.unique(fitter.runs).tolist()
    missing = evidence.simulator.missing_torque(fit.model, runs)
    if not all(np.isfinite(torque).all() for torque in missing):
        return False
    top_hz = evidence.lines * evidence.line_hz
    smooth = max(int(evidence.records.sample_rate_hz / top_hz), 1)
    records = [evidence.records.records[run] for run in runs]
    return share_of_velocity(records, missing, smooth) > _MOST
