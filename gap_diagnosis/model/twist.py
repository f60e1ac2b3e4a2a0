"""The twist of a transmission behind which the link has an encoder of its own.

Friction moves motor and link alike, what the transmission does stands between them: how soft it is,
its play, its errors. So q - y is compared beside the motion y. Two encoders also differ in their
zero, in their scale (a gear ratio that was rounded) and by the time between their samples: in 1, q
and dq/dt. These are taken out of the recorded and of the simulated twist, by the recorded motion of
the link and least squares; a twist that goes with them is not seen. The motor's would not do: near
resonance the twist itself comes late, which looks like damping.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fjr_records.encoder_step import position_step
from fjr_records.record_noise import RecordNoise, record_noise
from fjr_records.records import Record, RecordSet

from .lapped import lapped

_STIFFLY = 0.5
"""Of the frequency at which the link swings on its spring before a held motor: up to there it goes
with the motor, 1 to 4/3 times as far."""
_GOES_WITH = (
    0.7,
    1.6,
)  # times the motor: a link that moves otherwise there is of another sign or unit


@dataclass(frozen=True)
class Twist:
    """The twists of all runs, and what is taken out of them.

    Attributes:
        hop: half the length of a window, samples.
        run_in: samples at the start of each run that are not compared.
        bases: what is taken out of each run, orthonormal columns, (samples - run_in, columns).
        measured: lines of the recorded twist of each run, (windows, hop), rad.
        noise: of the twist.
    """

    hop: int
    run_in: int
    bases: tuple[np.ndarray, ...]
    measured: tuple[np.ndarray, ...]
    noise: RecordNoise

    def lines_of(self, run: np.ndarray, index: int) -> np.ndarray:
        """Return the lines of the twist of a simulated run, (windows, hop), rad.

        Args:
            run: y, u and q, (3, samples).
            index: of the run.
        """
        return _lines(run[2] - run[0], self.bases[index], self.run_in, self.hop)


def twist_of(
    records: RecordSet,
    nominal: Mapping[str, float],
    hop: int,
    run_in: int = 0,
    noise: RecordNoise | None = None,
) -> Twist | None:
    """Return the twist of records; None where a link has no encoder, or the datasheet no spring.

    Args:
        records: the runs.
        nominal: datasheet values by the names of PLANT.
        hop: half the length of a window, samples.
        run_in: samples at the start of each run that are not compared.
        noise: of the twist; None to find it in the records.
    """
    ratio = goes_along(records, nominal, hop)
    if ratio is None or doubt_of(ratio):
        return None
    rate = records.sample_rate_hz
    bases = tuple(_taken_out(np.asarray(r.link)[run_in:], rate) for r in records.records)
    twists = [_twist(r) for r in records.records]
    lines = [_lines(t, basis, run_in, hop) for t, basis in zip(twists, bases, strict=True)]
    return Twist(hop, run_in, bases, tuple(lines), noise or twist_noise(records))


def doubt_of(ratio: float) -> str:
    """Return what is wrong with links that go so far with the motor, a sentence; empty if nothing.

    Args:
        ratio: from `goes_along`.
    """
    if _GOES_WITH[0] < ratio < _GOES_WITH[1]:
        return ""
    return (
        f"The link goes {ratio:.2g} times as far as the motor where both must go together, so its "
        "encoder is not used; check its sign and its unit."
    )


def goes_along(records: RecordSet, nominal: Mapping[str, float], hop: int) -> float | None:
    """Return how far links go for each radian of the motor, where they must go with it.

    None where a link has no encoder, the datasheet no spring, or the motion nothing so slow.

    Args:
        records: the runs.
        nominal: datasheet values by the names of PLANT.
        hop: half the length of a window, samples.
    """
    if any(r.link is None for r in records.records) or not math.isfinite(nominal["k0"]):
        return None
    swings_hz = math.sqrt(nominal["k0"] / nominal["j"]) / (2.0 * np.pi)
    line_hz = 0.5 * records.sample_rate_hz / hop
    slow = slice(1, int(_STIFFLY * swings_hz / line_hz) + 1)
    y, q = (
        np.concatenate([lapped(np.asarray(signal), hop)[:, slow].ravel() for signal in signals])
        for signals in zip(*((r.position, r.link) for r in records.records), strict=True)
    )
    moved = float(y @ y)
    return float(q @ y) / moved if moved > 0.0 else None


def twist_noise(records: RecordSet) -> RecordNoise:
    """Return the noise of the twist, at least what both encoders round away."""
    twisted = tuple(replace(r, position=_twist(r)) for r in records.records)
    seen = record_noise(replace(records, records=twisted))
    steps = [
        position_step([np.asarray(signal) for signal in signals]) or 0.0
        for signals in zip(*((r.position, r.link) for r in records.records), strict=True)
    ]
    rounding = math.hypot(*steps) / math.sqrt(12.0)
    if not rounding:
        return seen
    source = seen.source if seen.known else "residual"
    return replace(seen, source=source, std_rad=float(np.fmax(seen.std_rad, rounding)))


def _twist(record: Record) -> np.ndarray:
    assert record.link is not None
    return record.link - record.position


def _taken_out(link: np.ndarray, sample_rate_hz: float) -> np.ndarray:
    moved = np.column_stack([link, np.gradient(link) * sample_rate_hz])
    return np.linalg.qr(np.column_stack([np.ones(link.size), moved]))[0]


def _lines(twist: np.ndarray, basis: np.ndarray, run_in: int, hop: int) -> np.ndarray:
    seen = twist[run_in:]
    left = np.concatenate([np.zeros(run_in), seen - basis @ (basis.T @ seen)])
    return lapped(left, hop)
