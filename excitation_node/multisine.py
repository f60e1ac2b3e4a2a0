"""Random-phase multisines: grid of lines, phases, one period of the signal (paper eq. 13)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fjr_interface.experiment import Experiment
from fjr_interface.parameters import Parameter, ParameterGroup
from fjr_kit.errors import InputError

EXCITATION = ParameterGroup(
    Parameter("sample_rate_hz", 1000.0, "Hz", "Rate of the samples", 1.0, 20_000.0),
    Parameter("base_frequency_hz", 0.1, "Hz", "Line spacing f0; the period is 1/f0", 1e-3, 100.0),
    Parameter("f_min_hz", 0.1, "Hz", "Lowest excited frequency", 1e-3, 1e4),
    Parameter("f_max_hz", 50.0, "Hz", "Highest excited frequency", 1e-3, 1e4),
    Parameter(
        "grid",
        "odd_random",
        "",
        "Which harmonics are excited; odd_random leaves one of each group out as detection line",
        choices=("odd_random", "odd", "full"),
    ),
    Parameter("group", 3, "", "Consecutive odd harmonics per detection line (Fgroup)", 2, 100),
    Parameter(
        "amplitudes_rad",
        (7e-3,),
        "rad",
        "Amplitude of each line, one number for each level",
        0.0,
        10.0,
        symbol="A_k",
        source="paper eq. 13",
    ),
    Parameter(
        "line_shape",
        (1.0,),
        "",
        "Relative amplitude of each excited line, lowest first, times amplitudes_rad; one "
        "number: flat",
        0.0,
        1e6,
    ),
    Parameter(
        "soft_start_s",
        0.0,
        "s",
        "Rise of the reference from zero (raised cosine), within the discarded periods",
        0.0,
        1e6,
    ),
    Parameter("realizations", 7, "", "Phase realizations of each level (M)", 1, 100_000),
    Parameter(
        "order",
        "levels",
        "",
        "Order of the realizations: level after level, or interleaved, one of each level in turn, "
        "so that a drift of the rig does not pose as an effect of amplitude",
        choices=("levels", "interleaved"),
    ),
    Parameter("periods", 2, "", "Periods kept of each realization (P)", 1, 100_000),
    Parameter("transient_periods", 1, "", "Periods discarded before those", 0, 1000),
    Parameter("seed", 1, "", "Seed of the grid and of all phases", 0, 2**31 - 1),
)
"""Everything that fixes an experiment; the same names are parameters of the excitation node."""


@dataclass(frozen=True)
class Grid:
    """Harmonics of f0: excited lines and detection lines that were left out, both ascending."""

    excited: tuple[int, ...]
    detection: tuple[int, ...]


def make_grid(
    lowest: int, highest: int, kind: str = "odd_random", group: int = 3, seed: int = 0
) -> Grid:
    """Choose the lines between two harmonics.

    Args:
        lowest: lowest harmonic allowed.
        highest: highest harmonic allowed.
        kind: `full` (all), `odd` (odd ones), or `odd_random` (odd ones, of which one in each full
            group of consecutive ones is left out at random: a detection line).
        group: size of these groups.
        seed: seed of the choice.

    Raises:
        InputError: no line is left.
    """
    harmonics = np.arange(max(lowest, 1), highest + 1)
    if kind != "full":
        harmonics = harmonics[harmonics % 2 == 1]
    if not harmonics.size:
        raise InputError("f_min_hz and f_max_hz leave no line to excite; widen the band.")
    detection = np.zeros(harmonics.size, bool)
    if kind == "odd_random":
        groups = harmonics.size // group
        chosen = np.random.default_rng([seed, 0]).integers(0, group, groups)
        detection[np.arange(groups) * group + chosen] = True
    return Grid(tuple(harmonics[~detection].tolist()), tuple(harmonics[detection].tolist()))


def draw_phases(seed: int, lines: int) -> np.ndarray:
    """Return uniform phases in [0, 2 pi), float64 of shape (lines,)."""
    return np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, lines)


def one_period(
    harmonics: np.ndarray, amplitudes_rad: np.ndarray, phases_rad: np.ndarray, samples: int
) -> np.ndarray:
    """Return r at t = 0, Ts, ..., (N-1) Ts: float64 of shape (samples,), rad (paper eq. 13)."""
    spectrum = np.zeros(samples // 2 + 1, complex)
    spectrum[np.asarray(harmonics)] = amplitudes_rad * np.exp(1j * phases_rad) * (samples / 2)
    return np.fft.irfft(spectrum, samples)


def reference_period(experiment: Experiment) -> np.ndarray:
    """Return the period of a described experiment as it is played: sample k = 1..N at t = k Ts.

    Raises:
        InputError: the description has no phase_seed, so its reference can't be made again.
    """
    if experiment.phase_seed is None:
        raise InputError(
            "experiment description: phase_seed is missing, so the reference can't be made again."
        )
    period = one_period(
        np.array(experiment.excited_harmonics),
        experiment.amplitudes_rad,
        draw_phases(experiment.phase_seed, len(experiment.excited_harmonics)),
        experiment.samples_per_period,
    )
    return np.roll(period, -1)


def reference(experiment: Experiment) -> np.ndarray:
    """Return all samples of a described experiment, float64 of shape (experiment.samples,)."""
    repeats = experiment.periods + experiment.transient_periods
    samples = np.tile(reference_period(experiment), repeats)
    rise = round(experiment.soft_start_s * experiment.sample_rate_hz)
    if rise:
        samples[:rise] *= 0.5 - 0.5 * np.cos(np.pi * np.arange(1, rise + 1) / rise)
    return samples


def samples_per_period(sample_rate_hz: float, base_frequency_hz: float) -> int:
    """Return N = fs/f0; raise InputError unless it is whole."""
    exact = sample_rate_hz / base_frequency_hz
    whole = round(exact)
    if abs(exact - whole) > 1e-9 * exact:
        raise InputError(
            f"base_frequency_hz {base_frequency_hz:g} Hz gives a period of {exact:.3f} samples at "
            f"{sample_rate_hz:g} Hz; choose it so that sample_rate_hz/base_frequency_hz is whole."
        )
    return whole


def phase_seed(seed: int, level: int, realization: int) -> int:
    """Return the seed of one realization's phases, drawn from the experiment's seed."""
    return int(np.random.SeedSequence([seed, 1, level, realization]).generate_state(1)[0])


def describe(
    parameters: Mapping[str, Any],
    level: int,
    realization: int,
    controller: dict[str, Any] | None = None,
) -> Experiment:
    """Return the description of one realization of the experiment that EXCITATION values fix.

    Args:
        parameters: checked values of EXCITATION.
        level: index into amplitudes_rad.
        realization: index below realizations.
        controller: description of the controller that will close the loop.

    Raises:
        InputError: the values don't fit together.
    """
    rate, spacing = parameters["sample_rate_hz"], parameters["base_frequency_hz"]
    samples = samples_per_period(rate, spacing)
    lowest = int(np.ceil(parameters["f_min_hz"] / spacing - 1e-9))
    highest = int(np.floor(parameters["f_max_hz"] / spacing + 1e-9))
    if 2 * highest >= samples:
        raise InputError(
            f"f_max_hz {parameters['f_max_hz']:g} Hz reaches half of sample_rate_hz; lower it "
            f"below {rate / 2:g} Hz."
        )
    levels = parameters["amplitudes_rad"]
    if not 0 <= level < len(levels) or not 0 <= realization < parameters["realizations"]:
        raise InputError(
            f"There is no level {level}, realization {realization}; the experiment has "
            f"{len(levels)} levels of {parameters['realizations']} realizations."
        )
    if not levels[level] > 0:
        raise InputError(f"amplitudes_rad[{level}] must be greater than zero.")
    grid = make_grid(lowest, highest, parameters["grid"], parameters["group"], parameters["seed"])
    discarded_s = parameters["transient_periods"] * samples / rate
    if parameters["soft_start_s"] > discarded_s:
        raise InputError(
            f"soft_start_s {parameters['soft_start_s']:g} s must end within the discarded periods, "
            f"which last {discarded_s:g} s; shorten it or raise transient_periods."
        )
    return Experiment.of(
        "excitation",
        sample_rate_hz=rate,
        samples_per_period=samples,
        periods=parameters["periods"],
        transient_periods=parameters["transient_periods"],
        realization=realization,
        realizations=parameters["realizations"],
        level=level,
        levels=len(levels),
        order=parameters["order"],
        amplitude_rad=_line_amplitudes(levels[level], parameters["line_shape"], len(grid.excited)),
        excited_harmonics=list(grid.excited),
        detection_harmonics=list(grid.detection),
        phase_seed=phase_seed(parameters["seed"], level, realization),
        soft_start_s=parameters["soft_start_s"],
        controller=controller,
    )


def _line_amplitudes(level: float, shape: tuple[float, ...], lines: int) -> float | list[float]:
    """Return the amplitude of the lines (rad): one number if they are all the same."""
    if not all(part > 0 for part in shape):
        raise InputError("line_shape must be greater than zero on every excited line.")
    if len(shape) == 1:
        return level * shape[0]
    if len(shape) != lines:
        raise InputError(
            f"line_shape has {len(shape)} numbers, but the grid excites {lines} lines; shape this "
            "grid anew, or keep band, grid, group and seed of the one that was shaped."
        )
    return [level * part for part in shape]
