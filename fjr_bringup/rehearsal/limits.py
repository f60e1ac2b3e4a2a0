"""Limits of a rehearsal: from its measurements and predictions to GO or NO-GO, with reasons."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fjr_interface.parameter_file import load_parameter_file
from fjr_interface.parameters import Parameter, ParameterGroup
from fjr_kit.check import Check

from .prediction import Prediction
from .timing import LoopTiming, TopicTiming

LIMITS = ParameterGroup(
    Parameter("rate_error", 1e-3, "", "Relative error of the rate of positions", 0.0, 1.0),
    Parameter("jitter_p99_s", 1e-3, "s", "Jitter of positions, 99 % of them", 0.0, 10.0),
    Parameter("latency_p99_s", 2e-3, "s", "Latency of the loop, 99 % of the samples", 0.0, 10.0),
    Parameter("latency_worst_s", math.inf, "s", "Latency of the loop, every sample", 0.0),
    Parameter("late_share", 1e-3, "", "Share of torques later than one sample period", 0.0, 1.0),
    Parameter("lost", 0, "", "Samples of reference, position or torque that are lost", 0, 10**9),
    Parameter("repeated", 0, "", "Messages whose stamp had come before", 0, 10**9),
    Parameter("unordered", 0, "", "Messages older than the one before", 0, 10**9),
    Parameter(
        "delay_margin_share",
        0.5,
        "",
        "Share of the loop's delay margin that the delay of 99 % of the samples may use",
        0.0,
    ),
    Parameter("bias_db", 0.5, "dB", "Bias of the BLA's magnitude by the delay", 0.0, 100.0),
    Parameter("bias_deg", 45.0, "deg", "Bias of the BLA's phase by the delay", 0.0, 3600.0),
    Parameter(
        "response",
        0.3,
        "",
        "Distance of the position from the simulated one, relative rms; simulated drive only",
        0.0,
    ),
    Parameter("torque_nm", math.inf, "N m", "Greatest torque commanded", 0.0),
    Parameter("position_rad", math.inf, "rad", "Greatest position", 0.0),
)
"""Limits of a rehearsal; what exceeds one makes it NO-GO."""

SECTION = "rehearsal"
"""Base name of the section of a limits file that holds them."""


@dataclass(frozen=True)
class LimitsFile:
    """What a limits file says.

    Attributes:
        limits: checked LIMITS.
        controller: unchecked parameters of the controller's own limits, as given.
    """

    limits: dict[str, Any]
    controller: dict[str, Any]

    @classmethod
    def load(cls, path: Path | None) -> LimitsFile:
        """Read a ROS parameter file with sections of `rehearsal` and `controller`.

        Args:
            path: the file; None for the defaults.

        Raises:
            InputError: a bad file, section, name or value.
        """
        given = load_parameter_file(path, nodes=(SECTION, "controller")) if path else {}
        return cls(
            LIMITS.check(given.get(SECTION, {}), f"{path}: {SECTION}"), given.get("controller", {})
        )


def judge(
    timing: LoopTiming,
    prediction: Prediction | None,
    limits: Mapping[str, Any],
    response: float | None = None,
) -> tuple[Check, ...]:
    """Return one check for each limit that can be tested.

    Args:
        timing: what was measured.
        prediction: what its delay does; None if plant or controller are not known.
        limits: checked LIMITS.
        response: distance of the position from the simulated one; None if there is none.
    """
    checks = [*_timing_checks(timing, limits), *_damage_checks(timing, limits)]
    if prediction is not None:
        checks += _prediction_checks(prediction, limits)
    if response is not None:
        checks.append(
            limit_check(
                "response",
                response,
                limits["response"],
                f"the position is {_percent(response)} (relative rms) off the simulated one",
            )
        )
    checks += _motion_checks(timing, limits)
    return tuple(checks)


def limit_check(name: str, value: float, limit: float, what: str) -> Check:
    """Return a check; NaN fails, since what could not be measured is no reason to go."""
    sentence = f"{name}: {what}."
    return Check(name=name, passed=value <= limit, value=value, limit=limit, sentence=sentence)


def _timing_checks(timing: LoopTiming, limits: Mapping[str, Any]) -> Iterator[Check]:
    rate, latency = timing.sample_rate_hz, timing.latency
    if not timing.delay_s.size:
        yield limit_check("answered", 1.0, 0.0, "no position was answered by a torque")
    error = abs(timing.position.rate_hz / rate - 1.0)
    words = f"positions come at {timing.position.rate_hz:.3f} Hz where {rate:g} Hz is due"
    yield limit_check("rate_error", error, limits["rate_error"], words)
    jitter = timing.position.jitter
    words = f"99 % of the positions keep their time within {_ms(jitter.p99)}"
    yield limit_check("jitter", jitter.p99, limits["jitter_p99_s"], words)
    words = f"99 % of the torques answer within {_ms(latency.p99)} (99.9 %: {_ms(latency.p999)})"
    yield limit_check("latency", latency.p99, limits["latency_p99_s"], words)
    words = f"the slowest torque took {_ms(latency.worst)}"
    yield limit_check("latency_worst", latency.worst, limits["latency_worst_s"], words)
    share = timing.late / max(latency.count, 1)
    words = f"{timing.late} of {latency.count} torques came later than the next position was due"
    yield limit_check("late", share, limits["late_share"], words)
    if timing.clocks_differ:
        words = (
            "messages were received before they were sent, so the clocks of two machines differ "
            "and latency is not known: synchronise them"
        )
        yield limit_check("clocks", 1.0, 0.0, words)


def _damage_checks(timing: LoopTiming, limits: Mapping[str, Any]) -> Iterator[Check]:
    topics: dict[str, TopicTiming] = {
        "reference": timing.reference,
        "position": timing.position,
        "torque": timing.torque,
    }
    kinds = (("lost", "samples lost"), ("repeated", "stamps repeated"),
             ("unordered", "messages out of order"))  # fmt: skip
    for kind, words in kinds:
        counts = {name: getattr(topic, kind) for name, topic in topics.items()}
        yield limit_check(kind, sum(counts.values()), limits[kind], f"{words}: {_counts(counts)}")
    words = f"{timing.unanswered} positions got no torque"
    yield limit_check("unanswered", timing.unanswered, limits["lost"], words)
    words = f"{timing.late_references} references came after their position"
    yield limit_check("late_references", timing.late_references, limits["lost"], words)
    counts = {"reference": timing.reference.clock_jumps, "position": timing.position.clock_jumps}
    words = f"jumps of the stamps: {_counts(counts)}"
    yield limit_check("clock_jumps", sum(counts.values()), 0.0, words)
    counts = {name: topic.not_finite for name, topic in topics.items()}
    yield limit_check(
        "not_finite", sum(counts.values()), 0.0, f"values not finite: {_counts(counts)}"
    )


def _prediction_checks(prediction: Prediction, limits: Mapping[str, Any]) -> Iterator[Check]:
    p = prediction
    words = (
        f"the delay (99 %: {_ms(p.delay_p99_s)}) uses {_percent(p.margin_share)} of the loop's "
        f"delay margin of {_ms(p.delay_margin_s)}"
    )
    yield limit_check("delay_margin", p.margin_share, limits["delay_margin_share"], words)
    words = f"the delay will bias the BLA's magnitude by up to {p.worst_bias_db:.2f} dB"
    yield limit_check("bias_db", p.worst_bias_db, limits["bias_db"], words)
    words = f"the delay will bias the BLA's phase by up to {p.worst_bias_deg:.1f} degrees"
    yield limit_check("bias_deg", p.worst_bias_deg, limits["bias_deg"], words)


def _motion_checks(timing: LoopTiming, limits: Mapping[str, Any]) -> Iterator[Check]:
    torque, position = timing.torque.greatest, timing.position.greatest
    yield limit_check("torque", torque, limits["torque_nm"], f"torque reached {torque:.3g} N m")
    yield limit_check(
        "position", position, limits["position_rad"], f"position reached {position:.3g} rad"
    )


def _counts(counts: Mapping[str, int]) -> str:
    found = [f"{number} of {name}" for name, number in counts.items() if number]
    return ", ".join(found) or "none"


def _ms(seconds: float) -> str:
    return f"{seconds * 1e3:.2f} ms"


def _percent(share: float) -> str:
    return f"{share * 100.0:.0f} %"
