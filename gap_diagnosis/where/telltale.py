"""How a cause shows: what a model lacks once it is switched off, and what it adds, at its quantity.

The entry of an effect names the quantity at which its law acts. Over that stands the torque which
holds the best model to the recorded motion once the cause is switched off, beside how much of that
the cause itself adds: where its law is right, the one follows the other. Over frequency stands what
each simulation misses of the position, beside how far the two lie apart. All else keeps its values,
so that the curve is the law alone; what other effects could do in its place is for the tests.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from fjr_sim_node.effects import EFFECTS, Over, Telltale

from ..model.evidence import Evidence
from ..model.quasi_static import QuasiStaticSimulator
from ..model.rig_model import Model
from ..model.steady_runs import SteadyRuns

BINS = 24
POINTS = 300
_PER_DECADE = 16
_FAR = 1e3  # times the motion: the error of a model that diverges
_LEAST = 5  # samples of a bin, below which it shows nothing
_UNSIGNED: tuple[Over, ...] = ("travel", "turn", "time")
"""What has no direction that could be folded."""
_OF_MOTION: tuple[Over, ...] = (
    "travel", "deflection", "deflection rate", "command rate", "time", "frequency",
)  # fmt: skip
"""What records hold nothing of that are compared by torque alone."""
_OF_TORQUE: tuple[Over, ...] = ("load", "command", "command rate")


@dataclass(frozen=True)
class Shown:
    """What shows a cause, over the quantity of its telltale.

    Attributes:
        at, lacking: of samples, (points,): the quantity, and the torque (N m) that the model
            lacks there without the cause; empty over frequency.
        center: of each bin, (bins,): median of the quantity; middle of the band in Hz.
        without: median of the torque that the model lacks without the cause, (bins,), N m; over
            frequency the rms error of its position in a line, rad.
        added: the same of what the cause adds.
        left: the same of what the model lacks with it.
    """

    at: np.ndarray
    lacking: np.ndarray
    center: np.ndarray
    without: np.ndarray
    added: np.ndarray
    left: np.ndarray


def why_not(evidence: Evidence, effect: str) -> str:
    """Return why the telltale of an effect cannot be drawn, in words; empty where it can."""
    over = EFFECTS[effect].telltale.over
    if evidence.slow and over in _OF_MOTION:
        return "the motion is so slow that only torque, angle, direction and speed were compared"
    if evidence.records.swings_free and over in _OF_TORQUE:
        return "no torque was recorded"
    return ""


def shown(evidence: Evidence, effect: str, model: Model) -> Shown | None:
    """Return what shows a cause; None where a simulation diverges.

    Args:
        evidence: the runs; those that report are shown.
        effect: identifier of the cause.
        model: the model with it.
    """
    telltale, own = EFFECTS[effect].telltale, EFFECTS[effect].names
    others = {name: value for name, value in model.effects.items() if name not in own}
    without = replace(model, effects=others)
    if telltale.over == "frequency":
        return _over_frequency(evidence, without, model)
    which = _runs(evidence, every=telltale.over == "time")
    cycles = model.effects.get(f"{effect}.cycles_per_turn", 1.0)
    begun = evidence.records.run_in if isinstance(evidence.records, SteadyRuns) else 0
    smooth = _smooth(evidence)
    held = [evidence.simulator.held(each, which) for each in (without, model)]
    rows = []
    for index, *ends in zip(which, *held, strict=True):
        command = evidence.records.records[index].torque
        torques = [uniform_filter1d(end[1] - command, smooth) for end in ends]
        found = _quantities(evidence, index, ends[1][2], model, cycles)
        rows.append(_folded(telltale, found, *torques)[:, begun:])
    at, lacking, left = np.concatenate(rows, axis=1)
    finite = np.isfinite(at) & np.isfinite(lacking) & np.isfinite(left)
    return _binned(at[finite], lacking[finite], left[finite]) if finite.any() else None


def _runs(evidence: Evidence, every: bool) -> list[int]:
    """Return which runs are shown: of each level the first that reports, or every run."""
    if every:
        return list(range(len(evidence.records.records)))
    first: dict[int, int] = {}
    for part in evidence.reporting:
        first.setdefault(evidence.parts[part].level, evidence.parts[part].record)
    return sorted(first.values())


def _smooth(evidence: Evidence) -> int:
    """Return over how many samples is averaged what holds noise beyond the lines with a signal."""
    return max(int(evidence.records.sample_rate_hz / (evidence.lines * evidence.line_hz)), 1)


def _quantities(
    evidence: Evidence, index: int, link: np.ndarray, model: Model, cycles: float
) -> dict[str, np.ndarray]:
    """Return all quantities of one run but frequency, (samples,) each, in their units.

    The gear of a rigid axis, and of one that moves slowly, carries the motor's torque.

    Args:
        evidence: the runs.
        index: of the run.
        link: its position in the model that is held to the motion, (samples,), rad.
        model: that model.
        cycles: per turn, of a ripple.
    """
    record, rate = evidence.records.records[index], evidence.records.sample_rate_hz
    smooth = _smooth(evidence)

    def change(signal: np.ndarray) -> np.ndarray:
        return rate * np.gradient(uniform_filter1d(signal, smooth))

    position, command = record.position, uniform_filter1d(record.torque, smooth)
    deflection = (link if record.link is None else record.link) - position
    through = model.rigid or evidence.slow
    plant, turn = model.plant, 2.0 * np.pi / cycles
    player = evidence.simulator
    known = player.speeds[index] if isinstance(player, QuasiStaticSimulator) else None
    return {
        "velocity": change(position) if known is None else known,
        "travel": _travel(uniform_filter1d(position, smooth)),
        "position": position,
        "turn": position % turn if np.ptp(position) > turn else position,
        "deflection": deflection,
        "deflection rate": change(deflection),
        "load": command if through else -deflection * (plant["k0"] + plant["k1"] * deflection**2),
        "command": command,
        "command rate": change(record.torque),
        "time": record.elapsed_s + np.arange(record.samples) / rate,
    }


def _folded(
    telltale: Telltale, found: dict[str, np.ndarray], lacking: np.ndarray, left: np.ndarray
) -> np.ndarray:
    """Return the quantity of a telltale, and what both models lack, float64 (3, samples)."""
    at = found[telltale.over]
    if not telltale.along:
        return np.array([at, lacking, left])
    direction = np.sign(found[telltale.along])
    folded = at if telltale.over in _UNSIGNED else direction * at
    return np.array([folded, direction * lacking, direction * left])


def _travel(position: np.ndarray) -> np.ndarray:
    """Return how far the motion has gone since it last turned round, rad, (samples,)."""
    moves, samples = np.sign(np.diff(position, prepend=position[0])), np.arange(position.size)
    ways = moves[np.maximum.accumulate(np.where(moves != 0.0, samples, 0))]
    turns = np.flatnonzero(np.diff(ways, prepend=ways[0]) != 0.0)
    last = np.zeros(position.size, int)
    last[turns] = turns - 1
    return np.abs(position - position[np.maximum.accumulate(last)])


def _binned(at: np.ndarray, lacking: np.ndarray, left: np.ndarray) -> Shown:
    """Return medians in bins of as many samples, and some of the samples."""
    order = np.argsort(at, kind="stable")
    bins = [part for part in np.array_split(order, BINS) if part.size >= _LEAST]

    def medians(values: np.ndarray) -> np.ndarray:
        return np.array([np.median(values[part]) for part in bins])

    few = np.unique(np.linspace(0, at.size - 1, POINTS).astype(int))
    return Shown(
        at[few], lacking[few], medians(at), medians(lacking), medians(lacking - left), medians(left)
    )


def _over_frequency(evidence: Evidence, without: Model, model: Model) -> Shown | None:
    """Return the rms of a line of the errors of both models, and of how far they lie apart."""
    which = evidence.reporting
    bare, full = evidence.errors([without, model], which)
    if np.abs(bare).max() > _FAR * np.abs(evidence.measured(which)).max():
        return None
    moved = bare - full
    if model.rounds:  # what rounds is played as such, not by what that does on the average
        itself = evidence.played_by(evidence.player.adding(None), evidence.noise_power)
        moved = np.subtract(*itself.errors([without, model], which))
    lines = evidence.of_motion.size
    line = np.tile(np.arange(lines), bare.size // lines)
    motion = evidence.of_motion[line]
    frequency = (line[motion] + 0.5) * evidence.line_hz
    band = np.floor(_PER_DECADE * np.log10(frequency)).astype(int)
    _, place = np.unique(band, return_inverse=True)
    count = np.bincount(place)

    def rms(errors: np.ndarray) -> np.ndarray:
        return np.sqrt(np.bincount(place, errors[motion] ** 2) / count)

    center = np.bincount(place, frequency) / count
    nothing = np.empty(0)
    return Shown(nothing, nothing, center, rms(bare), rms(moved), rms(full))
