"""The simulated rig: plant and encoder parameters, encoder noise, one realization in batch."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from controller_node.law import law_as_run, law_of
from excitation_node import multisine, record_experiment
from fjr_interface.experiment import Experiment, RecordDescription
from fjr_interface.parameters import Parameter, ParameterGroup
from fjr_interface.topics import LINK_POSITION, SIGNALS, Signal
from fjr_kit.errors import InputError

from .. import effects, plant
from .closed_loop import Trajectory, simulate

SIMULATOR = ParameterGroup(
    *plant.PLANT,
    *effects.PARAMETERS,
    Parameter("sample_rate_hz", 1000.0, "Hz", "Rate of the samples", 1.0, 20_000.0),
    Parameter("noise_std_rad", 0.0, "rad", "Standard deviation of the encoder noise", 0.0, 10.0),
    Parameter(
        "noise_snr_db",
        math.inf,
        "dB",
        "Encoder noise by signal-to-noise ratio: rms of the noise-free position over the kept "
        "periods to the noise; .inf: none; it excludes noise_std_rad",
        -40.0,
    ),
    Parameter("noise_seed", 1, "", "Seed of the encoder noise", 0, 2**31 - 1),
    Parameter(
        "link_encoder",
        False,
        "",
        "The rig has a second encoder, free of noise: the link's position is recorded as well",
    ),
)
"""Parameters of the simulated rig and of all effects, by the names of the node's parameters."""


def recorded_signals(values: Mapping[str, Any]) -> tuple[Signal, ...]:
    """Return the signals of each sample of a rig's bags, by its checked SIMULATOR values."""
    return (*SIGNALS, LINK_POSITION) if values["link_encoder"] else SIGNALS


Run = Experiment | RecordDescription


def encoder_noise(
    values: Mapping[str, Any], experiment: Run, reference: np.ndarray | None = None
) -> np.ndarray:
    """Return the encoder noise of one realization, float64 of shape (samples,), rad.

    White and Gaussian, seeded by noise_seed, level and realization, so that the node and the batch
    simulation give the same.

    Raises:
        InputError: both noise parameters are given, or the ratio needs a loop that is not known.
    """
    reference = _reference(experiment) if reference is None else reference
    std = _noise_std(values, experiment, reference)
    if std == 0.0:
        return np.zeros(reference.size)
    seed = [values["noise_seed"], experiment.level, experiment.realization]
    return std * np.random.default_rng(seed).standard_normal(reference.size)


def _reference(experiment: Run) -> np.ndarray:
    """Return all samples of the reference that a description stands for."""
    if isinstance(experiment, Experiment):
        return multisine.reference(experiment)
    return record_experiment.record_reference(experiment)


def _noise_std(values: Mapping[str, Any], experiment: Run, reference: np.ndarray) -> float:
    ratio, std = values["noise_snr_db"], values["noise_std_rad"]
    if math.isinf(ratio):
        return std
    if std:
        raise InputError("noise_std_rad and noise_snr_db exclude each other; give one of them.")
    if experiment.controller is None:
        raise InputError(
            "noise_snr_db needs the controller in the experiment description; "
            "give noise_std_rad instead."
        )
    kept = _closed_loop(values, experiment, reference, None).position
    if isinstance(experiment, Experiment):
        kept = kept[experiment.transient_periods * experiment.samples_per_period :]
    return float(np.sqrt(np.mean(kept**2))) * 10.0 ** (-ratio / 20.0)


def _elapsed_s(experiment: Run, samples: int) -> float:
    if isinstance(experiment, Experiment):
        return experiment.elapsed_s
    before = experiment.level * experiment.realizations + experiment.realization
    return before * samples / experiment.sample_rate_hz


def _closed_loop(
    values: Mapping[str, Any], experiment: Run, reference: np.ndarray, noise: np.ndarray | None
) -> Trajectory:
    if experiment.controller is None:
        raise InputError("experiment description: controller is missing, so the loop is not known.")
    rate = experiment.sample_rate_hz
    law, as_run = law_of(experiment.controller, rate), law_as_run(experiment.controller, rate)
    run = simulate(
        reference,
        rate,
        plant.coefficients(values),
        as_run if as_run.steps > 1 else law,
        noise,
        effects.coefficients(values),
        _elapsed_s(experiment, reference.size),
    )
    return replace(run, link=run.motor) if plant.moves_as_one(values) else run


def run_realization(
    values: Mapping[str, Any], experiment: Run, reference: np.ndarray | None = None
) -> Trajectory:
    """Simulate one described realization in batch, encoder noise included.

    Args:
        values: checked SIMULATOR values.
        experiment: description with a controller whose gains are known.
        reference: r, float64 (samples,) in rad; None makes it from the description: of a multisine
            with phase_seed, or of a record that `describe_record` described.

    Returns:
        The sampled signals, (samples,) each, transient periods first.

    Raises:
        InputError: the description doesn't fix the run, or the motion diverged.
    """
    reference = _reference(experiment) if reference is None else reference
    noise = encoder_noise(values, experiment, reference)
    return _closed_loop(values, experiment, reference, noise)
