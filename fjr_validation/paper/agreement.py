"""Do fast and robust method agree in the level of distortion?"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bla_analyzer.bla.robust import INPUT_VARIANCE_LIMIT, turned
from bla_analyzer.compare.bootstrap import interval, resampled
from bla_analyzer.distortion.levels import corrected_position
from fjr_bringup.design.measured import simulate_level
from fjr_kit.tasks import Arrays, Task

from .levels import campaign_of
from .part import Statement, met
from .settings import CASES, SMALL_RAD, Settings

CHUNKS = 4
TARGET_DB = 0.2
CONDITIONS = ("optimum", "friction", "transmission")


def powers(first: int, count: int, realizations: int, **campaign: Any) -> dict[str, Any]:
    """Return, without noise, what both methods need.

    Returns:
        excited, odd: lines; torque, position: complex (count, F), turned; fast: (count, K), |Yc|^2
        at the odd detection lines with G of that realization alone; torque_odd: (count, K), |U|^2.
    """
    level = simulate_level(
        campaign_of(realizations=realizations, periods=2, **campaign),
        0,
        range(first, first + count),
    )
    lines = level.lines
    torque, position = turned(level.spectra, lines.excited)
    corrected = [
        corrected_position(one, one.position[lines.excited] / one.torque[lines.excited], lines,
                           lines.odd)
        for one in level.spectra
    ]  # fmt: skip
    return {
        "excited": lines.excited,
        "odd": lines.odd,
        "torque": torque,
        "position": position,
        "fast": np.abs(np.array(corrected)) ** 2,
        "torque_odd": np.abs(np.array([one.torque[lines.odd] for one in level.spectra])) ** 2,
    }


def tasks(settings: Settings, amplitude_rad: float) -> list[Task]:
    """Return the realizations of three conditions, in chunks."""
    count = settings.agreement_realizations // CHUNKS
    conditions = {
        "optimum": (amplitude_rad, CASES["both"]),
        "friction": (SMALL_RAD, CASES["friction"]),
        "transmission": (amplitude_rad, CASES["transmission"]),
    }
    return [
        Task(
            f"agreement_{name}_{chunk}",
            powers,
            {
                "first": chunk * count,
                "count": count,
                "realizations": count * CHUNKS,
                "amplitude_rad": amplitude,
                "simulator": simulator,
            },
        )
        for name, (amplitude, simulator) in conditions.items()
        for chunk in range(CHUNKS)
    ]


def difference(results: Mapping[str, Arrays], condition: str) -> tuple[float, tuple[float, float]]:
    """Return fast minus robust level in dB, mean over lines, with a 95 % interval.

    Robust: power of Y - G U at excited lines about the BLA of all realizations, log-interpolated to
    the odd detection lines. Fast: mean over realizations of what each gives by itself. Only lines
    at which the torque is reliable (Var(U)/|U|^2 small) count: elsewhere a single realization has
    no G to correct with.
    """
    parts = [results[f"agreement_{condition}_{chunk}"] for chunk in range(CHUNKS)]
    data = {
        key: np.concatenate([one[key] for one in parts]) for key in ("torque", "position", "fast")
    }
    excited, odd = parts[0]["excited"], parts[0]["odd"]
    use = _reliable(data["torque"], excited, odd)

    def level_db(chosen: np.ndarray) -> float:
        torque, position = data["torque"][chosen], data["position"][chosen]
        g = position.mean(axis=0) / torque.mean(axis=0)
        count = len(np.unique(chosen))
        robust = (np.abs(position - g * torque) ** 2).mean(axis=0) * count / (count - 1)
        fast = data["fast"][chosen].mean(axis=0)
        at_odd = np.interp(odd, excited, 10.0 * np.log10(robust))
        return float(np.mean((10.0 * np.log10(fast) - at_odd)[use]))

    count = len(data["torque"])
    return level_db(np.arange(count)), interval(resampled(count, level_db, 200))


def _reliable(torque: np.ndarray, excited: np.ndarray, odd: np.ndarray) -> np.ndarray:
    variance = torque.var(axis=0) / np.abs(torque.mean(axis=0)) ** 2
    return np.interp(odd, excited, variance) <= INPUT_VARIANCE_LIMIT


def summary(results: Mapping[str, Arrays]) -> dict[str, list[float]]:
    """Return the difference and its interval in every condition (dB)."""
    found = {}
    for condition in CONDITIONS:
        value, (low, high) = difference(results, condition)
        found[condition] = [value, low, high]
    return found


def statement(results: Mapping[str, Arrays]) -> Statement:
    """Return the row of the target."""
    found = summary(results)
    words = "; ".join(
        f"{name} {value:+.2f} dB ({low:+.2f} to {high:+.2f})"
        for name, (value, low, high) in found.items()
    )
    worst = max(abs(value) for value, _, _ in found.values())
    return Statement(
        "two methods",
        "target: fast and robust method agree within 0.2 dB in distortion level",
        f"fast minus robust at reliable lines: {words}",
        met(worst <= TARGET_DB),
        "fjr paper",
    )
