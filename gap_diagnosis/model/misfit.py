"""The misfit between rig and model: line errors of y over their standard deviation.

The rig is in closed loop with a known controller, so u = C (r - y) exactly: the torque carries no
information beyond the position, and the likelihood is that of Y alone; a second encoder adds that
of Q, without DC, since its zero is nowhere known to the deflection. The variance of a line is that
of the noise (of the mean over periods) plus a budget for the error of the simulation itself, a
fixed share of the line's own size: the gates hold the discretisation below it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fjr_records.periodic import RecordedExperiment
from fjr_records.spectra import line_spectrum

from .rig_model import Model
from .simulated_rig import Simulator

MODEL_ERROR = 1e-3
"""Relative error of a line that is put down to the simulation, not to the rig."""

_DIVERGED = 1e6


class Misfit:
    """Normalised line errors of chosen realizations.

    The error vector holds real and imaginary parts of (Y_model - Y_rig)/std of every line from DC
    to the highest excited or detection line, each scaled so that its expected square is 1 for a
    true model; so the sum of squares is a chi-square with `size` degrees of freedom.
    """

    def __init__(
        self,
        recorded: RecordedExperiment,
        simulator: Simulator,
        noise_std: np.ndarray,
        which: Sequence[int],
        model_error: float = MODEL_ERROR,
    ) -> None:
        """Prepare.

        Args:
            recorded: the experiment.
            simulator: repeats it.
            noise_std: standard deviation of the complex mean line of Y, float64
                (realizations, outputs, lines), rad; outputs are Y, and Q with a second encoder.
            which: indices of the realizations that count.
            model_error: relative share of the simulation's own error.
        """
        self._simulator = simulator
        self.which = tuple(which)
        self._lines = recorded.lines
        self.measured = np.array([_outputs(recorded, index) for index in self.which])
        std = noise_std[list(self.which)]
        self._scale = np.sqrt(2.0) / np.hypot(std, model_error * np.abs(self.measured))
        self._scale[..., 0] /= np.sqrt(2.0)  # DC is real: all its variance is in one part
        self._scale[:, 1:, 0] = 0.0
        self._noise = float(np.sum(std[:, 0] ** 2))

    @property
    def size(self) -> int:
        """Number of real errors."""
        outputs = self.measured.shape[1]
        return len(self.which) * (outputs * (2 * self._lines - 1) - (outputs - 1))

    def errors(self, models: Sequence[Model]) -> np.ndarray:
        """Return the error vectors of several models, float64 (models, errors).

        The DC of a second encoder is always zero, and does not count in `size`.
        A model whose motion diverges has errors of 1e6: bad, but a value and not a crash.
        """
        outputs = self._simulator.many(models, self.which)
        parts = self._parts((line_spectrum(outputs, self._lines) - self.measured) * self._scale)
        parts = np.nan_to_num(parts, nan=_DIVERGED, posinf=_DIVERGED, neginf=-_DIVERGED)
        return np.clip(parts, -_DIVERGED, _DIVERGED)

    def errors_of(self, changes: np.ndarray) -> np.ndarray:
        """Return how changes of the lines of y would change the error vectors.

        Args:
            changes: complex (n, realizations, lines), rad.

        Returns:
            float64 (n, errors); nothing changes a second encoder.
        """
        lines = np.zeros((len(changes), *self.measured.shape), complex)
        lines[:, :, 0] = changes
        return self._parts(lines * self._scale)

    @staticmethod
    def _parts(lines: np.ndarray) -> np.ndarray:
        """Return real and imaginary parts of lines (n, ...) as rows; DC is real."""
        parts = np.concatenate([lines.real, lines[..., 1:].imag], axis=-1)
        return parts.reshape(len(lines), -1)

    def groups(self, bands: int = 4) -> np.ndarray:
        """Return for each error which band of which realization it belongs to, int (errors,)."""
        line = np.concatenate([np.arange(self._lines), np.arange(1, self._lines)])
        outputs = self.measured.shape[1]
        band = np.tile(line * bands // self._lines, outputs)
        return (np.arange(len(self.which))[:, None] * bands + band).ravel()

    def runs(self) -> np.ndarray:
        """Return for each error the place of its realization in `which`, int (errors,)."""
        return self.groups(bands=1)

    def chi2(self, model: Model) -> float:
        """Return the chi-square of one model, per degree of freedom."""
        errors = self.errors([model])[0]
        return float(errors @ errors) / self.size

    def left(self, model: Model) -> float:
        """Return what a model leaves of y beyond noise, all lines alike: sum of squares (rad2).

        In the chi-square an offset is one line of many, however far the rig moves by it.
        """
        lines = line_spectrum(self._simulator.many([model], self.which)[0, :, 0], self._lines)
        return float(np.sum(np.abs(lines - self.measured[:, 0]) ** 2)) - self._noise


def _outputs(recorded: RecordedExperiment, index: int) -> np.ndarray:
    """Return the mean spectra of y, and of q if all realizations have it, (outputs, lines)."""
    realization = recorded.realizations[index]
    signals = [realization.position]
    if recorded.has_link and realization.link is not None:
        signals.append(realization.link)
    return np.array([realization.spectrum(s, recorded.lines).mean(axis=0) for s in signals])
