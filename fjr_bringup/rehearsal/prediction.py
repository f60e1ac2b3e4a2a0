"""Effect of the loop's measured delay: the share of the delay margin it uses, and the BLA's bias.

Both are computed for linear plants. The margin that counts is that of the plant with viscous
friction only, which is what moves when everything slides; beside it stands the margin of the linear
plant that is equivalent at the experiment's amplitude, where dry friction damps, and that without
any friction. The bias is that of the equivalent plant.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import computed_field

from controller_node.law import as_transfer_function, law_of
from fjr_interface.experiment import Experiment
from fjr_kit.errors import InputError
from fjr_kit.result_types import Array, EqualArrays, Number, Unit
from fjr_sim_node.theory.delayed_loop import delay_margin, delayed_g0
from fjr_sim_node.theory.linear import g0
from fjr_sim_node.theory.statistical_linearisation import linearise_experiment

_QUANTILES = 200
_NO_FRICTION = {"fv": 0.0, "fvm": 0.0}


class Prediction(EqualArrays):
    """What the delay does.

    Attributes:
        delay_median_s: median of the delay.
        delay_p99_s: 99 % of the samples have less.
        delay_margin_s: delay margin with viscous friction only; infinity if no delay matters.
        delay_margin_equivalent_s: the same at the experiment's amplitude; NaN if not known.
        delay_margin_frictionless_s: the same without any friction.
        frequency_hz: (F,), excited lines.
        bias_db: (F,), measured over true magnitude of torque -> position.
        bias_deg: (F,), the same for the phase.
    """

    delay_median_s: Annotated[Number, Unit("s")]
    delay_p99_s: Annotated[Number, Unit("s")]
    delay_margin_s: Annotated[Number, Unit("s")]
    delay_margin_equivalent_s: Annotated[Number, Unit("s")]
    delay_margin_frictionless_s: Annotated[Number, Unit("s")]
    frequency_hz: Annotated[np.ndarray, Array("Hz")]
    bias_db: Annotated[np.ndarray, Array("dB")]
    bias_deg: Annotated[np.ndarray, Array("deg")]

    @computed_field  # type: ignore[prop-decorator]
    @property
    def margin_share(self) -> Annotated[Number, Unit("1")]:
        """Share of the delay margin that 99 % of the samples use up at most; inf if it is zero."""
        if self.delay_margin_s == 0.0:
            return math.inf
        return self.delay_p99_s / self.delay_margin_s

    @computed_field  # type: ignore[prop-decorator]
    @property
    def worst_bias_db(self) -> Annotated[Number, Unit("dB")]:
        """Greatest magnitude of the bias in dB."""
        return float(np.abs(self.bias_db).max())

    @computed_field  # type: ignore[prop-decorator]
    @property
    def worst_bias_deg(self) -> Annotated[Number, Unit("deg")]:
        """Greatest magnitude of the bias in degrees."""
        return float(np.abs(self.bias_deg).max())


def predict(values: Mapping[str, Any], experiment: Experiment, delay_s: np.ndarray) -> Prediction:
    """Predict what the delays of a loop do.

    Args:
        values: checked SIMULATOR values of the nominal rig.
        experiment: description with the controller.
        delay_s: measured delays, from the sample instant of y to the torque, (samples,).

    Raises:
        InputError: the controller is of no known kind.
    """
    rate = experiment.sample_rate_hz
    law = as_transfer_function(law_of(experiment.controller, rate))
    viscous = {**values, "fs": 0.0, "fsm": 0.0, "k1": 0.0}
    equivalent = _equivalent(values, experiment)
    equivalent_margin_s = math.nan if equivalent is None else delay_margin(equivalent, law, rate)
    frequency_hz = np.array(experiment.excited_harmonics) * experiment.base_frequency_hz
    bias_db, bias_deg = bla_bias(equivalent or viscous, frequency_hz, rate, delay_s)
    return Prediction(
        delay_median_s=float(np.median(delay_s)),
        delay_p99_s=float(np.quantile(delay_s, 0.99, method="higher")),
        delay_margin_s=delay_margin(viscous, law, rate),
        delay_margin_equivalent_s=equivalent_margin_s,
        delay_margin_frictionless_s=delay_margin(viscous | _NO_FRICTION, law, rate),
        frequency_hz=frequency_hz,
        bias_db=bias_db,
        bias_deg=bias_deg,
    )


def _equivalent(values: Mapping[str, Any], experiment: Experiment) -> dict[str, float] | None:
    """Return the linear plant at the experiment's amplitude, None if none is known."""
    try:
        return linearise_experiment(values, experiment).parameters
    except InputError:  # another law, or no fixed point at this amplitude
        return None


def bla_bias(
    parameters: Mapping[str, Any],
    frequency_hz: np.ndarray,
    sample_rate_hz: float,
    delay_s: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return how far delays turn the response torque -> position: dB and degrees, (F,) each.

    Args:
        parameters: values of PLANT of a linear plant.
        frequency_hz: (F,).
        sample_rate_hz: rate of the samples.
        delay_s: delays that occur, (samples,); their distribution counts.
    """
    spread = np.quantile(delay_s, (np.arange(_QUANTILES) + 0.5) / _QUANTILES)
    late = delayed_g0(parameters, frequency_hz, sample_rate_hz, spread)
    ratio = late / g0(parameters, frequency_hz, sample_rate_hz)
    return 20.0 * np.log10(np.abs(ratio)), np.rad2deg(np.unwrap(np.angle(ratio)))
