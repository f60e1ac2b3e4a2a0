"""Whether an imported run repeats: its period, its excited lines, and what speaks against it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fjr_kit.errors import InputError

from ..discover import find_lines, find_period
from ..realization import REFERENCE_REPEATS
from ..spectra import line_spectrum

SILENT = 1e-7
"""Amplitude relative to the strongest line below which a line is not excited."""
STRAY = 0.1
"""A line that is excited by less than this part of the median one, and stands alone with that, was
not played: mains hum, a limit cycle, rounding."""
MOST_STRAY = 0.02
"""Greatest part of the lines that can be such strays; one line always can."""
WANDERS = 0.1
"""Greatest difference of a line between one period and their mean, relative to it, of one that was
played: mains hum is no whole number of cycles in a period."""
ABOVE_NOISE = 4.0
"""Least ratio of what repeats in torque and position to what does not, at the excited lines, in
power, where noise alone gives 1."""
_HUM_LINES, _HUM_SIDE = 3, 2


class Asked(Protocol):
    """What the user said of the period; None is found."""

    @property
    def samples_per_period(self) -> int | None:
        """N."""

    @property
    def transient_periods(self) -> int:
        """Leading periods to discard."""

    @property
    def periods(self) -> int | None:
        """Periods to keep after those."""

    @property
    def excited_harmonics(self) -> tuple[int, ...] | None:
        """Excited lines."""


@dataclass(frozen=True)
class Repetition:
    """A periodic run.

    Attributes:
        samples_per_period: N.
        transient_periods: leading periods to discard.
        periods: P after those.
        excited: (F,), excited harmonics.
        amplitudes: (F,), amplitude of the reference there.
        notes: what differs from an ideal multisine.
    """

    samples_per_period: int
    transient_periods: int
    periods: int
    excited: np.ndarray
    amplitudes: np.ndarray
    notes: tuple[str, ...]

    @property
    def samples(self) -> int:
        """Number of samples, transient included."""
        return self.samples_per_period * (self.transient_periods + self.periods)


def insists(asked: Asked) -> bool:
    """Tell whether the user said that the run repeats."""
    return (
        asked.samples_per_period is not None
        or asked.excited_harmonics is not None
        or asked.periods is not None
        or asked.transient_periods > 1
    )


def find_repetition(
    name: str, signals: Mapping[str, np.ndarray], rate_hz: float, asked: Asked
) -> Repetition | str:
    """Find the period of a run, or why it has none.

    Args:
        name: of the file, for messages.
        signals: {symbol: float64 (samples,)}; without r the run is not taken as periodic.
        rate_hz: of the samples.
        asked: what is known.

    Returns:
        The repetition, or a clause that says why there is none.

    Raises:
        InputError: period or lines were given, but the run is not like that.
    """
    if "r" not in signals:
        return "no reference was recorded"
    try:
        found = _find(name, signals["r"], rate_hz, asked)
        why = _unrepeated(found, signals)
        if why is not None:
            raise InputError(f"{name}: {why}")
    except InputError as error:
        if insists(asked):
            raise
        return str(error).removeprefix(f"{name}: ").partition("; ")[0].rstrip(".")
    return found


def _find(name: str, reference: np.ndarray, rate_hz: float, asked: Asked) -> Repetition:
    samples = asked.samples_per_period or find_period(name, reference)
    transient, notes = asked.transient_periods, []
    total, rest = divmod(reference.size, samples)
    periods = total - transient if asked.periods is None else asked.periods
    if periods < 1 or periods + transient > total:
        raise InputError(
            f"{name}: {reference.size} samples are {reference.size / samples:.6g} periods of "
            f"{samples}, too few for {transient} transient periods and {max(periods, 1)} to keep."
        )
    if rest and asked.periods is None:
        notes.append(f"the last {rest} samples are no whole period and are left out")
    kept = _kept(reference, samples, transient, periods)
    notes += _differences(name, kept, rate_hz)
    mean = kept.mean(axis=0)
    if asked.excited_harmonics is not None:
        excited, amplitudes = _given_lines(name, mean, asked.excited_harmonics)
    else:
        excited, amplitudes, wandering = _steady(kept, *find_lines(name, mean))
        excited, amplitudes, strays = _played(excited, amplitudes)
        base_hz = rate_hz / samples
        notes += [_note(*each, base_hz, "differs from period to period") for each in wandering]
        notes += [_note(*each, base_hz, "is too weak to have been played") for each in strays]
    return Repetition(samples, transient, periods, excited, amplitudes, tuple(notes))


def _kept(signal: np.ndarray, samples: int, transient: int, periods: int) -> np.ndarray:
    return signal[transient * samples : (transient + periods) * samples].reshape(periods, samples)


def _differences(name: str, kept: np.ndarray, rate_hz: float) -> list[str]:
    """Name the lines on which the reference differs from period to period; refuse other kinds."""
    scale = float(np.std(kept[0]))
    if not scale > 0:
        raise InputError(f"{name}: the reference is constant; map the column that carries it.")
    difference = kept - kept[0]
    worst = difference[np.std(difference, axis=1).argmax()]
    notes: list[str] = []
    spectrum = line_spectrum(worst)
    for _ in range(_HUM_LINES):
        rest = float(np.sqrt(np.sum(np.abs(spectrum[1:]) ** 2) / 2.0))
        if rest <= REFERENCE_REPEATS * scale:
            return notes
        line = 1 + int(np.abs(spectrum[1:]).argmax())
        hertz = line * rate_hz / kept.shape[1]
        notes.append(
            f"the reference differs between periods by {np.abs(spectrum[line]):.3g} rad near "
            f"{hertz:.4g} Hz (line {line}), {np.abs(spectrum[line]) / scale:.1%} of its rms"
        )
        spectrum[max(line - _HUM_SIDE, 1) : line + _HUM_SIDE + 1] = 0.0
    whole = float(np.std(worst))
    raise InputError(
        f"{name}: the reference does not repeat after {kept.shape[1]} samples (rms difference "
        f"{whole / scale:.1%}); correct the period or the transient periods."
    )


def _given_lines(
    name: str, mean: np.ndarray, harmonics: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    excited = np.asarray(harmonics)
    if 2 * excited[-1] >= mean.size:
        raise InputError(
            f"{name}: harmonic {excited[-1]} is not below half of {mean.size} samples; correct the "
            "excited harmonics."
        )
    level = np.abs(line_spectrum(mean))
    silent = excited[level[excited] <= SILENT * level[1:].max()]
    if silent.size:
        raise InputError(
            f"{name}: the reference is zero on harmonic {silent[0]}; correct the excited harmonics."
        )
    return excited, level[excited]


Strays = list[tuple[int, float]]


def _played(excited: np.ndarray, amplitudes: np.ndarray) -> tuple[np.ndarray, np.ndarray, Strays]:
    """Part the lines that were played from a few weak ones that were not."""
    weak = amplitudes < STRAY * np.median(amplitudes)
    if not weak.any() or weak.sum() > max(1, MOST_STRAY * excited.size) or excited.size < 4:
        return excited, amplitudes, []
    strays = list(zip(excited[weak].tolist(), amplitudes[weak].tolist(), strict=True))
    return excited[~weak], amplitudes[~weak], strays


def _steady(
    kept: np.ndarray, excited: np.ndarray, amplitudes: np.ndarray
) -> tuple[np.ndarray, np.ndarray, Strays]:
    """Part the lines that every period has from those that come and go."""
    lines = line_spectrum(kept)[:, excited]
    apart = np.abs(lines - lines.mean(axis=0)).max(axis=0) > WANDERS * amplitudes
    if not apart.any() or apart.sum() > max(1, MOST_STRAY * excited.size):
        return excited, amplitudes, []
    strays = list(zip(excited[apart].tolist(), amplitudes[apart].tolist(), strict=True))
    return excited[~apart], amplitudes[~apart], strays


def _note(line: int, amplitude: float, base_hz: float, why: str) -> str:
    return (
        f"the reference has {amplitude:.3g} rad on line {line} ({line * base_hz:.4g} Hz), which "
        f"{why} and is not counted as excited"
    )


def _unrepeated(found: Repetition, signals: Mapping[str, np.ndarray]) -> str | None:
    """Return why torque and position do not repeat with the reference, or None."""
    n, transient, periods = found.samples_per_period, found.transient_periods, found.periods
    if periods == 1 and transient:
        transient, periods = transient - 1, 2
    for symbol, called in (("y", "the position"), ("u", "the torque")) if periods > 1 else ():
        lines = line_spectrum(_kept(signals[symbol], n, transient, periods))[:, found.excited]
        mean = lines.mean(axis=0)
        scatter = float(np.sum(np.abs(lines - mean) ** 2)) / (periods - 1)
        repeated = periods * float(np.sum(np.abs(mean) ** 2))
        if repeated < ABOVE_NOISE * scatter:
            return (
                f"the reference repeats after {n} samples, but {called} does not; the reference "
                "belongs to another run or drives nothing, so leave it out or map the right one."
            )
    return None
