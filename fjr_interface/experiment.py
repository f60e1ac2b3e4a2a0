"""The experiment description: JSON on the `experiment` topic and in a bag's `custom_data`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from fjr_kit.errors import InputError
from fjr_kit.result_types import first_problem

from .topics import CONTROLLER_TOPIC, stamps_ns

if TYPE_CHECKING:
    from typing_extensions import Self

SCHEMA: Final = "fjr_rig/experiment/1"
CUSTOM_DATA_KEY = "experiment"

Harmonics = list[int]


class _Description(BaseModel):
    """What every kind of experiment description says."""

    model_config = ConfigDict(
        frozen=True,
        extra="allow",
        populate_by_name=True,
        json_schema_serialization_defaults_required=True,
    )

    schema_name: Literal["fjr_rig/experiment/1"] = Field(SCHEMA, alias="schema")
    sample_rate_hz: float = Field(gt=0, le=1e6, allow_inf_nan=False)
    realization: int = Field(0, ge=0)
    realizations: int = Field(1, ge=1)
    level: int = Field(0, ge=0)
    levels: int = Field(1, ge=1)
    repeat_of: int | None = Field(None, ge=0)
    controller: dict[str, Any] | None = None

    @property
    def linear(self) -> bool:
        """Whether the axis is linear: m, N and kg stand where rad, N m and kg m2 are said."""
        return (self.model_extra or {}).get("axis") == "linear"

    @property
    def integrated(self) -> bool:
        """Whether the position is the integral of a recorded speed."""
        return (self.model_extra or {}).get("position_from") == "speed"

    def to_json(self) -> str:
        """Return the JSON text, always the same for the same description."""
        return self.model_dump_json(by_alias=True)

    @classmethod
    def of(cls, source: str, **fields: Any) -> Self:
        """Return the description; raise InputError that names `source` and the field."""
        try:
            return cls(**fields)
        except ValidationError as error:
            raise InputError(f"{source}: experiment: {first_problem(error)}") from None


class RecordDescription(_Description):
    """What is known of a run that is not periodic: a chirp, noise, moves, steps, a servo's log.

    Attributes:
        repeat_of: the realization of the same level that this one repeats; None if it is the first
            with its reference, or nobody compared them.
        samples: how many samples there are; None if that was not described.
        controller: its description, see `controller_node`; None if it is unknown.
    """

    kind: Literal["record"] = "record"
    samples: int | None = Field(None, ge=1, le=10**10)


class Experiment(_Description):
    """What was played in one realization of a multisine, as in the interface's description.

    Harmonics are multiples of the grid's base frequency f0 = sample_rate_hz / samples_per_period.
    The reference rises from zero over soft_start_s (raised cosine), within the discarded periods.
    Realizations are played level after level, or interleaved: one of each level in turn.
    `repeat_of` names the realization of the same level whose phases were played again.
    Further keys are kept and ignored.
    """

    kind: Literal["multisine"] = "multisine"
    samples_per_period: int = Field(ge=2, le=10**8)
    periods: int = Field(ge=1, le=10**6)
    transient_periods: int = Field(ge=0, le=10**6)
    order: Literal["levels", "interleaved"] = "levels"
    amplitude_rad: float | list[float]
    excited_harmonics: Harmonics = Field(min_length=1)
    detection_harmonics: Harmonics = []
    phase_seed: int | None = None
    soft_start_s: float = Field(0.0, ge=0, le=1e6, allow_inf_nan=False)

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

    @classmethod
    def from_json(cls, text: str | bytes, source: str) -> Experiment:
        """Parse JSON; raise InputError if it is not of a multisine, see `parse_experiment`."""
        return periodic(parse_experiment(text, source), source)


class _Kind(BaseModel):
    kind: Literal["multisine", "record"] = "multisine"


def parse_experiment(text: str | bytes, source: str) -> Experiment | RecordDescription:
    """Parse the JSON of an experiment of any kind; one without `kind` is a multisine.

    Raises:
        InputError: it is no such description; names `source`, the field and the mend.
    """
    try:
        kind = _Kind.model_validate_json(text).kind
        chosen = RecordDescription if kind == "record" else Experiment
        return chosen.model_validate_json(text)
    except ValidationError as error:
        raise InputError(f"{source}: experiment description: {first_problem(error)}") from None


def periodic(experiment: Experiment | RecordDescription, source: str) -> Experiment:
    """Return the description of a multisine; raise InputError if the run is not periodic."""
    if isinstance(experiment, Experiment):
        return experiment
    raise InputError(
        f"{source}: is a record that is not periodic (kind record), but a multisine is "
        "needed here; give an experiment with a periodic reference."
    )


def controller_from_json(text: str) -> dict[str, Any]:
    """Parse what a controller says of itself; raise InputError if it is no JSON object."""
    try:
        return dict(json.loads(text))
    except (ValueError, TypeError):
        raise InputError(
            f"Topic {CONTROLLER_TOPIC}: {text[:60]!r} is no JSON description of a controller."
        ) from None
