"""What one time column says: even, coarse, jittered or wild stamps."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fjr_kit.errors import InputError

from .rounded_stamps import Rounded, rounded

FASTEST_HZ = 1e6
"""Greatest sample rate of an experiment description."""
SLOWEST_HZ = 2.0
"""Least rate of a rig whose time column is in s: a slower one is in ms or us and taken for s."""
LONGEST_S = 1e8
"""Longest record, three years; more is no time in s."""
LONG_GAP = 10.0
"""A step of so many usual ones, in which more is lost than can be resampled, ends a stretch..."""
FEW = 0.01
"""... if such steps are at most this part of all: else they are how the logger works."""
UNEVEN = 0.01
"""Greatest deviation of one time step from the mean one, relative to it, of even stamps."""
_GAP = 1.5
_KNOWN = 0.05
"""Greatest range of the sample rates that rounded stamps allow, relative to the rate."""
GIVE_RATE = "where samples were taken evenly, leave time=COLUMN out and give --sample-rate-hz"
"""What helps where stamps are coarser than the samples."""


@dataclass(frozen=True)
class Clock:
    """What a time column says.

    Attributes:
        stamps_s: the stamps, strictly rising, float64 (samples,); None where they are even.
        rate_hz: mean sample rate.
        gaps: steps longer than 1.5 usual ones.
        longest_gap_s: the longest of them, 0 without any.
        notes: what was taken how, sentences without the file's name.
        kept: indices of the samples to use; None for all.
    """

    stamps_s: np.ndarray | None
    rate_hz: float
    gaps: int = 0
    longest_gap_s: float = 0.0
    notes: tuple[str, ...] = ()
    kept: np.ndarray | None = None


def read_clock(
    source: str,
    time: np.ndarray | None,
    given_hz: float | None,
    *,
    slow: bool = False,
    copies: bool = False,
) -> Clock:
    """Understand a time column of a file.

    Args:
        source: the file, and the time column if there are several, for sentences.
        time: the time column in s, (samples,); None without one.
        given_hz: sample rate that the user gave.
        slow: whether it may be slower than SLOWEST_HZ.
        copies: whether samples that repeat a stamp are copies of the sample before.

    Raises:
        InputError: it is no time, or not in s, or too coarse to tell the rate.
    """
    if time is None:
        if given_hz is None:
            raise InputError(
                f"{source}: give a sample rate of up to {FASTEST_HZ:g} Hz, or map a time column."
            )
        return Clock(None, given_hz)
    if time.size < 2 or not time[-1] > time[0]:
        raise InputError(f"{source}: the time column does not increase; map another column.")
    step, steps = (time[-1] - time[0]) / (time.size - 1), np.diff(time)
    falling = np.flatnonzero(steps < 0)
    if falling.size:
        at = int(falling[0])
        raise InputError(
            f"{source}: the time column goes back from {time[at]:g} to {time[at + 1]:g} s after "
            f"sample {at}; map another column, or cut the record there."
        )
    if step * FASTEST_HZ < 1.0:
        raise InputError(
            f"{source}: the time column goes on by {step:g} s, more than {FASTEST_HZ:g} samples in "
            "a second; correct its unit."
        )
    _refuse_slow(source, time, slow)
    stretch = _longest_stretch(steps)
    if stretch is not None:
        return _of_stretch(source, time, given_hz, stretch, slow, copies)
    if (np.abs(steps - step) <= UNEVEN * step).all():
        return Clock(None, _same(source, _whole(1.0 / step, 1e-6), given_hz))
    behind = rounded(time, copies=copies)
    return _uneven(source, time, given_hz) if behind is None else _even(source, behind, given_hz)


def _even(source: str, behind: Rounded, given_hz: float | None) -> Clock:
    """Return the timing of even samples with rounded stamps; raise InputError if it is not told."""
    least, most = behind.least_hz, behind.most_hz
    if given_hz is None and most - least > _KNOWN * behind.rate_hz:
        raise InputError(
            f"{source}: the time column is rounded to {behind.tick_s:.6g} s and allows any rate "
            f"from {least:.3g} to {most:.3g} Hz; {GIVE_RATE}."
        )
    fits = given_hz is not None and least <= given_hz <= most
    rate = given_hz if given_hz and fits else _same(source, behind.rate_hz, given_hz)
    allowed = f" (they allow {least:.6g} to {most:.6g})" if most - least > 1e-6 * rate else ""
    note = (
        f"its stamps are rounded to {behind.tick_s:.6g} s and taken as even, {rate:.6g} samples/s"
    )
    return Clock(None, rate, notes=(note + allowed,))


def _refuse_slow(source: str, time: np.ndarray, slow: bool) -> None:
    """Raise InputError if the time column is evidently not in s."""
    span, steps = time[-1] - time[0], np.diff(time)
    usual = float(np.median(steps))
    if span > LONGEST_S or (usual > 1.0 / SLOWEST_HZ and not slow):
        raise InputError(
            f"{source}: the time column goes on by {usual:g} s from sample to sample, as if it "
            "were in ms, us or ns and taken for s; give its unit, as in time=COLUMN:ms, or a "
            "factor."
        )


def _longest_stretch(steps: np.ndarray) -> slice | None:
    """Return the samples of the longest stretch between long gaps; None without such gaps."""
    rising = steps[steps > 0]
    gaps = np.flatnonzero(steps > LONG_GAP * np.median(rising)) if rising.size else rising
    if not gaps.size or gaps.size > max(1.0, FEW * steps.size):
        return None
    ends = np.concatenate([[0], gaps + 1, [steps.size + 1]])
    at = int(np.diff(ends).argmax())
    return slice(int(ends[at]), int(ends[at + 1]))


def _of_stretch(
    source: str,
    time: np.ndarray,
    given_hz: float | None,
    stretch: slice,
    slow: bool,
    copies: bool,
) -> Clock:
    """Return the timing of one stretch of a file, which is kept alone."""
    of_stretch = read_clock(source, time[stretch], given_hz, slow=slow, copies=copies)
    steps = np.diff(time)
    gaps = steps[steps > LONG_GAP * np.median(steps[steps > 0])]
    kept = np.arange(time.size)[stretch]
    if of_stretch.kept is not None:
        kept = kept[of_stretch.kept]
    times = f"{gaps.size} time{'s' * (gaps.size != 1)}"
    note = (
        f"its time column jumps {times}, by up to {gaps.max():.4g} s; only the longest stretch "
        f"without a jump is kept, samples {stretch.start} to {stretch.stop - 1} of {time.size}"
    )
    return replace(
        of_stretch,
        gaps=of_stretch.gaps + gaps.size,
        longest_gap_s=float(gaps.max()),
        notes=(note, *of_stretch.notes),
        kept=kept,
    )


def _uneven(source: str, time: np.ndarray, given_hz: float | None) -> Clock:
    kept = np.concatenate([[True], np.diff(time) > 0])
    notes: tuple[str, ...] = ()
    if not kept.all():
        most = f"; {GIVE_RATE}" if 2 * kept.sum() < kept.size else ""
        notes = (f"{np.sum(~kept)} samples repeat the stamp before them and are left out{most}",)
    stamps = time[kept]
    if stamps.size < 3:
        raise InputError(
            f"{source}: the time column has {stamps.size} different stamps; too few to tell a "
            f"rate; {GIVE_RATE}."
        )
    steps = np.diff(stamps)
    usual = float(np.median(steps))
    gaps = steps[steps > _GAP * usual]
    rate = given_hz or _three_digits((stamps.size - 1) / (stamps[-1] - stamps[0]))
    return Clock(stamps, rate, gaps.size, float(gaps.max(initial=0.0)), notes, np.flatnonzero(kept))


def _three_digits(rate: float) -> float:
    return float(f"{rate:.3g}")


def _same(source: str, rate: float, given: float | None) -> float:
    if given is not None and abs(rate - given) > 1e-4 * given:
        raise InputError(
            f"{source}: the time column says {rate:g} Hz, not {given:g} Hz; leave one of them out."
        )
    return float(given or rate)


def _whole(rate: float, tolerance: float) -> float:
    return float(round(rate)) if abs(rate - round(rate)) < tolerance * rate else rate
