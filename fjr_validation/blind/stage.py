"""A drawn rig on which runs are played: friction, noise, chance, datasheet."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .draw import Scales
from .excitations import Excitation, Run, draw_multisine, draw_records
from .remainders import scattered, wandering
from .rigs import Rig, draw_rig, log_uniform
from .second_simulation import Chance, Play, Record, simulate

FRICTION = (0.01, 0.5)
"""Range of the Coulomb level, both sides together, over the rms torque of all levels."""
NOISE_DB = (20.0, 80.0)
"""Range of the position's rms at the middle level over the encoder's noise."""
DATASHEET = 0.07
"""Greatest relative error of a datasheet value."""
UNKNOWN_CONTROLLERS = 0.3
"""Share of the records whose controller is not described."""
_COARSE = 0.25  # fine steps of what is only compared, over those of what is recorded
_CUBIC = (1e-3, 0.05)  # k1 d^2 over k0, d the rms deflection at the highest level
_LEAST_MOTION = 0.15  # of the motor over the reference at the lowest level


class Unsuitable(Exception):
    """What was drawn cannot be a case; draw again."""


@dataclass(frozen=True)
class Stage:
    """A rig with its experiment.

    Attributes:
        rig: as drawn.
        excitation: its runs.
        plant: the bare parameters with friction.
        scales: what it does at its highest level.
        noise_rad: standard deviation of the encoder's noise.
        seed: of what chance adds to the runs.
        wander_s: correlation time of a torque that wanders.
        facts: ratios that were drawn.
    """

    rig: Rig
    excitation: Excitation
    plant: Mapping[str, float]
    scales: Scales
    noise_rad: float
    seed: tuple[int, ...]
    wander_s: float
    facts: Mapping[str, float]

    def record(
        self,
        run: Run,
        plant: Mapping[str, float],
        settings: Mapping[str, float],
        *,
        scatter: float = 0.0,
        noisy: bool = False,
    ) -> Record:
        """Play one run; raise Unsuitable if the motion diverges.

        Args:
            run: one of the excitation's.
            plant: the bare parameters.
            settings: of the second plant; a value of the bare plant replaces that of `plant`.
            scatter: of friction from run to run, relative.
            noisy: whether it is recorded: with noise and with the full rate of fine steps.
        """
        index = self.excitation.runs.index(run)
        friction, noise_of, wander_of, jitter_of = (
            np.random.default_rng([*self.seed, index, part]) for part in range(4)
        )
        own = {name: settings.get(name, value) for name, value in plant.items()}
        own = scattered(own, scatter, friction)
        rest = {name: value for name, value in settings.items() if name not in plant}
        samples, rate = run.reference.size, self.rig.loop.sample_rate_hz
        noise = self.noise_rad * noise_of.standard_normal(samples) if noisy else None
        wander = wandering(wander_of, samples, rate, self.wander_s) if "wander_nm" in rest else None
        jitter = jitter_of.standard_normal(samples) if "jitter_s" in rest else None
        play = Play(
            self.rig.loop,
            Chance(noise, wander, jitter),
            index * samples / rate,
            self.rig.steps_per_second * (1.0 if noisy else _COARSE),
        )
        return _played(run, own, rest, play)

    def positions(
        self, plant: Mapping[str, float], settings: Mapping[str, float], scatter: float = 0.0
    ) -> list[np.ndarray]:
        """Return y of the first run of each level, coarsely and without noise."""
        return [
            self.record(run, plant, settings, scatter=scatter).y for run in self.excitation.firsts
        ]


def _played(
    run: Run, plant: Mapping[str, float], settings: Mapping[str, float], play: Play
) -> Record:
    try:
        return simulate(run.reference, plant, settings, play)
    except FloatingPointError:
        raise Unsuitable("the motion diverges") from None


def draw_stage(seed: tuple[int, ...], *, periodic: bool) -> Stage:
    """Draw a rig with its experiment; raise Unsuitable if it hardly moves or diverges."""
    rng = np.random.default_rng(seed)
    rig = draw_rig(rng)
    if periodic:
        excitation = draw_multisine(rng, rig)
    else:
        known = rng.random() >= UNKNOWN_CONTROLLERS
        excitation = draw_records(rng, rig, controller_known=known)
    play = Play(rig.loop, steps_per_second=_COARSE * rig.steps_per_second)
    smooth = [_played(run, rig.plant, {}, play) for run in excitation.firsts]
    ratio = log_uniform(rng, *FRICTION)
    level = ratio * _torque(smooth) / math.sqrt(1.0 - ratio**2)
    share, cubic = rng.uniform(0.3, 0.9), log_uniform(rng, *_CUBIC)
    deflection = float(np.std(smooth[-1].q - smooth[-1].th))
    plant = {**rig.plant, "fs": (1.0 - share) * level, "fsm": share * level}
    if not rig.rigid:
        plant["k1"] = cubic * plant["k0"] / deflection**2
    plant = {name: float(f"{value:.5g}") for name, value in plant.items()}
    bare = [_played(run, plant, {}, play) for run in excitation.firsts]
    if np.std(bare[0].th) < _LEAST_MOTION * np.std(excitation.firsts[0].reference):
        raise Unsuitable("the rig hardly moves")
    noise_db = rng.uniform(*NOISE_DB)
    middle = float(np.std(bare[(len(bare) - 1) // 2].y))
    return Stage(
        rig,
        excitation,
        plant,
        _scales(rig, plant, bare[-1]),
        middle * 10.0 ** (-noise_db / 20.0),
        (*seed, 1),
        log_uniform(rng, 0.05, 1.0),
        {
            "sample_rate_hz": rig.loop.sample_rate_hz,
            "resonance_hz": rig.resonance_hz,
            "crossover_hz": rig.crossover_hz,
            "friction_over_torque": level / _torque(bare),
            "noise_db": noise_db,
            "runs": len(excitation.runs),
            "levels": len(excitation.firsts),
            "seconds_per_run": excitation.runs[0].reference.size / rig.loop.sample_rate_hz,
        },
    )


def _torque(records: Sequence[Record]) -> float:
    """Return the rms torque of all levels together."""
    return math.sqrt(np.mean([np.mean(record.u**2) for record in records]))


def _scales(rig: Rig, plant: Mapping[str, float], top: Record) -> Scales:
    rate = rig.loop.sample_rate_hz
    speed = np.diff(top.th) * rate
    rigid = rig.rigid
    effective = plant["jm"] * plant["j"] / (plant["jm"] + plant["j"])
    coulomb = plant["fsm"] + (plant["fs"] if rigid else 0.0)
    return Scales(
        torque=float(np.std(top.u)),
        torque_peak=float(np.abs(top.u).max()),
        torque_rate_peak=float(np.abs(np.diff(top.u)).max() * rate),
        speed=float(np.std(speed)),
        speed_peak=float(np.abs(speed).max()),
        angle=float(np.std(top.th)),
        deflection=float(np.std(top.q - top.th)),
        coulomb=coulomb,
        damping=0.0 if rigid else 2.0 * math.sqrt(plant["k0"] * effective),
        link_inertia=plant["j"],
        resonance_hz=rig.resonance_hz,
        band_hz=rig.band_hz,
        crossover_hz=rig.crossover_hz,
    )


def datasheet(
    rng: np.random.Generator, plant: Mapping[str, float], lacking: Sequence[str]
) -> dict[str, float]:
    """Return a datasheet: each value up to DATASHEET off, and 0 for what it lacks."""
    return {
        name: 0.0 if name in lacking else _rounded(value / (1.0 + rng.uniform(-1, 1) * DATASHEET))
        for name, value in plant.items()
    }


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")


def without(stage: Stage, lacking: Sequence[str]) -> Stage:
    """Return the stage with parameters of its bare plant at zero, which a cause then brings in."""
    plant: dict[str, Any] = {**stage.plant, **dict.fromkeys(lacking, 0.0)}
    return replace(stage, plant=plant)
