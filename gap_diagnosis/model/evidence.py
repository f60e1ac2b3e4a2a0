"""Evidence of records: the error of a model in windows and lines, cell by cell and part by part.

The error y_model - y is taken apart by the lapped transform (`lapped`), and so is that of the twist
where the link has an encoder (`twist`). Its numbers stand in **cells**, one for each level, signal
and band: what noise and the remainder of the best model leave is alike within one, and is estimated
there. They also stand in **parts**, blocks of windows of one
record: some parts are for fitting, others for selecting, others for reporting.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Literal

import numpy as np

from fjr_records.record_noise import RecordNoise, record_noise
from fjr_records.records import RecordSet

from .held_motion import held_lines
from .lapped import lapped, samples_of
from .octaves import Octaves, lines_with_signal
from .parts import Part, Purpose, cut, hop_of, joined, spans_of
from .quasi_static import QuasiStaticSimulator, Stations
from .record_rig import RecordSimulator
from .rig_model import Model
from .steady_runs import SteadyRuns
from .twist import twist_of

_SLIGHT = 0.01  # of the torque: in a slow motion, less of it says nothing
_SIMULATION = 1e-3  # error of the simulation itself, of its torque or of its motion
_DIVERGED = 1e6


class Evidence:
    """The errors of models on records.

    Attributes:
        records: the runs, or their stations.
        slow: whether they are compared by torque alone.
        noise: of their positions; not known of a torque.
        simulator: plays them.
        parts: blocks of windows; every window inside a record belongs to one.
        hop: half the length of a window, samples.
        lines: how many lines hold a signal, from line 0 on.
        twist: of the transmission; None where it was not recorded.
        octaves: bands of the lines of one signal.
    """

    def __init__(
        self,
        records: RecordSet,
        nominal: Mapping[str, float],
        slow: Stations | None = None,
        parts: tuple[Part, ...] | None = None,
    ) -> None:
        """Cut the records; raise InputError for a controller that is described badly.

        Args:
            records: the runs.
            nominal: datasheet values by the names of PLANT.
            slow: their stations, where they are compared by torque alone (`quasi_static`).
            parts: into which the same runs are cut already, for other torques.
        """
        self.slow = slow is not None
        self.records = records = records if slow is None else slow.records
        run_in = records.run_in if isinstance(records, SteadyRuns) else 0
        self.hop = hop_of(records, run_in, self.slow)
        self._measured = [lapped(r.position, self.hop) for r in records.records]
        self.simulator: RecordSimulator | QuasiStaticSimulator
        if slow is not None:
            self.noise, self.lines = RecordNoise("none", math.nan), self.hop
            self.simulator = QuasiStaticSimulator(slow)
        else:
            known = records.noise if isinstance(records, SteadyRuns) else None
            self.noise = known or record_noise(records)
            self.lines = lines_with_signal(records, self.noise, self._measured, self.hop)
            top_hz = self.lines * self.line_hz
            self.simulator = RecordSimulator(records, self.noise, top_hz, nominal)
        of_twist = records.twist_noise if isinstance(records, SteadyRuns) else None
        self.twist = None if self.slow else twist_of(records, nominal, self.hop, run_in, of_twist)
        self._recorded = [self._beside_twist(m, i) for i, m in enumerate(self._measured)]
        self.octaves = Octaves.of(self.hop, self.lines)
        held = held_lines(records, self.simulator.response, self.hop, self.lines)
        self._held = [self._beside_twist(lines, i) for i, lines in enumerate(held)]
        self.parts = parts or tuple(cut(records, self.hop, run_in))
        own, bands = len(self.octaves), self.octaves.of_line
        self._band = np.concatenate([bands + own * k for k in range(self.bands // own)])

    def _beside_twist(self, lines: np.ndarray, index: int) -> np.ndarray:
        """Return lines of a run, (windows, lines), and those of its recorded twist after them."""
        own = lines[:, : self.lines]
        if self.twist is None:
            return own
        return np.concatenate([own, self.twist.measured[index][:, : self.lines]], axis=1)

    @property
    def line_hz(self) -> float:
        """Width of a line (Hz)."""
        return 0.5 * self.records.sample_rate_hz / self.hop

    @property
    def band_hz(self) -> float:
        """Highest frequency that is excited, where that is known; lines above hold harmonics."""
        top_hz = self.lines * self.line_hz
        return min(top_hz, self.records.top_hz) if isinstance(self.records, SteadyRuns) else top_hz

    @property
    def bands(self) -> int:
        """Number of bands of all signals; those of the twist stand after those of the motion."""
        return len(self.octaves) * (1 if self.twist is None else 2)

    @property
    def of_motion(self) -> np.ndarray:
        """Which lines of a window are those of the motion, not of the twist, bool (lines,)."""
        return self._band < len(self.octaves)

    @cached_property
    def cells(self) -> int:
        """Number of cells."""
        return len(self.records.levels) * self.bands

    @cached_property
    def noise_power(self) -> np.ndarray:
        """Variance of the noise of an error in each cell, (cells,), rad2; 0 where not known."""
        if not self.noise.known:
            return np.zeros(self.cells)
        if isinstance(self.records, SteadyRuns) and not self.noise.rounds:
            seen = self.octaves.of_scatter(self.player.scattered(self.records.scatter))
            if seen is not None:
                return self.power_beside_twist(seen)
        return self.power_beside_twist(self.octaves.of_noise(self.noise))

    def power_beside_twist(self, of_motion: np.ndarray) -> np.ndarray:
        """Return the variance of an error in each cell, (cells,), rad2, from that of the motion.

        Args:
            of_motion: in each band, (bands,), of each level, (levels * bands,), or in all alike.
        """
        levels, own = len(self.records.levels), len(self.octaves)
        in_bands = of_motion.reshape(-1, own) if of_motion.ndim else of_motion
        found = np.broadcast_to(in_bands, (levels, own))
        if self.twist is not None:
            noise = self.twist.noise
            power = self.octaves.of_noise(noise) if noise.known else np.zeros(own)
            found = np.concatenate([found, np.tile(power, (levels, 1))], axis=1)
        return found.ravel()

    @property
    def unseen(self) -> tuple[str, ...]:
        """Base parameters of which the records show nothing, so that the datasheet's count."""
        return ("jm", "j") if self.slow else ("jm",) if self.records.swings_free else ()

    @property
    def player(self) -> RecordSimulator:
        """What plays the runs; that of slow ones plays nothing."""
        assert isinstance(self.simulator, RecordSimulator)
        return self.simulator

    def played_by(self, simulator: RecordSimulator, noise_power: np.ndarray) -> Evidence:
        """Return the same records beside other simulations, with other noise.

        Args:
            simulator: plays the runs.
            noise_power: variance of an error in each cell, (cells,), rad2.
        """
        other = copy.copy(self)
        other.simulator, other.noise_power = simulator, noise_power
        return other

    def of_motion_alone(self) -> Evidence:
        """Return the same records, compared by their motion and not by their twist."""
        other = copy.copy(self)
        other._recorded, other._held = (
            [lines[:, self.of_motion] for lines in signals]
            for signals in (self._recorded, self._held)
        )
        other._band, other.twist = self._band[self.of_motion], None
        for known in ("cells", "noise_power"):
            other.__dict__.pop(known, None)
        return other

    def parts_for(self, *purposes: Purpose) -> tuple[int, ...]:
        """Return the indices of the parts for some purposes."""
        return tuple(i for i, part in enumerate(self.parts) if part.purpose in purposes)

    @property
    def reported_on(self) -> Literal["records", "blocks", "none"]:
        """What the reporting parts are: records that no fit has seen, or blocks of records."""
        if not self.parts_for("report"):
            return "none"
        records = [{self.parts[i].record for i in self.parts_for(p)} for p in ("fit", "report")]
        return "blocks" if records[0] & records[1] else "records"

    @property
    def reporting(self) -> tuple[int, ...]:
        """The parts that all figures are computed on; the others where none reports."""
        return self.parts_for("report") or self.parts_for("select", "fit")

    def errors(self, models: Sequence[Model], which: Sequence[int]) -> np.ndarray:
        """Return the errors of models on parts, float64 (models, errors), rad.

        A model whose motion diverges has errors of 1e6 times the motion.
        """
        parts = [self.parts[i] for i in which]
        spans, rows = spans_of(parts), []
        for runs in self.simulator.run(models, list(spans)):
            lines = {
                index: self.lines_of(run, index, spans[index])
                for index, run in zip(spans, runs, strict=True)
            }
            rows.append(joined(lines, spans, parts))
        return np.array(rows)

    def lines_of(self, run: np.ndarray, index: int, windows: slice = slice(None)) -> np.ndarray:
        """Return the lines of the error of a simulated run of one record, (windows, lines).

        Those of the twist stand after those of the motion.

        Args:
            run: y, u and q, (3, samples); y alone, (1, samples), where no twist is compared.
            index: of the record.
            windows: which.
        """
        measured = self._recorded[index]
        most = _DIVERGED * np.abs(measured).max()
        if not np.isfinite(run[0]).all():
            return np.full(measured[windows].shape, most)
        lines = lapped(run[0][samples_of(windows, self.hop)], self.hop)[:, : self.lines]
        if self.twist is not None:
            twist = self.twist.lines_of(run, index)[windows, : self.lines]
            lines = np.concatenate([lines, twist], axis=1)
        return np.clip(lines - measured[windows], -most, most)

    def measured(self, which: Sequence[int]) -> np.ndarray:
        """Return the lines of what is compared, as it was measured, on parts, (errors,), rad.

        A torque is that motion which it makes against what holds the rig.
        """
        return self._on_parts(self._held if self.slow else self._recorded, which)

    def _on_parts(self, lines: Sequence[np.ndarray], which: Sequence[int]) -> np.ndarray:
        pieces = [lines[self.parts[i].record][self.parts[i].windows].ravel() for i in which]
        return np.concatenate(pieces)

    def cell_of(self, which: Sequence[int]) -> np.ndarray:
        """Return the cell of each error on parts, int (errors,)."""
        return np.concatenate(
            [
                np.tile(
                    self.records.levels.index(self.parts[i].level) * self.bands + self._band,
                    self.windows(i),
                )
                for i in which
            ]
        )

    def part_of(self, which: Sequence[int]) -> np.ndarray:
        """Return the index of the part of each error, int (errors,)."""
        return np.repeat(which, [self.windows(i) * self._band.size for i in which])

    def stretch_of(self, which: Sequence[int]) -> np.ndarray:
        """Return the index of the first of these parts in the stretch of each error, (errors,)."""
        first: dict[tuple[int, int], int] = {}
        begins = [first.setdefault((self.parts[i].record, self.parts[i].stretch), i) for i in which]
        return np.repeat(begins, [self.windows(i) * self._band.size for i in which])

    def windows(self, part: int) -> int:
        """Return the number of windows of a part."""
        return self.parts[part].windows.stop - self.parts[part].windows.start

    def floor(self, which: Sequence[int]) -> np.ndarray:
        """Return the least variance of a cell, (cells,): noise and the simulation's own error.

        A loop that holds the position turns a share of its torque into a share of the motion that
        this torque would make against the controller alone: much less than of the motion itself
        where a stiff loop moves far and slowly.
        """
        if self.slow:
            every = np.concatenate([np.ravel(lines) for lines in self._held])
            return np.full(self.cells, _SLIGHT**2 * np.mean(every**2) + 1e-30)
        moved, held = (
            self.mean_squares(self._on_parts(lines, which), which)
            for lines in (self._recorded, self._held)
        )
        return self.noise_power + _SIMULATION**2 * np.minimum(moved, held) + 1e-30

    def mean_squares(self, values: np.ndarray, which: Sequence[int]) -> np.ndarray:
        """Return the mean square of numbers on parts in each cell, (cells,); 0 where none is."""
        cell = self.cell_of(which)
        count = np.bincount(cell, minlength=self.cells)
        total = np.bincount(cell, values**2, self.cells)
        return total / np.maximum(count, 1)
