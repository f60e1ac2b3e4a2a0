"""Errors of a model that the recorded torque drives, compared by torque and not by motion.

An error of the motion is that of a torque times the model's own compliance against what holds
it, S = G / (1 + G C): a more sluggish model turns the same torque into less motion. Times the
compliance of the datasheet errors are as large as their torques are, whatever the model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fjr_sim_node.theory.linear import g0

from .evidence import Evidence
from .parts import joined, spans_of
from .rig_model import Model


class TorqueErrors(Evidence):
    """Evidence of records whose errors are those of torques, in motion of the datasheet's rig."""

    def __init__(self, evidence: Evidence, nominal: Mapping[str, float]) -> None:
        """Take the records, their parts and simulations.

        Args:
            evidence: of runs that the recorded torque drives.
            nominal: datasheet values by the names of PLANT.
        """
        self.__dict__.update(vars(evidence))
        self._frequency = (np.arange(self.lines) + 0.5) * self.line_hz
        runs = range(len(self.records.records))
        self._stated = [self._compliance(nominal, index) for index in runs]

    def errors(self, models: Sequence[Model], which: Sequence[int]) -> np.ndarray:
        """Return the errors of models on parts, float64 (models, errors), rad."""
        parts = [self.parts[i] for i in which]
        spans, errors = spans_of(parts), super().errors(models, which)
        factors = []
        for model in models:
            lines = {}
            for index, span in spans.items():
                factor = self._stated[index] / self._compliance(model.whole_plant, index)
                lines[index] = np.tile(factor, (span.stop - span.start, 1))
            factors.append(joined(lines, spans, parts))
        return errors * np.array(factors)

    def _compliance(self, plant: Mapping[str, float], index: int) -> np.ndarray:
        """Return how far a torque moves a rig against what holds it, (lines,), rad/(N m)."""
        g = g0(plant, self._frequency, self.records.sample_rate_hz)
        return np.abs(g / (1.0 + g * self.simulator.response(self._frequency, index)))
