"""What changes gain on all lines of the evidence, and on those from each of its octaves upwards.

The fall of a sum of squares by the best sizes of some changes, all else following to first order,
takes products of few numbers alone. These are taken band by band and added up from the top. Where
torques are compared along the recorded motion no change drifts, and all lines are one band.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..model.evidence import Evidence

_ROUNDING = 1e-10  # of a sum of squares: what is left of it below that is no more than rounding
_NOTHING = 1e-200


class Gains(NamedTuple):
    """What changes of some kinds gain on the lines from each band upwards.

    Attributes:
        sizes: (bands, kinds), the best ones.
        falls: (bands,), of the sum of squares, by these.
        squares: (bands,), mean square of a change of size 1, beyond what the parameters follow.
    """

    sizes: np.ndarray
    falls: np.ndarray
    squares: np.ndarray


class UpperBands:
    """What a fit leaves on the lines from each band upwards, beyond what its parameters follow."""

    def __init__(
        self, evidence: Evidence, parts: Sequence[int], jacobian: np.ndarray, left: np.ndarray
    ) -> None:
        """Take the products of a fit with itself.

        Args:
            evidence: the records.
            parts: that are fitted.
            jacobian: (errors, parameters), of the fit.
            left: (errors,), its residuals.
        """
        own = 1 if evidence.slow else len(evidence.octaves)
        band = evidence.cell_of(parts) % evidence.bands % own
        self._order, self._band = np.argsort(band, kind="stable"), band
        ends = np.searchsorted(band[self._order], np.arange(own + 1))
        self._slices = [slice(*pair) for pair in itertools.pairwise(ends)]
        self._basis = np.linalg.qr(jacobian)[0]
        self._sorted = self._basis[self._order].T
        self._left = left[self._order]
        self._inverse = np.array(
            [np.linalg.pinv(m, rcond=_ROUNDING, hermitian=True)
             for m in self._upwards(self._sorted, self._sorted)]
        )  # fmt: skip
        self._pulled = self._upwards(self._sorted, self._left[None])
        self._residuals = left

    def __len__(self) -> int:
        """Return the number of bands from which on lines are counted."""
        return len(self._slices)

    def left(self, lowest: int) -> np.ndarray:
        """Return what is left from a band upwards that no parameter follows there, (errors,)."""
        followed = self._basis @ (self._inverse[lowest] @ self._pulled[lowest, :, 0])
        return np.where(self._band >= lowest, self._residuals - followed, 0.0)

    def gains(self, changes: np.ndarray) -> Gains:
        """Return what changes gain; they are (kinds, errors), in units of the residuals."""
        columns = changes[:, self._order]
        along, squares = self._upwards(self._sorted, columns), self._upwards(columns, columns)
        followed = np.swapaxes(along, 1, 2) @ self._inverse
        beyond = squares - followed @ along
        beyond += np.eye(len(columns)) * (_ROUNDING * squares + _NOTHING)
        pull = self._upwards(columns, self._left[None]) - followed @ self._pulled
        sizes = -np.linalg.solve(beyond, pull)[..., 0]
        falls = -np.einsum("bn,bn->b", sizes, pull[..., 0])
        return Gains(sizes, falls, np.trace(beyond, axis1=1, axis2=2) / len(columns))

    def _upwards(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return the products of rows on the lines from each band upwards, (bands, of a, of b)."""
        products = np.array([a[:, one] @ b[:, one].T for one in self._slices])
        return np.cumsum(products[::-1], axis=0)[::-1]
