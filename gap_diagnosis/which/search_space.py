"""From which values an effect is fitted: several starting points each, and natural scales.

The table of effects gives starts and bounds of fits relative to `Scales`, those of the record.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fjr_records.recorded import RecordedExperiment
from fjr_sim_node import effects as fx

from ..model.simulated_rig import Model

TOLERANCE = 0.1
"""How far a datasheet value may be off; fits look further, since a torque constant that is off
scales all values, and an encoder whose gain is off (an eccentric one, locally) once more."""

_SCALES = {"k1": 3.0}
"""How many factors of 1 + 3 TOLERANCE fits look away from a nominal value, where not two: k1 goes
with the cube of the position."""

_LEAST_LINK = 0.4  # of its inertia that a third mass leaves it at a start

_QUARTER_CYCLE = 0.2  # rad of rms motion: about a quarter of what is then travelled to and fro
_FINE, _COARSE = 0.065, 0.5  # rad of rms motion from one number of ripples to the next
_MOST_CYCLES = 400
_COARSE_CYCLES = 11


@dataclass(frozen=True)
class Scales:
    """What is usual in a record: the measures of all starts and bounds of fits.

    Attributes:
        torque_nm: rms torque.
        velocity_rad_s: rms velocity.
        angle_rad: rms of the motion about its mean.
        deflection_rad: rms torque over k0; the rms motion on a rigid axis.
        period_s: sample period.
        band_hz: highest frequency with signal.
        inertia_kg_m2: motor and link together.
        peak_torque_nm: greatest torque; a drive that saturates does so below it, and far below
            where the loop then asks for more.
    """

    torque_nm: float
    velocity_rad_s: float
    angle_rad: float
    deflection_rad: float
    period_s: float
    band_hz: float
    inertia_kg_m2: float
    peak_torque_nm: float

    @classmethod
    def of_record(
        cls,
        positions: Sequence[np.ndarray],
        torques: Sequence[np.ndarray],
        sample_rate_hz: float,
        band_hz: float,
        nominal: Mapping[str, float],
    ) -> Scales:
        """Return the scales of a record.

        Args:
            positions: y of each run, float64 (samples,), rad.
            torques: u of each run, float64 (samples,), N m.
            sample_rate_hz: rate of the samples.
            band_hz: highest frequency with signal.
            nominal: bare parameters; a rigid axis has no k0.
        """
        span = max(round(sample_rate_hz / (4.0 * band_hz)), 1)
        speeds = [(y[span:] - y[:-span]) * (sample_rate_hz / span) for y in positions]
        torque, angle = _rms(torques), _rms([y - y.mean() for y in positions])
        return cls(
            torque_nm=torque,
            velocity_rad_s=_rms(speeds),
            angle_rad=angle,
            deflection_rad=torque / nominal["k0"] if nominal.get("k0") else angle,
            period_s=1.0 / sample_rate_hz,
            band_hz=band_hz,
            inertia_kg_m2=nominal["jm"] + nominal.get("j", 0.0),
            peak_torque_nm=max(float(np.abs(u).max()) for u in torques) or 1.0,
        )

    @classmethod
    def of_experiment(cls, recorded: RecordedExperiment, nominal: Mapping[str, float]) -> Scales:
        """Return the scales of a periodic experiment; its lines end where the signal does."""
        description = recorded.experiment
        rate = description.sample_rate_hz
        return cls.of_record(
            [r.position.ravel() for r in recorded.realizations],
            [r.torque.ravel() for r in recorded.realizations],
            rate,
            (recorded.lines - 1) * rate / description.samples_per_period,
            nominal,
        )

    def of(self, name: str) -> float:
        """Return the scale of a parameter, by its full name, in the parameter's unit."""
        parameter = fx.parameter(name)
        if parameter.absolute or parameter.role in ("angle", "cycles"):
            return 1.0
        if parameter.role == "limit":
            return self.peak_torque_nm
        inner = fx.EFFECTS[name.split(".", 1)[0]].acts_on == "transmission"
        return {
            "": 1.0,
            "N m": self.torque_nm,
            "N m s/rad": self.torque_nm / self.velocity_rad_s,
            "N m s2/rad2": self.torque_nm / self.velocity_rad_s**2,
            "rad": self.deflection_rad if inner else self.angle_rad,
            "rad/s": self.velocity_rad_s,
            "s": self.period_s,
            "1/s": 1.0 / self.period_s,
            "Hz": self.band_hz,
            "kg m2": self.inertia_kg_m2,
        }[parameter.unit]

    def bounds(self, name: str) -> tuple[float, float]:
        """Return the least and the greatest value that a fit may give a parameter."""
        parameter = fx.parameter(name)
        if parameter.role == "cycles":
            tried = self.cycles()
            return max(0.6 * float(tried[0]), parameter.low), 1.1 * float(tried[-1])
        return parameter.fit_bounds(self.of(name))

    def negligible(self, name: str) -> float:
        """Return the size of a parameter below which its effect counts as off."""
        return fx.parameter(name).negligible * self.of(name)

    def cycles(self) -> np.ndarray:
        """Return the numbers of ripples per turn that the motion can show, ascending.

        From about a quarter of a ripple over what is travelled to and fro, to three samples in a
        ripple at the rms velocity. Neighbours are as near as a fit can bridge; beyond what that
        allows whole numbers follow, as the poles and slots of motors have.
        """
        low = max(_QUARTER_CYCLE / self.angle_rad, 0.02)
        high = 2.0 * np.pi / (3.0 * self.period_s * self.velocity_rad_s)
        high = float(np.clip(high, 4.0 * low, 9e3))
        step = max((high - low) / _MOST_CYCLES, _FINE / self.angle_rad)
        step = min(step, _COARSE / self.angle_rad)
        near = low + step * np.arange(min(_MOST_CYCLES, int((high - low) / step) + 1))
        whole = np.arange(np.ceil(near[-1]) + 1.0, high)[:_MOST_CYCLES]
        return np.concatenate([near, whole])


def _rms(signals: Sequence[np.ndarray]) -> float:
    """Return the rms over all signals, 1 if they are zero."""
    return float(np.sqrt(np.mean(np.concatenate([s.ravel() for s in signals]) ** 2))) or 1.0


def starts(
    effect: str, scales: Scales, cycles: Sequence[float] | None = None
) -> list[dict[str, float]]:
    """Return the starting points of an effect by full parameter name, within the fit's bounds.

    Args:
        effect: identifier.
        scales: of the record.
        cycles: ripples per turn of an angle-periodic effect; None for a coarse grid.
    """
    points: list[dict[str, float]] = []
    entry = fx.EFFECTS[effect]
    if cycles is None and entry.ripple:
        tried = scales.cycles()
        cycles = np.geomspace(tried[0], tried[-1], _COARSE_CYCLES).tolist()
    for start in entry.starts:
        grid: dict[str, tuple[float, ...]] = {}
        for name, parameter in zip(entry.names, entry.parameters, strict=True):
            if parameter.role == "cycles":
                grid[name] = tuple(cycles or ())
            elif parameter.name in start:
                values = np.array(start[parameter.name]) * scales.of(name)
                inside = np.clip(values, *scales.bounds(name))
                grid[name] = tuple(dict.fromkeys(inside.tolist()))
        points += [
            dict(zip(grid, values, strict=True)) for values in itertools.product(*grid.values())
        ]
    return points


def beside(model: Model, seed: Mapping[str, float]) -> Model:
    """Return a model with a starting point of an effect more.

    A third mass is taken from the link: what low lines see is the sum.
    """
    mass = seed.get("extra_mode.inertia_kg_m2", 0.0)
    left = max(model.plant.get("j", 0.0) - mass, _LEAST_LINK * model.plant.get("j", 0.0))
    plant = {**model.plant, "j": left} if mass else model.plant
    return Model(plant, {**model.effects, **seed})


@dataclass(frozen=True)
class Space:
    """Free parameters of a model and how they map to numbers near 1.

    Base parameters are free on a logarithmic scale around the nominal value; effect parameters are
    free on a linear scale, in units of `units`.

    Attributes:
        nominal: nominal base parameters.
        effects: full names of the free effect parameters.
        units: scale of each, float64.
        tolerance: how far a nominal value may be off.
        scales: of the record; None: effects have no bounds but their physical limits.
    """

    nominal: Mapping[str, float]
    effects: tuple[str, ...] = ()
    units: tuple[float, ...] = ()
    tolerance: float = TOLERANCE
    scales: Scales | None = None

    def model(self, x: np.ndarray) -> Model:
        """Return the model at a point."""
        base = {
            name: value * float(np.exp(step))
            for (name, value), step in zip(self.nominal.items(), x, strict=False)
        }
        values = x[len(self.nominal) :] * np.array(self.units)
        effects = {
            name: value if abs(value) >= least else 0.0
            for name, value, least in zip(self.effects, values.tolist(), self._least, strict=True)
        }
        return Model(base, effects)

    @cached_property
    def _least(self) -> list[float]:
        """Sizes below which the effects count as off."""
        return [self.scales.negligible(n) if self.scales else 0.0 for n in self.effects]

    def point(self, model: Model) -> np.ndarray:
        """Return the point of a model."""
        base = [
            np.log(model.plant[name] / value) if value else 0.0
            for name, value in self.nominal.items()
        ]
        values = [
            model.effects.get(name, fx.parameter(name).default) / unit
            for name, unit in zip(self.effects, self.units, strict=True)
        ]
        return np.array(base + values)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper bounds of a point."""
        scale = np.log1p(3.0 * self.tolerance)
        far = [_SCALES.get(n, 2.0) * scale if v else 0.0 for n, v in self.nominal.items()]
        low, high = [-f for f in far], far
        for name, unit in zip(self.effects, self.units, strict=True):
            parameter = fx.parameter(name)
            least, most = (parameter.low, parameter.high)
            if self.scales is not None:
                least, most = self.scales.bounds(name)
            low.append(max(least / unit, -1e6))
            high.append(min(most / unit, 1e6))
        return np.array(low), np.array(high)


def space_for(
    nominal: Mapping[str, float],
    start: Mapping[str, float],
    scales: Scales,
    tolerance: float = TOLERANCE,
) -> Space:
    """Return the space in which a start's effect parameters are free, in units of the start.

    A parameter that starts at zero has the unit of its other starts. A rigid axis has no
    parameters of the link.
    """
    if "k0" not in nominal:
        start = {name: value for name, value in start.items() if not fx.parameter(name).of_link}
    units = []
    for name, value in start.items():
        if fx.parameter(name).role == "angle":
            units.append(1.0)
        else:
            units.append(abs(value) or _usual(name) * scales.of(name))
    return Space(nominal, tuple(start), tuple(units), tolerance, scales)


def _usual(name: str) -> float:
    """Return the greatest relative start of a parameter by its full name, 1 if it has none."""
    effect, _, own = name.partition(".")
    given = [abs(v) for start in fx.EFFECTS[effect].starts for v in start.get(own, ())]
    return max(given, default=0.0) or 1.0
