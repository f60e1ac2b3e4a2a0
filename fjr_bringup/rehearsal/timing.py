"""Timing of a real-time loop, passively observed: rate, jitter, latency, lost samples.

Every message has three times: its stamp (the sample instant), when it was sent and when it was
received, both by the machine's clock. The delay of the loop has two parts: lateness, from the
sample instant to sending y_k, and latency, from there to receiving the u_k that answers it. Stamps
count from an instant that the observer doesn't know, so lateness is measured against the most
punctual message of the last seconds; a delay that was there all the time is not seen.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, computed_field
from scipy.ndimage import minimum_filter1d

from fjr_kit.result_types import Array, Number, ResultModel, Unit

Seconds = Annotated[Number, Unit("s")]

EDGES_S = np.geomspace(1e-6, 1.0, 121)
"""Edges of all histograms: 20 bins a decade. What lies outside counts in the outermost bins."""

CLOCK_JUMP_S = 0.05
"""Stamps that run ahead of the sender's clock, or go back, by more than this are a clock jump."""

_JUMP_NS = round(CLOCK_JUMP_S * 1e9)
_ANSWER_NS = 100_000_000
_PUNCTUAL_S = 10.0  # the drift of two clocks stays small in this time

RECORD = np.dtype([("stamp", "<i8"), ("sent", "<i8"), ("received", "<i8"), ("value", "<f8")])
"""What is kept of a message: three times in ns, and its value."""


class Distribution(ResultModel):
    """Distribution of a time in seconds; all NaN if there are no values.

    Attributes:
        count: number of values.
        p50: median.
        p99: 99 % lie below.
        p999: 99.9 % lie below.
        worst: greatest.
        histogram: int (120,), counts between EDGES_S.
    """

    count: int
    p50: Seconds
    p99: Seconds
    p999: Seconds
    worst: Seconds
    histogram: Annotated[np.ndarray, Array("1", int)]

    @classmethod
    def of(cls, seconds: np.ndarray) -> Distribution:
        """Return the distribution of values of shape (count,)."""
        if not seconds.size:
            p50 = p99 = p999 = worst = float("nan")
        else:
            p50, p99, p999 = np.quantile(seconds, [0.5, 0.99, 0.999], method="higher").tolist()
            worst = seconds.max()
        counts, _ = np.histogram(np.clip(seconds, EDGES_S[0], EDGES_S[-1]), EDGES_S)
        return cls(count=seconds.size, p50=p50, p99=p99, p999=p999, worst=worst, histogram=counts)


class TopicTiming(ResultModel):
    """What an observer saw of one signal.

    Attributes:
        messages: number of messages.
        rate_hz: sample instants per second of the machine's clock, lost ones included.
        jitter: how far the time between two messages is from that between their stamps.
        lost: samples that the stamps leave out.
        repeated: messages whose stamp had come before.
        unordered: messages older than the one before.
        clock_jumps: see CLOCK_JUMP_S.
        not_finite: values that are NaN or infinite.
        lost_at_s: sample instant of the first lost one, NaN if none is lost.
        greatest: greatest magnitude of the finite values, in the signal's unit.
    """

    messages: int
    rate_hz: Annotated[Number, Unit("Hz")]
    jitter: Distribution
    lost: int
    repeated: int
    unordered: int
    clock_jumps: int
    not_finite: int
    lost_at_s: Seconds
    greatest: Number


class LoopTiming(ResultModel):
    """What an observer saw of the loop.

    Attributes:
        sample_rate_hz: the rate that it should have.
        duration_s: from the first position to the last, by the sender's clock.
        reference: timing of r.
        position: timing of y.
        torque: timing of u.
        lateness: from the sample instant to sending y_k.
        latency: from sending y_k to receiving u_k.
        delay: their sum, of each answered sample.
        delay_s: the same, float64 (answered samples,); not written.
        late: answers that came later than one sample period.
        unanswered: positions without torque; those of the last 0.1 s are left out.
        late_references: positions sent before their reference was.
        clocks_differ: a message was received before it was sent.
    """

    sample_rate_hz: Annotated[Number, Unit("Hz")]
    duration_s: Seconds
    reference: TopicTiming
    position: TopicTiming
    torque: TopicTiming
    lateness: Distribution
    latency: Distribution
    delay: Distribution
    delay_s: Annotated[np.ndarray, Array("s")] = Field(exclude=True)
    late: int
    unanswered: int
    late_references: int
    clocks_differ: bool

    @computed_field  # type: ignore[prop-decorator]
    @property
    def histogram_edges_s(self) -> Annotated[np.ndarray, Array("s")]:
        """Edges of all histograms."""
        return EDGES_S


def loop_timing(
    reference: np.ndarray, position: np.ndarray, torque: np.ndarray, sample_rate_hz: float
) -> LoopTiming:
    """Return the timing of a loop.

    Args:
        reference: messages of r in the order of their arrival, RECORD of shape (messages,).
        position: the same of y.
        torque: the same of u.
        sample_rate_hz: the rate that the loop should have.
    """
    first_r, first_y, first_u = map(_first_of_each, (reference, position, torque))
    answered, of_y, of_u = np.intersect1d(first_y["stamp"], first_u["stamp"], return_indices=True)
    latency_s = (first_u["received"][of_u] - first_y["sent"][of_y]) * 1e-9
    lateness_s = _lateness_s(first_y, sample_rate_hz)
    delay_s = lateness_s[of_y] + latency_s
    asked = first_y["sent"] <= first_y["sent"].max(initial=0) - _ANSWER_NS
    _, of_r, by_r = np.intersect1d(first_r["stamp"], first_y["stamp"], return_indices=True)
    sent = position["sent"]
    return LoopTiming(
        sample_rate_hz=sample_rate_hz,
        duration_s=float(sent.max() - sent.min()) * 1e-9 if sent.size else 0.0,
        reference=topic_timing(reference, sample_rate_hz),
        position=topic_timing(position, sample_rate_hz),
        torque=topic_timing(torque, sample_rate_hz),
        lateness=Distribution.of(lateness_s),
        latency=Distribution.of(latency_s),
        delay=Distribution.of(delay_s),
        delay_s=delay_s,
        late=int((latency_s > 1.0 / sample_rate_hz).sum()),
        unanswered=int((asked & ~np.isin(first_y["stamp"], answered)).sum()),
        late_references=int((first_r["sent"][of_r] > first_y["sent"][by_r]).sum()),
        clocks_differ=bool(
            any((each["received"] < each["sent"]).any() for each in (reference, position, torque))
        ),
    )


def topic_timing(messages: np.ndarray, sample_rate_hz: float) -> TopicTiming:
    """Return the timing of one signal; see `loop_timing`."""
    stamp, sent = messages["stamp"], messages["sent"]
    steps, waits = np.diff(stamp), np.diff(sent)
    jumps = np.flatnonzero((steps - waits > _JUMP_NS) | (steps < -_JUMP_NS))
    runs = [_run(part, sample_rate_hz) for part in np.split(stamp, jumps + 1)]
    steady = np.abs(steps) <= _JUMP_NS
    passed, waited = steps[steady].sum(), waits[steady].sum()
    jitter = np.abs(waits - steps)[steady & (steps > 0)]
    gaps = [first for _, _, first in runs if first is not None]
    values = messages["value"]
    finite = np.isfinite(values)
    return TopicTiming(
        messages=stamp.size,
        rate_hz=float(sample_rate_hz * passed / waited) if waited > 0 else float("nan"),
        jitter=Distribution.of(jitter * 1e-9),
        lost=sum(lost for lost, _, _ in runs),
        repeated=sum(repeated for _, repeated, _ in runs),
        unordered=int(((steps < 0) & (steps >= -_JUMP_NS)).sum()),
        clock_jumps=jumps.size,
        not_finite=int((~finite).sum()),
        lost_at_s=min(gaps) * 1e-9 if gaps else float("nan"),
        greatest=float(np.abs(values[finite]).max(initial=0.0)),
    )


def _run(stamp: np.ndarray, sample_rate_hz: float) -> tuple[int, int, float | None]:
    """Return (lost, repeated, instant of the first lost one in ns) between two clock jumps."""
    known = np.unique(stamp)
    missing = np.rint(np.diff(known) * 1e-9 * sample_rate_hz).astype(int) - 1
    gaps = np.flatnonzero(missing > 0)
    first = known[gaps[0]] + 1e9 / sample_rate_hz if gaps.size else None
    return int(missing[gaps].sum()), stamp.size - known.size, first


def _first_of_each(messages: np.ndarray) -> np.ndarray:
    """Return the first message of each stamp, in the order of stamps."""
    return messages[np.unique(messages["stamp"], return_index=True)[1]]


def _lateness_s(messages: np.ndarray, sample_rate_hz: float) -> np.ndarray:
    """Return how much later than the most punctual of the last ones each was sent (s)."""
    offset = messages["sent"] - messages["stamp"]
    if not offset.size:
        return np.empty(0)
    offset -= offset[0]  # small enough for the filter, which counts in doubles
    half = round(_PUNCTUAL_S * sample_rate_hz / 2.0)
    punctual = minimum_filter1d(offset, 2 * half + 1, mode="nearest", origin=half)
    return (offset - punctual) * 1e-9
