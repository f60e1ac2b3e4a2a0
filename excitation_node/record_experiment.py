"""Experiments with a reference that does not repeat: their parameters, descriptions, samples."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fjr_interface.experiment import RecordDescription
from fjr_interface.parameters import Parameter, ParameterGroup
from fjr_kit.errors import InputError

from . import records

RECORD = ParameterGroup(
    Parameter("duration_s", 20.0, "s", "Length of each record", 1e-3, 1e6),
    Parameter(
        "sweep", "linear", "", "How the chirp's frequency rises", choices=("linear", "logarithmic")
    ),
    Parameter(
        "soft_start_s", records.SOFT_START_S, "s", "Rise of chirp and noise from zero", 0.0, 1e6
    ),
    Parameter(
        "velocity_rad_s",
        (1.0,),
        "rad/s",
        "Speed of the trapezoid's moves, one number for all or one for each move in turn",
        1e-9,
        1e6,
    ),
    Parameter("acceleration_rad_s2", 10.0, "rad/s^2", "Acceleration of these moves", 1e-9, 1e9),
    Parameter("dwell_s", 0.2, "s", "Standstill after each move", 0.0, 1e6),
    Parameter("hold_s", 1.0, "s", "How long each step is held", 1e-6, 1e6),
)
"""What a record needs beside amplitudes, band, realizations and seed of EXCITATION."""

KINDS = ("chirp", "noise", "trapezoid", "steps")
_STEPS = 1000  # drawn positions, after which steps repeat


def describe_record(
    kind: str,
    excitation: Mapping[str, Any],
    record: Mapping[str, Any],
    level: int,
    realization: int,
    controller: Mapping[str, Any] | None = None,
) -> RecordDescription:
    """Return the description of one record, from which `record_reference` makes its samples.

    The level's amplitude is the peak of a chirp, the rms of noise, half the stroke of a trapezoid
    about zero, and the greatest position of steps, whose positions are drawn. Noise and steps
    differ between realizations; a chirp and a trapezoid are repeats.

    Args:
        kind: one of KINDS.
        excitation: checked EXCITATION values; sample_rate_hz, amplitudes_rad, f_min_hz, f_max_hz,
            realizations and seed count.
        record: checked RECORD values.
        level: index into amplitudes_rad.
        realization: index below realizations.
        controller: description of the controller that closes the loop.

    Raises:
        InputError: there is no such kind.
    """
    amplitude = excitation["amplitudes_rad"][level]
    seed = np.random.SeedSequence([excitation["seed"], 2, level, realization]).generate_state(1)[0]
    band = {name: excitation[name] for name in ("f_min_hz", "f_max_hz")}
    soft = {"soft_start_s": record["soft_start_s"]}
    if kind == "chirp":
        played = {"amplitude_rad": amplitude, **band, "sweep": record["sweep"], **soft}
    elif kind == "noise":
        played = {"rms_rad": amplitude, **band, "seed": int(seed), **soft}
    elif kind == "trapezoid":
        moves = {name: record[name] for name in ("acceleration_rad_s2", "dwell_s")}
        speeds = list(record["velocity_rad_s"])
        played = {"targets_rad": [amplitude, -amplitude], "velocity_rad_s": speeds, **moves}
    elif kind == "steps":
        count = min(_STEPS, 1 + int(record["duration_s"] / record["hold_s"]))
        drawn = np.random.default_rng(int(seed)).uniform(-amplitude, amplitude, count)
        played = {"targets_rad": drawn.tolist(), "hold_s": record["hold_s"]}
    else:
        raise InputError(f"There is no record {kind}; there are {', '.join(KINDS)}.")
    repeats = realization > 0 and kind in ("chirp", "trapezoid")
    return RecordDescription.of(
        "excitation",
        sample_rate_hz=excitation["sample_rate_hz"],
        samples=max(1, round(record["duration_s"] * excitation["sample_rate_hz"])),
        realization=realization,
        realizations=excitation["realizations"],
        level=level,
        levels=len(excitation["amplitudes_rad"]),
        repeat_of=0 if repeats else None,
        controller=None if controller is None else dict(controller),
        excitation={"kind": kind, **played},
    )


def record_reference(description: RecordDescription) -> np.ndarray:
    """Return the samples of a record that `describe_record` described, float64 (samples,), rad.

    Raises:
        InputError: the description does not say how its reference is made, or not rightly.
    """
    made = dict((description.model_extra or {}).get("excitation") or {})
    kind = made.pop("kind", None)
    if kind not in KINDS or description.samples is None:
        raise InputError(
            "experiment description: excitation is missing, so the reference can't be made again."
        )
    try:
        make = getattr(records, kind)
        return make(description.samples, description.sample_rate_hz, **made)
    except TypeError:
        raise InputError(
            f"experiment description: excitation does not hold the parameters of a {kind}; make "
            "the description again."
        ) from None


def read_reference(path: Path) -> np.ndarray:
    """Read a reference from a text file with one position (rad) a line; # begins a comment.

    Raises:
        InputError: the file cannot be read, or holds anything else.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a file without numbers, which is refused below
            samples = np.loadtxt(path, ndmin=2)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}).") from None
    except ValueError:
        samples = np.zeros((0, 0))
    if samples.shape[1:] != (1,) or not samples.size or not np.isfinite(samples).all():
        raise InputError(f"{path}: must hold one position in rad a line, all finite.")
    return samples[:, 0]
