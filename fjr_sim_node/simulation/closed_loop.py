"""Closed-loop batch simulation: the compiled steps of the nodes, without the messages between.

At sample k the encoder gives y = th + noise, the controller answers with u = sat(C_r r - C_y y),
and u is held to the next sample: the lockstep of the graph. Where the command is given, such as a
recorded torque, the law is an observer: with the recorded position as its reference it holds the
model to the recorded motion. Its torque is not late by the delay of a drive, which would make it
swing, nor swallowed by a dead band; what else a drive does to a torque it does to that one (but for
a slew limit beside a delay), for else a drive that lets little through would be explained best of
all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from controller_node import pd_filtered, transfer_function
from controller_node.law import Law
from controller_node.transfer_function import TransferFunction
from fjr_interface.topics import Signal
from fjr_kit.compiled import jit
from fjr_kit.errors import InputError

from ..plant import PLANT
from . import rig

_LINK_INERTIA = PLANT.names.index("j")
_NOTHING = np.empty(0)


@dataclass(frozen=True)
class State:
    """State of a loop before a sample.

    Attributes:
        rig: as `rig.at_rest`.
        law: that of the control law, float64 (states + 1,); a step uses the last one for itself.
    """

    rig: np.ndarray
    law: np.ndarray

    @classmethod
    def at_rest(cls, controller: Law, elapsed_s: float = 0.0) -> State:
        """Return the state of a loop that has not moved yet.

        Args:
            controller: from `law.law_of`.
            elapsed_s: time since the rig was switched on, for what drifts.
        """
        states = controller.states if isinstance(controller, TransferFunction) else 1
        return cls(rig.at_rest(elapsed_s), np.zeros(states + 1))

    def copied(self) -> State:
        """Return one that a simulation may change."""
        return State(self.rig.copy(), self.law.copy())


@dataclass(frozen=True)
class Trajectory:
    """Sampled signals of a simulation, float64 of shape (samples,) each.

    Attributes:
        reference: r (rad).
        position: y, measured motor position (rad).
        torque: u (N m).
        link: q, link position (rad).
        motor: th, true motor position (rad).
        end: state of the loop after the last sample.
    """

    reference: np.ndarray
    position: np.ndarray
    torque: np.ndarray
    link: np.ndarray
    motor: np.ndarray
    end: State

    def sampled(self, steps: int) -> Trajectory:
        """Return the signals at every so many steps, the torque being its mean until the next."""
        if steps == 1:
            return self
        names = ("reference", "position", "link", "motor")
        signals = {name: getattr(self, name)[::steps] for name in names}
        return replace(self, **signals, torque=self.torque.reshape(-1, steps).mean(axis=1))

    def recorded(self, signals: Sequence[Signal]) -> dict[str, np.ndarray]:
        """Return the samples of signals by their symbols, as a bag takes them."""
        r, y, u, q = self.reference, self.position, self.torque, self.link
        every = {"r": r, "y": y, "u": u, "q": q}
        return {signal.symbol: every[signal.symbol] for signal in signals}


@jit
def _run(reference, noise, sample_period, p, e, c, x, state, position, torque, link, motor):
    for k in range(reference.size):
        y = rig.measure(state, noise[k], e)
        x[0], u = pd_filtered.step(x[0], reference[k] - y, c)
        position[k], torque[k], link[k], motor[k] = y, u, state[rig.LINK], state[rig.MOTOR]
        rig.hold(state, u, sample_period, p, e)


@jit
def _run_law(
    reference, beside, observes, farthest, noise, sample_period, substeps, p, e, x, law, state,
    position, torque, link, motor,
):  # fmt: skip
    b, forward, a, limit = law
    for k in range(reference.size):
        y = rig.measure(state, noise[k], e)
        if not abs(y - reference[k]) <= farthest:
            position[k:] = math.nan
            return
        own = transfer_function.step(x, reference[k], y, b, forward, a, limit)
        u, prompt = own, 0.0
        if observes:
            u, prompt = beside[k], own
        elif beside.size > 0:
            u = own + beside[k]
        position[k], torque[k] = y, u + prompt
        link[k], motor[k] = state[rig.LINK], state[rig.MOTOR]
        for _ in range(substeps):
            rig.hold(state, u, sample_period / substeps, p, e, prompt)


def simulate(
    reference: np.ndarray,
    sample_rate_hz: float,
    plant_coefficients: tuple[float, ...],
    controller: Law,
    noise: np.ndarray | None = None,
    effects: np.ndarray | None = None,
    elapsed_s: float = 0.0,
    begin: State | None = None,
) -> Trajectory:
    """Simulate the closed loop from rest, or from a state of it.

    Args:
        reference: r, float64 of shape (samples,) in rad.
        sample_rate_hz: rate of the samples.
        plant_coefficients: from `plant.coefficients`.
        controller: from `law.law_of`.
        noise: encoder noise in rad, of shape (samples,); None for none.
        effects: from `effects.coefficients`; None for the bare plant.
        elapsed_s: time since the rig was switched on, for what drifts.
        begin: where the simulation begins, with its own elapsed time; None for rest.

    Raises:
        InputError: the motion diverged.
    """
    begin = begin or State.at_rest(controller, elapsed_s)
    if isinstance(controller, TransferFunction):
        return simulate_law(
            reference, sample_rate_hz, plant_coefficients, controller, noise, effects, begin=begin
        )
    reference, noise, out = _prepared(reference, noise, begin)
    _run(
        reference,
        noise,
        1.0 / sample_rate_hz,
        plant_coefficients,
        effects,
        controller,
        out.end.law,
        out.end.rig,
        out.position,
        out.torque,
        out.link,
        out.motor,
    )
    return _finite(out, sample_rate_hz)


def simulate_law(
    reference: np.ndarray,
    sample_rate_hz: float,
    plant_coefficients: tuple[float, ...],
    controller: TransferFunction,
    noise: np.ndarray | None = None,
    effects: np.ndarray | None = None,
    elapsed_s: float = 0.0,
    *,
    command: np.ndarray | None = None,
    added: np.ndarray | None = None,
    start: tuple[float, float] = (0.0, 0.0),
    held_at: float | None = None,
    controller_state: np.ndarray | None = None,
    begin: State | None = None,
    substeps: int = 1,
    farthest: float = math.inf,
) -> Trajectory:
    """Simulate the loop of any linear law, from any start; see `simulate`.

    Args:
        reference: r, float64 of shape (samples,) in rad.
        sample_rate_hz: rate of the samples.
        plant_coefficients: from `plant.coefficients`.
        controller: the law; one that runs several times in a sample does so here.
        noise: encoder noise in rad, of shape (samples,); None for none.
        effects: from `effects.coefficients`; None for the bare plant.
        elapsed_s: time since the rig was switched on, for what drifts.
        command: torque command of the drive, (samples,) in N m, beside which the law is an
            observer whose torque no delay holds up; None where the law makes the command.
        added: torque that a controller commands beside its law, (samples,) in N m; None for none.
        start: position (rad) and velocity (rad/s) that the encoder reads at the first sample, all
            bodies moving as one, but for a link that is held.
        held_at: where that is held (rad); None for the position at the start.
        controller_state: state of the law before it, such as the `entering_state` of a record;
            None for zero.
        begin: where the simulation begins, whatever the three say; None for what they say.
        substeps: parts of a sample in which the plant is integrated, at least.
        farthest: how far from the reference the encoder may read (rad); beyond it the motion has
            diverged. One that goes on and on takes ever more steps.

    Raises:
        InputError: the motion diverged, or signals or state have another length than they must.
    """
    if begin is None:
        begin = State.at_rest(controller, elapsed_s)
        rig.move(begin.rig, *rig.under_reading(*start, effects))
        if math.isinf(plant_coefficients[_LINK_INERTIA]):
            rig.hold_link(begin.rig, held_at)
        if controller_state is not None:
            begin.law[:-1] = _of_length(
                controller_state, controller.states, "controller_state", "states"
            )
    steps, samples = controller.steps, np.size(reference)

    def held(values: np.ndarray, name: str) -> np.ndarray:
        return np.repeat(_of_length(values, samples, name, "samples"), steps)

    if noise is not None:
        noise = held(noise, "noise")
    beside = _NOTHING
    if command is not None:
        beside = held(command, "command")
    elif added is not None:
        beside = held(added, "added")
    reference, noise, out = _prepared(controller.between(reference), noise, begin)
    _run_law(
        reference,
        beside,
        command is not None,
        farthest,
        noise,
        1.0 / (steps * sample_rate_hz),
        substeps,
        plant_coefficients,
        effects,
        out.end.law,
        controller.coefficients,
        out.end.rig,
        out.position,
        out.torque,
        out.link,
        out.motor,
    )
    return _finite(out, steps * sample_rate_hz).sampled(steps)


def _prepared(
    reference: np.ndarray, noise: np.ndarray | None, begin: State
) -> tuple[np.ndarray, np.ndarray, Trajectory]:
    """Return reference and noise as the kernels take them, and room for signals and state."""
    reference = np.ascontiguousarray(reference, float)
    if noise is None:
        noise = np.zeros(reference.size)
    noise = _of_length(noise, reference.size, "noise", "samples")
    y, u, q, th = (np.empty(reference.size) for _ in range(4))
    return reference, noise, Trajectory(reference, y, u, q, th, begin.copied())


def _of_length(values: np.ndarray, length: int, name: str, unit: str) -> np.ndarray:
    if np.shape(values) != (length,):
        raise InputError(f"{name} must have {length} {unit}, not the shape {np.shape(values)}.")
    return np.ascontiguousarray(values, float)


def _finite(out: Trajectory, sample_rate_hz: float) -> Trajectory:
    """Return the signals; raise InputError if they are not finite."""
    bad = np.flatnonzero(~np.isfinite(out.position))
    if bad.size:
        raise InputError(
            f"The simulated motion diverges at {bad[0] / sample_rate_hz:.3f} s; raise "
            "sample_rate_hz or lower the controller gains or the amplitude."
        )
    return out
