"""Maximum likelihood of any model of a BLA: what is fitted, and the descent that ends every fit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, TypeVar

import numpy as np
from scipy.optimize import least_squares
from typing_extensions import Self

from .sampled import Sampled
from .samples import Samples


@dataclass(frozen=True)
class Task:
    """The lines of a BLA as a fit finds them.

    Attributes:
        samples: the lines.
        sampled: how the model is seen at them.
        delay_s: the delay, or where its search begins.
        free_delay: whether it is fitted.
    """

    samples: Samples
    sampled: Sampled
    delay_s: float = 0.0
    free_delay: bool = False

    @cached_property
    def held(self) -> np.ndarray:
        """What hold and delay make of a model at each line, complex (F,)."""
        return self.sampled.main(self.delay_s)

    @cached_property
    def data(self) -> np.ndarray:
        """G without hold and delay, complex (F, O)."""
        return self.samples.g / self.held[:, None]


class Model(Protocol):
    """A model with p free parameters, at F lines of O outputs."""

    @property
    def values(self) -> np.ndarray:
        """The free parameters, (p,)."""

    def with_values(self, values: np.ndarray) -> Self:
        """Return the model with other free parameters."""

    def seen(self) -> np.ndarray:
        """Return G, complex (F, O)."""

    def response(self) -> tuple[np.ndarray, np.ndarray]:
        """Return G, complex (F, O), and its Jacobian by the free parameters, (F, O, p)."""


AnyModel = TypeVar("AnyModel", bound=Model)


def slopes(samples: Samples, model: Model) -> np.ndarray:
    """Return the Jacobian of the whitened residual, real parts, then imaginary ones, (2 F O, p)."""
    jacobian = samples.whitened(model.response()[1])
    jacobian = jacobian.reshape(-1, jacobian.shape[2])
    return np.concatenate([jacobian.real, jacobian.imag])


def refined(
    samples: Samples, model: AnyModel, evaluations: int, scale: np.ndarray | float = 1.0
) -> AnyModel:
    """Return the model after Levenberg-Marquardt.

    Args:
        samples: the lines.
        model: where the descent begins.
        evaluations: of the model, at the most.
        scale: (p,), units in which the free parameters are moved.
    """

    def residual(values: np.ndarray) -> np.ndarray:
        error = samples.whitened(model.with_values(values * scale).seen() - samples.g).ravel()
        return np.nan_to_num(
            np.concatenate([error.real, error.imag]), nan=1e150, posinf=1e150, neginf=-1e150
        )

    with np.errstate(all="ignore"):
        found = least_squares(
            residual,
            model.values / scale,
            lambda values: np.nan_to_num(
                slopes(samples, model.with_values(values * scale)) * scale
            ),
            method="lm",
            xtol=1e-10,
            ftol=1e-11,
            gtol=1e-11,
            max_nfev=evaluations,
        )
    return model.with_values(found.x * scale)
