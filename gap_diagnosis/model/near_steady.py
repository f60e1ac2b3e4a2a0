"""Where a simulation may begin that leads to a steady period: near it, in the nominal's state.

A model that is near to the nominal is sooner in its steady state from that one's than from rest,
unless it remembers for longer.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from fjr_kit.errors import InputError
from fjr_records.record_noise import RecordNoise
from fjr_records.records import RecordSet
from fjr_sim_node.simulation import rig
from fjr_sim_node.simulation.closed_loop import State

from .drive import Drive
from .rig_model import Model
from .simulated_rig import run_parallel

_SETTLED = (1e-6, 1e-4)
"""Least and greatest part of the rms position that is left of a transient; between them the noise
of a line, for a tail that lies in one line must not count there."""
_BENT = {"jm": 1.1, "j": 1.1, "fs": 1.2, "fsm": 1.2, "fv": 1.2, "fvm": 1.2, "k0": 0.9}
"""Factors on the parameters of a model that must forget the state of the one it begins near."""
_FORGOTTEN = 3.0  # times what may be left of a transient
_SLOWER = 1.5  # times as long as it took the model that is simulated first


class Player(Protocol):
    """What plays runs that end with a steady period."""

    records: RecordSet

    def drive(self, index: int) -> Drive:
        """Return what drives a simulation of one run."""

    def coefficients(self, model: Model) -> tuple[tuple[float, ...], np.ndarray | None]:
        """Return what a simulation of a model takes: its plant and its effects."""

    def too_stiff(self, model: Model, index: int) -> bool:
        """Tell whether a model would take so long to play as no record can call for."""


def begins(
    simulator: Player, nominal: Model, run_in: int, noise: RecordNoise
) -> dict[int, tuple[int, State]]:
    """Return by run from which sample on it has to be simulated, and the state before.

    Args:
        simulator: plays runs that end with a steady period.
        nominal: the datasheet's model.
        run_in: samples before the steady period.
        noise: of the positions.
    """
    std = noise.std_rad if noise.known else 0.0
    indices = range(len(simulator.records.records))
    found = run_parallel(lambda index: _begin(simulator, nominal, index, run_in, std), indices)
    return {i: begin for i, begin in zip(indices, found, strict=True) if begin is not None}


def _begin(
    simulator: Player, model: Model, index: int, run_in: int, noise_rad: float
) -> tuple[int, State] | None:
    """Return where one run may begin; None if from rest alone.

    How long before the steady period says the model's own way from rest: when its first period has
    come near the last one, nearer where there is less noise.
    """
    rate, coefficients = simulator.records.sample_rate_hz, simulator.coefficients(model)
    drive, samples = simulator.drive(index), simulator.records.records[index].samples
    period = samples - run_in
    if simulator.too_stiff(model, index):
        return None
    try:
        first = drive.simulated(rate, *coefficients)
        off = np.abs(first.position[:period] - first.position[run_in:])
        rms = float(np.std(first.position[run_in:]))
        limit = min(max(noise_rad / period**0.5, _SETTLED[0] * rms), _SETTLED[1] * rms)
        settled = int(_SLOWER * np.flatnonzero(np.append(True, off > limit))[-1])
        begin = run_in - settled
        if begin <= 0:
            return None
        until = drive.part(slice(begin)).simulated(rate, *coefficients)
    except InputError:
        return None
    now = drive.elapsed_s + begin / rate
    middle = float(first.motor[run_in:].mean())
    rig.complete(until.end.rig, float(until.torque[-1]), now, middle)
    found = begin, until.end
    return found if _forgets(simulator, model, drive, run_in, found, limit) else None


def _forgets(
    simulator: Player,
    model: Model,
    drive: Drive,
    run_in: int,
    begun: tuple[int, State],
    limit: float,
) -> bool:
    """Tell whether another model forgets in which state it began.

    Where friction holds a small motion, the place about which it moves depends on the way there for
    ever.
    """
    bent = {n: v * _BENT.get(n, 1.0) for n, v in model.plant.items()}
    rate, other = simulator.records.sample_rate_hz, simulator.coefficients(Model(bent, {}))
    first, state = begun
    try:
        cold = drive.simulated(rate, *other).position[run_in:]
        near = drive.part(slice(first, None), state).simulated(rate, *other)
    except InputError:
        return False
    off = near.position[run_in - first :] - cold
    return float(np.sqrt(np.mean(off**2))) <= _FORGOTTEN * limit
