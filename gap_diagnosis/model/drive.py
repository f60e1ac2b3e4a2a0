"""What drives a simulation of one recorded run: the loop that was recorded, or an observer."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from controller_node.transfer_function import TransferFunction
from fjr_sim_node.simulation.closed_loop import State, Trajectory, simulate_law


@dataclass(frozen=True)
class Drive:
    """What drives a simulation of one run: the loop that was recorded, or an observer.

    Attributes:
        reference: r of the law, float64 (samples,) in rad: the recorded one, or the recorded
            position where an observer holds the motion to it.
        law: the controller, or the observer.
        command: recorded torque that drives the model, (samples,) in N m; None in the loop.
        added: recorded torque that the law does not make, likewise; None where it makes all.
        start: position (rad) and velocity (rad/s) that the encoder reads at the first sample.
        entry: state of the law before it; None for zero.
        elapsed_s: time since the first run began, for what drifts.
        held_at: where a link is held (rad); None for the position at the start.
        begin: state in which the simulation begins, whatever start and entry say.
        farthest: how far from the reference the motion may go (rad) before it has diverged.
    """

    reference: np.ndarray
    law: TransferFunction
    command: np.ndarray | None
    start: tuple[float, float]
    entry: np.ndarray | None = None
    elapsed_s: float = 0.0
    added: np.ndarray | None = None
    held_at: float | None = None
    begin: State | None = None
    farthest: float = math.inf

    @property
    def observed(self) -> bool:
        """Whether an observer takes the place of a controller that is not known."""
        return self.command is not None

    def simulated(
        self,
        sample_rate_hz: float,
        p: tuple[float, ...],
        e: np.ndarray | None,
        noise: np.ndarray | None = None,
    ) -> Trajectory:
        """Return the simulated run of a rig.

        Args:
            sample_rate_hz: rate of the samples.
            p: from `plant.coefficients`.
            e: from `effects.coefficients`, or None.
            noise: of the encoder, (samples,) in rad; None for none.

        Raises:
            InputError: the motion diverged.
        """
        return simulate_law(
            self.reference, sample_rate_hz, p, self.law, noise, e, self.elapsed_s,
            command=self.command, added=self.added, start=self.start, held_at=self.held_at,
            controller_state=self.entry, begin=self.begin, farthest=self.farthest,
        )  # fmt: skip

    def part(self, samples: slice, begin: State | None = None) -> Drive:
        """Return what drives some samples of the run, from a state."""
        command, added = (
            None if signal is None else signal[samples] for signal in (self.command, self.added)
        )
        return replace(
            self, reference=self.reference[samples], command=command, added=added, begin=begin
        )
