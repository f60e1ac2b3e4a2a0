"""Which loop a set of records was driven by: known, known but for gains that it shows, or unknown.

The torque is recorded, so a described controller can be checked: played with the recorded reference
and position it must make the recorded torque. Unknown gains are solved from the same. What it does
not make, such as a feed-forward or a filter that nobody described, is known then, and is added to
the loop: where the model moves as the rig did, its controller makes the recorded torque.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.signal import csd, welch

from controller_node.gains import unknown_gains
from controller_node.law import law_as_run
from controller_node.transfer_function import TransferFunction
from fjr_records.records import Record, RecordSet

from .controller_gains import identify_gains

Loop = Literal["known", "gains_fitted", "unknown"]

FOLLOWS = 0.98
"""Share of the torque's variance that a controller must explain to be the one that is described."""
PARTLY = 0.8
"""Likewise, for its loop to be simulated with the rest added to it: pushes in a test, say."""
GROWS = 20.0
"""Relative change of the simulated motion over that of an inertia, above which the loop is erratic:
of 16 random rigs of the blind check none exceeds 3.3, loops that swing had a hundred or more."""
SWINGS = 0.4
"""Of the motion: where the reference accounts for less, the rig swings by itself. It was at most
0.12 in one that did, at least 0.67 in 23 other rigs of the blind check."""
_STRETCHES = 8  # of a run, over which its coherence is averaged
_SHOWN = 3
"""Most names of runs that a sentence shows."""
EXACT = 0.9999
"""Share below which a described controller is not the whole truth."""
_GOES_WITH = 0.3
"""Coherent share of a torque with reference or position above which a controller made it; noise
has about 0.1 by chance."""


@dataclass(frozen=True)
class RecordLoop:
    """The loop of a set of records.

    Attributes:
        kind: whether it can be simulated in any of them, with gains that were known or solved for.
        laws: the law of each record; None where it is not known, or does not make the torque.
        added: the torque of each record that its controller made beside its law, (samples,) in
            N m; None where that is nothing.
        notes: sentences on what was found.
        commanded: whether a described controller makes the torque of all of them: then it is a
            command, held from sample to sample, also where it drives the model.
    """

    kind: Loop
    laws: tuple[TransferFunction | None, ...]
    added: tuple[np.ndarray | None, ...]
    notes: tuple[str, ...] = ()
    commanded: bool = False

    @classmethod
    def unknown(cls, runs: int) -> RecordLoop:
        """Return the loop of runs whose controller nobody knows."""
        return cls("unknown", (None,) * runs, (None,) * runs)


def loop_of(records: RecordSet) -> RecordLoop:
    """Find the loop of records.

    One set of gains is solved for all records of one controller that does not state them, or a set
    for each where one does not serve all, as of a servo whose gain was changed from run to run.

    Raises:
        InputError: a controller that is described badly.
    """
    runs, rate = records.records, records.sample_rate_hz
    described = [r for r in runs if r.reference is not None and r.controller]
    if not described:
        return RecordLoop.unknown(len(runs))
    solved = [r for r in described if unknown_gains(r.controller)]
    notes: list[str] = []
    gains: dict[str, dict[str, float]] = {}
    if solved:
        one = all(r.controller == solved[0].controller for r in solved)
        common = _solved(solved, rate) if one else {}
        gains = {r.name: common for r in solved}
        if not one or min(explained(_law(r, rate, common), r) for r in solved) < FOLLOWS:
            gains = {r.name: _solved([r], rate) for r in solved}
    laws = {r.name: _law(r, rate, gains.get(r.name, {})) for r in described}
    shares = {r.name: explained(laws[r.name], r) for r in described}
    follow = [r.name for r in described if shares[r.name] >= PARTLY]
    notes += _gains_told({name: found for name, found in gains.items() if name in follow})
    if len(follow) < len(described):
        notes.append(_not_followed(shares, len(runs)))
    most = {r.name: r for r in described if FOLLOWS <= shares[r.name] < EXACT}
    added = {name: _beside(laws[name], r, rate) for name, r in most.items()}
    if added:
        notes.append(_rest_told(min(shares[name] for name in added), list(added.values())))
    pushed = {r.name: r for r in described if PARTLY <= shares[r.name] < FOLLOWS}
    if pushed:
        notes.append(_pushed_told({name: shares[name] for name in pushed}))
    added |= {name: not_made(laws[name], r) for name, r in pushed.items()}
    kind: Loop = "unknown" if not follow else "gains_fitted" if gains else "known"
    chosen = tuple(laws[r.name] if r.name in follow else None for r in runs)
    beside = tuple(added.get(r.name) for r in runs)
    return RecordLoop(kind, chosen, beside, tuple(notes), len(follow) == len(runs))


def without_erratic(loop: RecordLoop, names: Sequence[str], growth: Sequence[float]) -> RecordLoop:
    """Return the loop, not known of the runs in which small differences grow.

    Where a datasheet lacks all friction, say, the loop that is simulated may swing without end; no
    fit finds its way from there to a rig that does not.

    Args:
        loop: of the records.
        names: of the records.
        growth: see `GROWS`; 0 where no law is known.
    """
    erratic = [value > GROWS for value in growth]
    if not any(erratic):
        return loop
    where = _runs_told(
        [name for name, grows in zip(names, erratic, strict=True) if grows], len(names)
    )
    note = (
        f"By the datasheet the loop of {where} swings so that small differences grow "
        f"({max(growth):.2g} times), so there the recorded torque drives the model."
    )
    return _unknown_in(loop, erratic, note)


def without_swinging(loop: RecordLoop, records: RecordSet) -> RecordLoop:
    """Return the loop, not known of the runs in which the rig swings by itself.

    When such a rig is where in its cycle is not the reference's doing, so no loop that is simulated
    repeats it; but the recorded torque makes the recorded motion as in any run.

    Args:
        loop: of the records.
        records: the same.
    """
    accounted = [
        accounted_for(r, records.sample_rate_hz) if law is not None else 1.0
        for r, law in zip(records.records, loop.laws, strict=True)
    ]
    swings = [share < SWINGS for share in accounted]
    if not any(swings):
        return loop
    where = _runs_told(
        [r.name for r, out in zip(records.records, swings, strict=True) if out], len(swings)
    )
    note = (
        f"The reference accounts for no more than {max(s for s in accounted if s < SWINGS):.0%} of "
        f"the motion of {where}, which is greater than the reference: the rig swings by itself, so "
        "there the recorded torque drives the model."
    )
    return _unknown_in(loop, swings, note)


def accounted_for(record: Record, sample_rate_hz: float) -> float:
    """Return which share of a motion its reference accounts for, by their coherence.

    It is 1 where the motion is no greater than the reference: what it does not follow may be what
    friction holds, or rounding.
    """
    r, y = record.reference, record.position
    return 1.0 if r is None or np.std(y) <= np.std(r) else _coherent_share(y, r, sample_rate_hz)


def _coherent_share(signal: np.ndarray, other: np.ndarray, sample_rate_hz: float) -> float:
    """Return the share of a signal's power that goes with another signal, by their coherence."""
    at = {"fs": sample_rate_hz, "nperseg": max(signal.size // _STRETCHES, 2)}
    common, power = csd(signal, other, **at)[1], welch(signal, **at)[1]
    follows = np.abs(common) ** 2 / np.maximum(welch(other, **at)[1], 1e-300)
    return float(follows.sum() / max(power.sum(), 1e-300))


def _beside(law: TransferFunction, record: Record, sample_rate_hz: float) -> np.ndarray | None:
    """Return the recorded torque that a law does not make; None if that is noise of a sensor."""
    assert record.reference is not None
    rest = not_made(law, record)
    signals = (record.reference, record.position)
    made = max(_coherent_share(rest, signal, sample_rate_hz) for signal in signals)
    return rest if made > _GOES_WITH else None


def _rest_told(worst: float, added: Sequence[np.ndarray | None]) -> str:
    """Return the sentence on a controller that makes most of the torque, but not all."""
    if all(rest is None for rest in added):
        what = "the rest goes neither with reference nor with position, as noise of a sensor does"
    else:
        what = (
            "the rest goes with reference or position, so it is of the controller as well, and is "
            "added to the loop as it was recorded"
        )
    return f"The described controller makes {worst:.2%} of the recorded torque's variance; {what}."


def _pushed_told(shares: Mapping[str, float]) -> str:
    """Return the sentence on runs of whose torque the described controller makes the most only."""
    return (
        f"The described controller makes no more than {min(shares.values()):.1%} of the variance "
        f"of the recorded torque of {_runs_told(list(shares), len(shares))}; the rest, such as "
        "pushes in a test, is added to the loop as it was recorded. If there were none, check the "
        "description, the signs, and whether the drive was on."
    )


def _runs_told(names: Sequence[str], runs: int) -> str:
    if len(names) <= _SHOWN:
        return ", ".join(names)
    return f"{len(names)} of {runs} runs"


def _unknown_in(loop: RecordLoop, out: Sequence[bool], note: str) -> RecordLoop:
    laws = tuple(None if unknown else law for law, unknown in zip(loop.laws, out, strict=True))
    kind: Loop = loop.kind if any(law is not None for law in laws) else "unknown"
    return replace(loop, kind=kind, laws=laws, notes=(*loop.notes, note))


def _law(record: Record, rate: float, gains: Mapping[str, float]) -> TransferFunction:
    own = {name: gains[name] for name in unknown_gains(record.controller)}
    return law_as_run(record.controller, rate, own)


def _gains_told(gains: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Return the sentence on gains that were solved for, by run."""
    if not gains:
        return []
    told = []
    for name in dict.fromkeys(name for found in gains.values() for name in found):
        values = [found[name] for found in gains.values() if name in found]
        low, high = min(values), max(values)
        told.append(f"{name} = {low:.4g}" if low == high else f"{name} = {low:.4g} to {high:.4g}")
    one = len({tuple(found.items()) for found in gains.values()}) == 1
    how = "" if one else ", run by run, since no one set makes the torque of all"
    return [f"Gains of the controller solved from the recorded torque{how}: {', '.join(told)}."]


def _not_followed(shares: Mapping[str, float], runs: int) -> str:
    """Return the sentence on runs whose torque the described controller does not make."""
    failed = [name for name, share in shares.items() if share < PARTLY]
    worst = max(min(shares.values()), 0.0)
    which = "any run" if len(failed) == runs else ", ".join(failed)
    return (
        f"The described controller does not make the recorded torque of {which} (as little as "
        f"{worst:.1%} of its variance), so there the loop is not simulated; check the description, "
        "whether reference, position and torque are of one run and have their signs, and whether "
        "the drive was on."
    )


def explained(law: TransferFunction, record: Record) -> float:
    """Return the share of the variance of a recorded torque that a law makes of r and y."""
    return 1.0 - float(np.var(not_made(law, record)) / max(np.var(record.torque), 1e-300))


def not_made(law: TransferFunction, record: Record) -> np.ndarray:
    """Return the recorded torque less the one that a law makes of r and y, (samples,) in N m."""
    assert record.reference is not None
    state = law.entering_state(record.reference, record.position, record.torque)
    return record.torque - law.torque(record.reference, record.position, state)


def _solved(runs: Sequence[Record], rate: float) -> dict[str, float]:
    samples = min(r.samples for r in runs)
    reference = np.array([r.reference[:samples] for r in runs if r.reference is not None])
    torque, position = (
        np.array([getattr(r, name)[:samples] for r in runs]) for name in ("torque", "position")
    )
    controller = runs[0].controller
    assert controller is not None
    return dict(identify_gains(controller, reference, torque, position, rate).values)
