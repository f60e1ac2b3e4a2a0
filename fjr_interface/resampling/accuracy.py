"""Survey of a signal before resampling, the error that resampling makes, and its limits."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np

from fjr_kit.errors import InputError

from ..bags.audit import LARGEST
from .band_limited import WINDOW, Spectrum, between_rms, choose_spectrum, lost_rms
from .hold_equivalent import REACH, hold_equivalent
from .stamp_line import StampError, StampLine

GREATEST_ERROR = 0.05
"""Greatest stated error of a signal, relative to its rms."""
GREATEST_GAP = 8
"""Most samples lost in a row."""
GREATEST_LOSS = 0.01
"""Greatest part of the samples that may be lost."""
GREATEST_JITTER = 0.15
"""Greatest rms jitter of the stamps, as a part of the sample period."""
LEAST_SAMPLES = 4 * WINDOW
BAND = 0.8
"""Part of the lowest Nyquist frequency, topics' or grid's, up to which lines may be analyzed."""

_WINDOWS_EACH = 4
_WINDOWS = 256
_NUMERICAL = 1e-5
_SHARPNESS = 1.5  # by how much a moved step of a held command can exceed its smooth likeness
UNITS = {"torque": "N m"}


@dataclass(frozen=True)
class Resampling:
    """How to resample.

    Attributes:
        rate_hz: rate of the grid; None takes the mean rate of the reference, or of the position
            where no reference is read.
    """

    rate_hz: float | None = None

    @classmethod
    def parse(cls, text: str) -> Resampling:
        """Parse `auto` or a rate in Hz; raise InputError on anything else."""
        try:
            rate = None if text == "auto" else float(text)
        except ValueError:
            rate = math.nan
        if rate is not None and not 0.0 < rate <= 1e6:
            raise InputError(f"resample {text!r} is not understood; give a rate in Hz, or auto.")
        return cls(rate)


@dataclass(frozen=True)
class Surveyed:
    """A signal of a bag, surveyed from end to end.

    Attributes:
        name: its name in `Record`.
        topic: where it stands.
        rate_hz: mean rate of its samples.
        period_ns: mean period, unrounded.
        first_ns: first stamp.
        last_ns: last stamp.
        samples: how many there are.
        lost: how many are missing between them.
        longest_gap: most that are missing in a row.
        jitter: rms, as a part of the period.
        spectrum: what its values are interpolated by.
        rms: of its values about their mean, in its unit.
        error: rms error after resampling, at most, in its unit.
    """

    name: str
    topic: str
    rate_hz: float
    period_ns: float
    first_ns: int
    last_ns: int
    samples: int
    lost: int
    longest_gap: int
    jitter: float
    spectrum: Spectrum
    rms: float
    error: float

    @property
    def relative_error(self) -> float:
        """The error as a part of the rms."""
        return self.error / self.rms if self.rms else 0.0

    @property
    def sentence(self) -> str:
        """What a reader must know."""
        unit = UNITS.get(self.name, "rad")
        return (
            f"{self.name} was resampled from {self.topic} ({_clock(self)}): its error is at most "
            f"{self.error:.2g} {unit} rms, {100.0 * self.relative_error:.2g} % of its own rms."
        )


def _clock(found: Surveyed) -> str:
    return (
        f"{found.rate_hz:.6g} samples/s, jitter {found.jitter:.1%} of a period, {found.lost} of "
        f"{found.samples + found.lost} samples lost, at most {found.longest_gap} in a row"
    )


class Survey:
    """Follows one signal through the bag, in pieces of some thousand samples."""

    def __init__(self, bag: str, name: str, topic: str) -> None:
        """Start with no samples."""
        self._where, self._name, self._topic = f"{bag}: {topic}", name, topic
        self.line = StampLine()
        self._windows: list[tuple[np.ndarray, np.ndarray]] = []
        self._sum = self._squares = 0.0
        self._shifted: list[float] = []  # mean square of what regular stamps would change

    def add(self, stamps: np.ndarray, values: np.ndarray) -> None:
        """Survey the next samples, int64 ns and float64 of one shape; raise InputError."""
        bad = np.flatnonzero(~(np.abs(values) <= LARGEST))
        if bad.size:
            at = stamps[bad[0]] * 1e-9
            raise InputError(f"{self._where}: {values[bad[0]]} at {at:.6f} s; record it again.")
        try:
            _, line = self.line.add(stamps)
        except StampError as error:
            raise InputError(
                f"{self._where}: the stamp {error.stamp_ns * 1e-9:.6f} s {error.what}, so the "
                "samples cannot be told apart; stamp each sample when it is taken, in one clock."
            ) from None
        self._sum += float(values.sum())
        self._squares += float(values @ values)
        if len(stamps) >= LEAST_SAMPLES and len(self._windows) < _WINDOWS:
            self._keep_windows(stamps, values)
            if self._name == "torque":
                self._compare_with_regular(stamps, line, values)

    def _keep_windows(self, stamps: np.ndarray, values: np.ndarray) -> None:
        for start in np.linspace(0, len(stamps) - WINDOW, _WINDOWS_EACH).astype(int):
            part = slice(start, start + WINDOW)
            times = (stamps[part] - stamps[start]) / self.line.period_ns
            self._windows.append((times, values[part]))

    def _compare_with_regular(
        self, stamps: np.ndarray, line: np.ndarray, values: np.ndarray
    ) -> None:
        """Find what a held command would be if all unevenness were noise of its stamps.

        That noise shows twice: as unevenness, and as what cannot be predicted; the smaller one
        bounds the error.
        """
        period = self.line.period_ns
        times = (stamps - self.line.first_ns) / period
        points = np.arange(math.ceil(times[0]) + REACH, times[-1] - REACH)
        difference = hold_equivalent(times, values, points) - hold_equivalent(
            line / period, values, points
        )
        self._shifted.append(float(np.mean(difference**2)))

    def finish(self) -> Surveyed:
        """Return what was found; raise InputError beyond the limits."""
        line = self.line
        if not self._windows:
            raise InputError(
                f"{self._where}: holds {line.samples} samples, too few to resample; record "
                f"{LEAST_SAMPLES} or more."
            )
        mean = self._sum / line.samples
        times, values = (np.array(part) for part in zip(*self._windows, strict=True))
        spectrum = choose_spectrum(times[::2], values[::2] - mean)
        found = Surveyed(
            self._name,
            self._topic,
            line.rate_hz,
            line.period_ns,
            line.first_ns,
            line.last_ns,
            line.samples,
            line.lost,
            max(line.gaps, default=0),
            line.jitter,
            spectrum,
            math.sqrt(max(self._squares / line.samples - mean**2, 0.0)),
            0.0,
        )
        self._refuse_clock(found)
        whole = line.samples + line.lost
        error = between_rms(times, values - mean, spectrum)
        if self._name == "torque":
            error = _SHARPNESS * min(error, math.sqrt(np.mean(self._shifted)))
        lost = lost_rms(times, values - mean, spectrum, whole, line.gaps)
        if self._name == "torque":  # nor is it known from when on a lost command was held
            change = line.jitter * float(np.sqrt(np.mean(np.diff(values) ** 2)))
            lost = math.hypot(lost, change * math.sqrt(2.0 * line.lost / whole))
        found = replace(found, error=max(math.hypot(error, lost), _NUMERICAL * found.rms))
        if found.relative_error > GREATEST_ERROR:
            self._refuse(
                found,
                f"the error after resampling would be {found.relative_error:.2g} of the signal's "
                f"rms, where {GREATEST_ERROR:g} is the limit",
                "record with a higher rate, less noise, or stamps of the instants of measurement",
            )
        return found

    def _refuse_clock(self, found: Surveyed) -> None:
        mend = "record it again on a less busy machine, or with a recorder that loses nothing"
        if found.longest_gap > GREATEST_GAP:
            after = self.line.longest_ns * 1e-9
            what = f"{found.longest_gap} samples in a row are missing after {after:.6f} s"
            self._refuse(found, f"{what}, where {GREATEST_GAP} is the limit", mend)
        if found.lost > GREATEST_LOSS * found.samples:
            what = f"{found.lost / (found.samples + found.lost):.1%} of the samples are missing"
            self._refuse(found, f"{what}, where {GREATEST_LOSS:.0%} is the limit", mend)
        if found.jitter > GREATEST_JITTER:
            what = f"the jitter is above the limit of {GREATEST_JITTER:.0%} of a period"
            self._refuse(found, what, "stamp each sample when it is taken")

    def _refuse(self, found: Surveyed, why: str, mend: str) -> NoReturn:
        raise InputError(f"{self._where} ({_clock(found)}): {why}; {mend}.")
