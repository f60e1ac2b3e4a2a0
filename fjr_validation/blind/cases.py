"""Blind cases: drawn from a seed, played on the second plant, written as bags."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from excitation_node import multisine
from fjr_interface.bags.folder_names import bag_folder
from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import Experiment

from . import second_plant
from .draws import COMBINED, NONSTATIONARY, OUTSIDE, SINGLE, Draw, Drawer
from .limits import Run, Sizes, Visibility

KINDS = ("none", "parameters", "single", "two", "outside", "nonstationary")

_SHARES = {"none": 1 / 12, "parameters": 1 / 8, "two": 1 / 8, "outside": 1 / 6,
           "nonstationary": 1 / 24}  # fmt: skip
_ALIKE = (
    {"asymmetric_friction", "torque_bias", "gravity"},
    {"backlash", "piecewise_stiffness"},
    {"delay", "actuator_lag"},
    {"position_friction", "cogging"},
)
_LADDER = (0.5, 1.0, 2.0, 4.0, 8.0)
_SPREAD = 0.1
_FIXED_NOISE_RAD = 2e-5
NOMINAL = {"jm": 0.2, "j": 0.3, "fs": 5.0, "fsm": 6.0, "fv": 4.0, "fvm": 2.0, "k0": 1500.0,
            "k1": 3000.0}  # fmt: skip
"""The paper's values, around which the true ones are drawn."""
_EXPERIMENT: dict[str, Any] = {
    "base_frequency_hz": 0.25,
    "f_min_hz": 0.25,
    "amplitudes_rad": (2e-3, 7e-3, 2e-2),
    "realizations": 2,
    "periods": 2,
    "transient_periods": 1,
}


@dataclass(frozen=True)
class Plan:
    """What a case shall hold.

    Attributes:
        kind: one of KINDS.
        drawers: effects of the case, as indices into the kind's draws.
        relative: how far each shall show, over what its detection limit shows.
    """

    kind: str
    drawers: tuple[int, ...] = ()
    relative: tuple[float, ...] = ()


@dataclass(frozen=True)
class Effect:
    """A true effect.

    Attributes:
        name: identifier.
        size: its size.
        limit: its size at the detection limit; None if no sensible size reaches that.
        relative: how far it shows, over what the detection limit shows.
        catalogue: true values of the catalogue's parameters, as far as both plants mean the same.
    """

    name: str
    size: float
    limit: float | None
    relative: float
    catalogue: dict[str, float]


@dataclass(frozen=True)
class Answer:
    """The truth of a case, which is sealed."""

    kind: str
    effects: list[Effect]
    plant: dict[str, float]
    noise_rad: float
    settings: dict[str, float] = field(default_factory=dict)

    def plant_seen(self, named: Collection[str] = ()) -> dict[str, float]:
        """Return the bare parameters as the loop sees them, whatever is named apart.

        A gain of the torque scales them all; one of the encoder, which an eccentric one has about
        its zero, scales all that goes with the position, k1 with its cube.
        """
        seen, settings = dict(self.plant), self.settings
        if "torque_gain" not in named:
            torque = 1.0 + settings.get("gain_error", 0.0)
            seen = {name: value / torque for name, value in seen.items()}
        if "encoder_eccentricity" not in named:
            phase = settings.get("eccentricity_phase_rad", 0.0)
            position = 1.0 + settings.get("eccentricity_rad", 0.0) * math.cos(phase)
            powers = {"fs": 0, "fsm": 0, "k1": 3}
            seen = {name: v / position ** powers.get(name, 1) for name, v in seen.items()}
        return seen

    def to_json(self) -> dict[str, Any]:
        """Return what is sealed."""
        return asdict(self)

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Answer:
        """Return the answer that was sealed."""
        effects = [Effect(**effect) for effect in values["effects"]]
        return cls(**{**values, "effects": effects})


def plans(count: int, seed: int) -> list[Plan]:
    """Return the plans of all cases in an order drawn from the seed.

    Shares of the kinds are fixed; single effects take the catalogue in turn, each through the
    ladder of sizes from half to eight times the detection limit.
    """
    rng = np.random.default_rng([seed, 0])
    numbers = {kind: round(share * count) for kind, share in _SHARES.items()}
    numbers["single"] = count - sum(numbers.values())
    made: list[Plan] = []
    for kind in KINDS:
        made += _plans_of(kind, numbers[kind], rng)
    return [made[index] for index in rng.permutation(count)]


def _plans_of(kind: str, number: int, rng: np.random.Generator) -> list[Plan]:
    if kind in ("none", "parameters"):
        return [Plan(kind)] * number
    order = {"single": SINGLE, "two": COMBINED, "outside": OUTSIDE}.get(kind, (NONSTATIONARY,))
    turn = rng.permutation(len(order))
    ladder = rng.integers(len(_LADDER), size=len(order))
    made = []
    for index in range(number):
        one = int(turn[index % len(order)])
        if kind == "two":
            other = int(rng.choice([i for i in range(len(order)) if _separable(one, i)]))
            sizes = np.exp(rng.uniform(np.log(3.0), np.log(10.0), 2))
            made.append(Plan(kind, (one, other), tuple(sizes.tolist())))
            continue
        rung = _LADDER[(ladder[one] + 2 * (index // len(order))) % len(_LADDER)]
        jitter = 2.0 ** rng.uniform(-0.5, 0.5)
        made.append(Plan(kind, (one,), (float(max(rung, _least(kind)) * jitter),)))
    return made


def _separable(one: int, other: int) -> bool:
    """Tell whether two of COMBINED are different and not near equivalents of each other."""
    alike = [{_name(COMBINED[one]), _name(COMBINED[other])} <= group for group in _ALIKE]
    return one != other and not any(alike)


def _name(drawer: Drawer) -> str:
    return drawer(np.random.default_rng(0)).name


def _least(kind: str) -> float:
    """Return the least rung: what must be refused or noticed is made visible."""
    return 2.0 if kind in ("outside", "nonstationary") else 0.0


def _drawers(kind: str) -> tuple[Drawer, ...]:
    return {
        "single": SINGLE, "two": COMBINED, "outside": OUTSIDE, "nonstationary": (NONSTATIONARY,),
    }.get(kind, ())  # fmt: skip


class CaseMaker:
    """Makes one case of a blind check; everything follows from (seed, index, plan)."""

    def __init__(self, seed: int, index: int, plan: Plan) -> None:
        """Draw parameters, experiment, noise and the shapes of effects."""
        rng = np.random.default_rng([seed, 1, index])
        spread = 0.0 if plan.kind == "none" else _SPREAD
        self._plant = {
            name: value * (1.0 + rng.uniform(-spread, spread)) for name, value in NOMINAL.items()
        }
        self._plan = plan
        self._draws = [_drawers(plan.kind)[index](rng) for index in plan.drawers]
        self._experiments = _experiments(int(rng.integers(2**31)))
        self._noise_seed = int(rng.integers(2**31))
        ratio_db = rng.uniform(20.0, 60.0)
        self._noise_rad = _FIXED_NOISE_RAD if rng.random() < 0.5 else self._noise_at(ratio_db)

    def _noise_at(self, ratio_db: float) -> float:
        """Return the noise (rad) whose ratio to the position at the middle level is given."""
        middle = self._experiments[2]
        reference = multisine.reference(middle)
        y = second_plant.simulate(reference, self._plant, steps_per_second=20_000).y
        kept = y[middle.samples_per_period :]
        return float(np.std(kept) * 10.0 ** (-ratio_db / 20.0))

    def make(self, folder: Path) -> Answer:
        """Write the bags of the case into a folder; return its answer.

        A motion that diverges is tried again with all effects smaller by a third.
        """
        runs = [self._run(index) for index in range(len(self._experiments))]
        searches, peaks = [], {}
        if self._draws:
            visibility = Visibility(runs[::2], self._plant)
            peaks = visibility.peaks
            searches = [Sizes(draw, visibility) for draw in self._draws]
        sizes = [
            search.showing(relative) or draw.most
            for draw, search, relative in zip(
                self._draws, searches, self._plan.relative, strict=True
            )
        ]
        while True:
            settings: dict[str, float] = {}
            for draw, size in zip(self._draws, sizes, strict=True):
                settings |= draw.settings(size, peaks)
            try:
                records = [self._record(run, settings) for run in runs]
                break
            except FloatingPointError:
                sizes = [size * 2.0 / 3.0 for size in sizes]
        for experiment, record in zip(self._experiments, records, strict=True):
            _write(folder, experiment, record)
        effects = [
            _true_effect(draw, search, size, settings)
            for draw, search, size in zip(self._draws, searches, sizes, strict=True)
        ]
        return Answer(self._plan.kind, effects, self._plant, self._noise_rad, settings)

    def _run(self, index: int) -> Run:
        experiment = self._experiments[index]
        noise = np.random.default_rng([self._noise_seed, index]).standard_normal(experiment.samples)
        return Run(
            multisine.reference(experiment),
            self._noise_rad * noise,
            experiment.elapsed_s,
            experiment.samples_per_period,
            experiment.periods,
            max(experiment.excited_harmonics) + 1,
        )

    def _record(self, run: Run, settings: Mapping[str, float]) -> second_plant.Record:
        return second_plant.simulate(
            run.reference, self._plant, settings, noise=run.noise, elapsed_s=run.elapsed_s
        )


def _true_effect(draw: Draw, search: Sizes, size: float, settings: Mapping[str, float]) -> Effect:
    catalogue = {
        theirs: settings[ours] for ours, theirs in draw.same_as.items() if ours in settings
    }
    return Effect(draw.name, size, search.limit, search.relative(size), catalogue)


def _experiments(seed: int) -> list[Experiment]:
    """Return the descriptions of all realizations in the order (level, realization)."""
    loop = second_plant.Loop()
    controller = {
        "kind": "pd_filtered", "p": loop.p, "d": loop.d, "n": loop.n, "torque_limit_nm": None,
    }  # fmt: skip
    values = multisine.EXCITATION.check({**_EXPERIMENT, "seed": seed})
    return [
        multisine.describe(values, level, realization, controller)
        for level in range(len(_EXPERIMENT["amplitudes_rad"]))
        for realization in range(_EXPERIMENT["realizations"])
    ]


def _write(folder: Path, experiment: Experiment, record: second_plant.Record) -> None:
    bag = bag_folder(folder, experiment.level, experiment.realization)
    reference = multisine.reference(experiment)
    with BagWriter(bag, experiment) as writer:
        writer.write_arrays(r=reference, y=record.y, u=record.u)
