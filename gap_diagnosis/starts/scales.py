"""What is usual in a record: the measures of all starts and bounds of fits.

The table of effects gives both relative to these scales; which one a parameter takes follows from
its unit and from the part that its effect acts on.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fjr_sim_node import effects as fx

_QUARTER_CYCLE = 0.2  # rad of rms motion: about a quarter of what is then travelled to and fro
_FINE, _COARSE = 0.065, 0.5  # rad of rms motion from one number of ripples to the next
_FEW_CYCLES, _MOST_CYCLES = 400, 400_000  # at the finer steps, at all
_FINEST_CYCLES = 9e5
_STRETCH = 30  # samples: of the finest ripples ten pass in as many
_OF_THE_WAY = 0.1  # that is travelled so slowly that the finest ripples are sampled
_SPEED_BANDS = 40
_NEAR_NO_LOAD = 0.05


@dataclass(frozen=True)
class Scales:
    """What is usual in a record: the measures of all starts and bounds of fits.

    Attributes:
        torque_nm: rms torque.
        velocity_rad_s: rms velocity.
        angle_rad: rms of the motion about its mean.
        deflection_rad: rms torque over k0; the rms motion on a rigid axis, and before a held link,
            where it is the deflection.
        period_s: sample period.
        band_hz: highest frequency with signal.
        inertia_kg_m2: motor and link together.
        peak_torque_nm: greatest torque; a drive that saturates does so below it, and far below
            where the loop then asks for more.
        travel_rad: greatest range of the motion within one run; infinite where nobody looked.
        slow_rad_s: velocity below which a tenth of the way is travelled; of the rms velocity where
            nobody looked.
        corners: pairs of motor speed (rad/s) and greatest torque (N m) in its direction.
    """

    torque_nm: float
    velocity_rad_s: float
    angle_rad: float
    deflection_rad: float
    period_s: float
    band_hz: float
    inertia_kg_m2: float
    peak_torque_nm: float
    travel_rad: float = math.inf
    slow_rad_s: float = math.inf
    corners: tuple[tuple[float, float], ...] = ()

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
        flexible = nominal.get("k0") and "j" in nominal
        return cls(
            torque_nm=torque,
            velocity_rad_s=_rms(speeds),
            angle_rad=angle,
            deflection_rad=torque / nominal["k0"] if flexible else angle,
            period_s=1.0 / sample_rate_hz,
            band_hz=band_hz,
            inertia_kg_m2=nominal["jm"] + nominal.get("j", 0.0),
            peak_torque_nm=max(float(np.abs(u).max()) for u in torques) or 1.0,
            travel_rad=max(float(np.ptp(y)) for y in positions),
            slow_rad_s=_slow(positions) * sample_rate_hz,
            corners=_corners(
                np.concatenate(speeds),
                np.concatenate(
                    [u[span // 2 :][: v.size] for u, v in zip(torques, speeds, strict=True)]
                ),
            ),
        )

    def of(self, name: str) -> float:
        """Return the scale of a parameter, by its full name, in the parameter's unit."""
        parameter = fx.parameter(name)
        if parameter.absolute or parameter.role in ("angle", "cycles"):
            return 1.0
        if parameter.role == "limit":
            return {
                "N m": self.peak_torque_nm,
                "N m/s": self.peak_torque_nm / self.period_s,
                "N m/rad": self.torque_nm / self.angle_rad,
            }[parameter.unit]
        part = fx.EFFECTS[name.split(".", 1)[0]].acts_on
        inner = part == "transmission"
        drag = re.fullmatch(r"N m s(\d*)/rad\1", parameter.unit)
        if drag:
            return self.torque_nm / self.velocity_rad_s ** int(drag[1] or 1)
        return {
            "": 1.0,
            "N m": self.torque_nm,
            "rad": self.deflection_rad if inner else self.angle_rad,
            "N m/rad": self.torque_nm / self.angle_rad,
            "N m/rad3": self.torque_nm / (self.deflection_rad if inner else self.angle_rad) ** 3,
            "rad/N m": self.angle_rad / self.torque_nm,
            "rad/s": self.velocity_rad_s,
            "s": self.angle_rad / self.velocity_rad_s if part == "link" else self.period_s,
            "1/s": 1.0 / self.period_s,
            "Hz": self.band_hz,
            "kg m2": self.inertia_kg_m2,
        }[parameter.unit]

    def stall_nm(self, no_load_rad_s: float) -> float:
        """Return the stall torque whose line, which falls to zero at a speed, the record reaches.

        Args:
            no_load_rad_s: that speed; what the record does near it or beyond does not count.
        """
        shares = [(torque, 1.0 - speed / no_load_rad_s) for speed, torque in self.corners]
        reached = [torque / share for torque, share in shares if share > _NEAR_NO_LOAD]
        return max([self.peak_torque_nm, *reached])

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
        ripple where the motion is slow, in even steps that a fit can bridge.
        """
        low = max(_QUARTER_CYCLE / self.angle_rad, 0.02)
        sampled = 2.0 * np.pi / (3.0 * self.period_s)
        usual = min(max(sampled / self.velocity_rad_s, 4.0 * low), _FINEST_CYCLES)
        high = max(min(sampled / self.slow_rad_s, _FINEST_CYCLES), usual)
        step = max((usual - low) / _FEW_CYCLES, _FINE / self.angle_rad)
        step = min(step, _COARSE / self.angle_rad)
        return low + step * np.arange(min(int((high - low) / step), _MOST_CYCLES) + 1)


def _slow(positions: Sequence[np.ndarray]) -> float:
    """Return the way of a sample below which a tenth of all is travelled, infinite if none is."""
    ways = np.sort(np.abs(np.concatenate([np.diff(y[::_STRETCH]) for y in positions])))
    travelled = np.cumsum(ways)
    if not ways.size or not travelled[-1]:
        return math.inf
    return float(ways[np.searchsorted(travelled, _OF_THE_WAY * travelled[-1])]) / _STRETCH


def _corners(speeds: np.ndarray, torques: np.ndarray) -> tuple[tuple[float, float], ...]:
    """Return the greatest torque in the direction of motion within each of some bands of speed."""
    driven = speeds * torques > 0.0
    if not driven.any():
        return ()
    speeds, torques = np.abs(speeds[driven]), np.abs(torques[driven])
    band = (speeds / (speeds.max() * (1.0 + 1e-12)) * _SPEED_BANDS).astype(int)
    order = np.lexsort((torques, band))
    last = order[np.flatnonzero(np.diff(band[order], append=_SPEED_BANDS))]
    return tuple(zip(speeds[last].tolist(), torques[last].tolist(), strict=True))


def _rms(signals: Sequence[np.ndarray]) -> float:
    """Return the rms over all signals, 1 if they are zero."""
    return float(np.sqrt(np.mean(np.concatenate([s.ravel() for s in signals]) ** 2))) or 1.0
