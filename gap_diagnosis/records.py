"""The recorded experiment as the diagnosis sees it: periods of r, u and y, and their spectra."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from bla_analyzer.discover import discover
from fjr_interface.bag_reader import (
    DEFAULT,
    BagReader,
    Record,
    SignalMap,
    find_bags,
)
from fjr_interface.errors import InputError
from fjr_interface.experiment import Experiment
from fjr_interface.resampled_reader import open_bag, resampled
from fjr_interface.resampling import Resampling


@dataclass(frozen=True)
class Realization:
    """One bag, cut into periods.

    Attributes:
        name: name of the bag.
        experiment: its description.
        reference: r, float64 (T + P, N) in rad; the first T periods are transient. None if it was
            not recorded.
        torque: u, likewise in N m.
        position: y, likewise in rad.
        link: q, likewise in rad; None without a second encoder.
    """

    name: str
    experiment: Experiment
    reference: np.ndarray | None
    torque: np.ndarray
    position: np.ndarray
    link: np.ndarray | None

    @property
    def level(self) -> int:
        """Index of the excitation level."""
        return self.experiment.level

    @property
    def played(self) -> np.ndarray:
        """The reference, where it is known to be recorded."""
        assert self.reference is not None
        return self.reference

    def kept(self, signal: np.ndarray) -> np.ndarray:
        """Return the kept periods of one of the signals, (P, N)."""
        return signal[self.experiment.transient_periods :]

    def spectrum(self, signal: np.ndarray, lines: int) -> np.ndarray:
        """Return the spectra of the kept periods, complex (P, lines), |X| the peak amplitude."""
        return spectrum(self.kept(signal), lines)


def spectrum(signal: np.ndarray, lines: int) -> np.ndarray:
    """Return the lines 0..lines-1 of periods (..., N), scaled to peak amplitude (1/N at DC)."""
    samples = signal.shape[-1]
    out = np.fft.rfft(signal, axis=-1)[..., :lines] * (2.0 / samples)
    out[..., 0] *= 0.5
    return out


@dataclass(frozen=True)
class RecordedExperiment:
    """All realizations of an experiment folder, in the order (level, realization).

    Attributes:
        source: the folder.
        realizations: one for each bag.
        resampled: what resampling did to the signals, a sentence for each; empty without.
    """

    source: str
    realizations: tuple[Realization, ...]
    resampled: tuple[str, ...] = ()

    @property
    def experiment(self) -> Experiment:
        """The description of the first realization; grid, rate and controller are common to all."""
        return self.realizations[0].experiment

    @cached_property
    def levels(self) -> tuple[int, ...]:
        """The levels that are there, ascending."""
        return tuple(sorted({realization.level for realization in self.realizations}))

    @property
    def amplitudes_rad(self) -> np.ndarray:
        """Rms over lines of the amplitude of each level in `levels`, float64 (levels,)."""
        first = {r.level: r.experiment for r in reversed(self.realizations)}
        return np.array(
            [np.sqrt(np.mean(first[level].amplitudes_rad ** 2)) for level in self.levels]
        )

    @cached_property
    def lines(self) -> int:
        """How many DFT lines are used, DC included: up to the highest excited or detection line."""
        description = self.experiment
        return max(description.excited_harmonics + description.detection_harmonics) + 1

    @property
    def repeatable(self) -> bool:
        """Whether the loop can be repeated: controller and all references are known."""
        known = all(realization.reference is not None for realization in self.realizations)
        return known and self.experiment.controller is not None

    @property
    def has_link(self) -> bool:
        """Whether all realizations have a second encoder."""
        return all(realization.link is not None for realization in self.realizations)

    def kinds(self) -> np.ndarray:
        """Return the kind of each line, str (lines,): excited, odd, even or dc.

        Odd and even lines are those that are not excited: detection lines.
        """
        harmonics = np.arange(self.lines)
        kinds = np.where(harmonics % 2 == 1, "odd", "even").astype("<U7")
        kinds[self.experiment.excited_harmonics] = "excited"
        kinds[0] = "dc"
        return kinds


def read_experiment(
    folder: Path, signal_map: SignalMap = DEFAULT, resampling: Resampling | None = None
) -> RecordedExperiment:
    """Read all bags of a folder.

    Args:
        folder: experiment folder.
        signal_map: which topics and fields are the signals.
        resampling: how to bring unevenly sampled bags onto an even grid; None refuses them.

    Raises:
        InputError: a damaged bag, no description and no period that can be found, or bags of
            different grids or controllers.
    """
    signal_map = _reference_optional(signal_map)
    readers = [open_bag(bag, signal_map, resampling) for bag in find_bags(folder)]
    realizations = []
    for number, reader in enumerate(readers):
        realizations.append(_cut(reader, number))
        _refuse_other_rig(realizations[0], realizations[-1])
    realizations.sort(key=lambda r: (r.level, r.experiment.realization))
    return RecordedExperiment(str(folder), tuple(realizations), tuple(resampled(readers)))


def _cut(reader: BagReader, number: int) -> Realization:
    (record,) = reader.blocks(2**62)
    experiment = reader.experiment
    if experiment is None:
        experiment = _discovered(reader.path, number, record, reader.sample_rate_hz)
    shape = (-1, experiment.samples_per_period)
    signals = (record.reference, record.torque, record.position, record.link)
    reference, torque, position, link = (
        None if s is None else s[: experiment.samples].reshape(shape) for s in signals
    )
    assert torque is not None and position is not None  # no bag is read without them
    return Realization(reader.path.name, experiment, reference, torque, position, link)


def _reference_optional(signal_map: SignalMap) -> SignalMap:
    if signal_map.reference is None:
        return signal_map
    return replace(signal_map, reference=replace(signal_map.reference, required=False))


def _discovered(bag: Path, number: int, record: Record, rate: float) -> Experiment:
    """Return a description of a bag without one, from its reference, else from its torque.

    Bags are taken for realizations of one level; the controller stays unknown.
    """
    source = record.torque if record.reference is None else record.reference
    found = discover(str(bag), source, record.position)
    period = record.position[: -found.samples_per_period - 1 : -1]
    response = np.abs(spectrum(period, int(found.excited.max()) + 1))[found.excited]
    return Experiment(
        sample_rate_hz=rate,
        samples_per_period=found.samples_per_period,
        periods=found.periods,
        transient_periods=found.transient_periods,
        realization=number,
        realizations=number + 1,
        amplitude_rad=[float(value) for value in response],
        excited_harmonics=[int(line) for line in found.excited],
        detection_harmonics=[],
    )


_COMMON = (
    "sample_rate_hz",
    "samples_per_period",
    "periods",
    "transient_periods",
    "excited_harmonics",
    "detection_harmonics",
    "controller",
)


def _refuse_other_rig(first: Realization, other: Realization) -> None:
    for name in _COMMON:
        mine, theirs = getattr(first.experiment, name), getattr(other.experiment, name)
        if mine != theirs:
            raise InputError(
                f"{other.name}: {name} differs from {first.name}; diagnose bags of one rig, grid "
                "and controller, each in a folder of its own."
            )
