"""A recorded experiment held whole in memory: periods of r, u, y and q, and their spectra."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from fjr_interface.bags.signals import DEFAULT, SignalMap
from fjr_interface.experiment import Experiment
from fjr_interface.resampling.accuracy import Resampling
from fjr_kit.errors import InputError

from .experiment_bag import ExperimentBag, Override
from .experiment_folder import ExperimentFolder, open_experiment
from .records import Record, RecordSet, reference_optional
from .spectra import line_spectrum


@dataclass(frozen=True)
class RecordedRealization:
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
        return line_spectrum(self.kept(signal), lines)


@dataclass(frozen=True)
class RecordedExperiment:
    """All realizations of an experiment folder, in the order (level, realization).

    Attributes:
        source: the folder.
        realizations: one for each bag.
        notes: sentences that a reader of any result must see.
    """

    source: str
    realizations: tuple[RecordedRealization, ...]
    notes: tuple[str, ...] = ()

    @property
    def experiment(self) -> Experiment:
        """The description of the first realization; grid, rate and controller are common to all."""
        return self.realizations[0].experiment

    @property
    def sample_rate_hz(self) -> float:
        """Rate of the samples."""
        return self.experiment.sample_rate_hz

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

    def as_records(self) -> RecordSet:
        """Return the same runs whole, transient and periods after each other."""
        records = tuple(
            Record(
                r.name,
                r.experiment,
                None if r.reference is None else r.reference.ravel(),
                r.torque.ravel(),
                r.position.ravel(),
                None if r.link is None else r.link.ravel(),
                r.experiment.elapsed_s,
            )
            for r in self.realizations
        )
        return RecordSet(self.source, self.sample_rate_hz, records, self.notes)

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
    folder: Path | str,
    signal_map: SignalMap = DEFAULT,
    *,
    override: Override | None = None,
    resampling: Resampling | None = None,
) -> RecordedExperiment:
    """Read all bags of a folder whole; a bag may lack its reference.

    Args:
        folder: experiment folder.
        signal_map: which topics and fields are the signals.
        override: period, transient and number of periods, instead of what the bags say.
        resampling: how to bring unevenly sampled bags onto an even grid; None refuses them.

    Raises:
        InputError: see `open_experiment` and `whole`.
    """
    opened = open_experiment(
        folder, reference_optional(signal_map), override=override, resampling=resampling
    )
    return whole(opened)


def whole(opened: ExperimentFolder) -> RecordedExperiment:
    """Read all bags of an experiment whole.

    Raises:
        InputError: a bag that is damaged further on, or too short.
    """
    realizations = tuple(_cut(bag) for bag in opened.bags)
    return RecordedExperiment(opened.source, realizations, opened.notes)


def _cut(bag: ExperimentBag) -> RecordedRealization:
    (record,) = bag.reader.blocks(2**62)
    samples = bag.experiment.samples
    if record.position.size < samples:
        raise InputError(
            f"{bag.name}: holds {record.position.size} samples, fewer than the {samples} of its "
            "periods; record it whole or use fewer periods."
        )
    shape = (-1, bag.experiment.samples_per_period)
    reference, torque, position, link = (
        None if signal is None else signal[:samples].reshape(shape)
        for signal in (record.reference, record.torque, record.position, record.link)
    )
    assert torque is not None and position is not None  # no bag is read without them
    return RecordedRealization(bag.name, bag.experiment, reference, torque, position, link)
