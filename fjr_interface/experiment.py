"""The experiment description: JSON on the `experiment` topic and in a bag's `custom_data`."""

from __future__ import annotations

import json
from typing import Any, Final, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from .errors import InputError
from .topics import CONTROLLER_TOPIC, stamps_ns

SCHEMA: Final = "fjr_rig/experiment/1"
CUSTOM_DATA_KEY = "experiment"

Harmonics = list[int]


class Experiment(BaseModel):
    """What was played in one realization, as in the interface's experiment description.

    Harmonics are multiples of the grid's base frequency f0 = sample_rate_hz / samples_per_period.
    The reference rises from zero over soft_start_s (raised cosine), within the discarded periods.
    Realizations are played level after level, or interleaved: one of each level in turn.
    Further keys are kept and ignored.
    """

    model_config = ConfigDict(frozen=True, extra="allow", populate_by_name=True)

    schema_name: Literal["fjr_rig/experiment/1"] = Field(SCHEMA, alias="schema")
    sample_rate_hz: float = Field(gt=0, le=1e6, allow_inf_nan=False)
    samples_per_period: int = Field(ge=2, le=10**8)
    periods: int = Field(ge=1, le=10**6)
    transient_periods: int = Field(ge=0, le=10**6)
    realization: int = Field(0, ge=0)
    realizations: int = Field(1, ge=1)
    level: int = Field(0, ge=0)
    levels: int = Field(1, ge=1)
    order: Literal["levels", "interleaved"] = "levels"
    amplitude_rad: float | list[float]
    excited_harmonics: Harmonics = Field(min_length=1)
    detection_harmonics: Harmonics = []
    phase_seed: int | None = None
    soft_start_s: float = Field(0.0, ge=0, le=1e6, allow_inf_nan=False)
    controller: dict[str, Any] | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Experiment:
        amplitudes = np.atleast_1d(self.amplitude_rad)
        if not np.isfinite(amplitudes).all():
            raise ValueError("amplitude_rad must be finite")
        if amplitudes.size not in (1, len(self.excited_harmonics)):
            raise ValueError("amplitude_rad must be one number or one for each excited harmonic")
        harmonics = self.excited_harmonics + self.detection_harmonics
        if len(set(harmonics)) != len(harmonics):
            raise ValueError(
                "a harmonic is named twice in excited_harmonics and detection_harmonics"
            )
        if min(harmonics) < 1 or 2 * max(harmonics) >= self.samples_per_period:
            raise ValueError("harmonics must lie between 1 and half of samples_per_period")
        return self

    @property
    def samples(self) -> int:
        """Number of samples of the realization, transient included."""
        return self.samples_per_period * (self.periods + self.transient_periods)

    @property
    def played_before(self) -> int:
        """How many realizations of the experiment are played before this one."""
        if self.order == "interleaved":
            return self.realization * self.levels + self.level
        return self.level * self.realizations + self.realization

    @property
    def elapsed_s(self) -> float:
        """Time at which the realization starts if all are played without a break (s)."""
        return self.played_before * self.samples / self.sample_rate_hz

    @property
    def base_frequency_hz(self) -> float:
        """f0 in Hz."""
        return self.sample_rate_hz / self.samples_per_period

    @property
    def amplitudes_rad(self) -> np.ndarray:
        """Amplitude of each excited line in rad, float64 of shape (excited lines,)."""
        return np.broadcast_to(
            np.asarray(self.amplitude_rad, float), (len(self.excited_harmonics),)
        ).copy()

    @property
    def stamps_ns(self) -> np.ndarray:
        """Stamps of all samples, int64 of shape (samples,)."""
        return stamps_ns(self.samples, self.sample_rate_hz)

    def to_json(self) -> str:
        """Return the JSON text, always the same for the same description."""
        return self.model_dump_json(by_alias=True)

    @classmethod
    def from_json(cls, text: str | bytes, source: str) -> Experiment:
        """Parse JSON; raise InputError that names `source`, the field and the mend."""
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            raise InputError(f"{source}: experiment description: {first_problem(error)}") from None


def controller_from_json(text: str) -> dict[str, Any]:
    """Parse what a controller says of itself; raise InputError if it is no JSON object."""
    try:
        return dict(json.loads(text))
    except (ValueError, TypeError):
        raise InputError(
            f"Topic {CONTROLLER_TOPIC}: {text[:60]!r} is no JSON description of a controller."
        ) from None


def first_problem(error: ValidationError) -> str:
    """Return the first problem of a failed validation as 'field: what is wrong'."""
    problem = error.errors(include_url=False)[0]
    where = ".".join(str(part) for part in problem["loc"])
    what = problem["msg"].removeprefix("Value error, ")
    return f"{where}: {what}." if where else f"{what}."
