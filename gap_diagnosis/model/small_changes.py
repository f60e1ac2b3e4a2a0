"""Small changes of the position in the lines of the evidence, and back from lines to the position.

Both are linear and one is the transposed of the other: errors times `changes(moved)` are
`pulls(errors)` times moved. So one transform of what a fit leaves tells of any change whether it
would help. Changes may be means of several samples, where only slow lines count.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .evidence import Evidence
from .lapped import lapped, samples_of, unlapped
from .parts import joined, spans_of

_LEAST_RATE = 8  # samples in a period of the highest line: averaging takes off 3 % there


def changes(
    evidence: Evidence, positions: Mapping[int, np.ndarray], which: Sequence[int], every: int = 1
) -> np.ndarray:
    """Return the lines of changes of y on parts, (..., errors); zeros for those of the twist.

    Args:
        evidence: the records.
        positions: by the index of the record, the changes, means of each `every` samples,
            (..., samples // every).
        which: indices of parts.
        every: a divisor of half the hop.
    """
    hop, scale = evidence.hop // every, np.sqrt(every)  # the transform is orthonormal
    parts = [evidence.parts[i] for i in which]
    spans = spans_of(parts)
    lines = {
        index: scale
        * lapped(positions[index][..., samples_of(span, hop)], hop)[..., : evidence.lines]
        for index, span in spans.items()
    }
    if evidence.twist is not None:
        lines = {i: np.concatenate([own, 0.0 * own], axis=-1) for i, own in lines.items()}
    return joined(lines, spans, parts)


def pulls(
    evidence: Evidence, errors: np.ndarray, which: Sequence[int], every: int = 1
) -> dict[int, np.ndarray]:
    """Return what a change of y at each time adds to the product of its lines with errors.

    Args:
        evidence: the records.
        errors: on parts, (errors,).
        which: indices of parts.
        every: a divisor of half the hop.

    Returns:
        by the index of the record, (samples // every,).
    """
    hop, scale = evidence.hop // every, np.sqrt(every)
    parts, runs = [evidence.parts[i] for i in which], evidence.records.records
    found = {index: np.zeros(runs[index].samples // every) for index in spans_of(parts)}
    ends = np.cumsum([evidence.windows(i) for i in which])
    windows = errors.reshape(ends[-1], -1)[:, : evidence.lines]
    whole = np.pad(windows, ((0, 0), (0, hop - evidence.lines)))
    for part, own in zip(parts, np.split(whole, ends[:-1]), strict=True):
        found[part.record][samples_of(part.windows, hop)] += scale * unlapped(own, hop)
    return found


def averaged_over(hop: int, lines: int, whole: int = 0) -> int:
    """Return over how many samples a signal may be averaged whose lines above `lines` don't count.

    Args:
        hop: of the lapped transform, samples; still an even number of averages.
        lines: that count.
        whole: samples that are a whole number of averages as well.
    """
    most = max(2 * hop // (_LEAST_RATE * lines), 1)
    fits = (e for e in range(most, 0, -1) if hop % (2 * e) == 0 and whole % e == 0)
    return next(fits)
