"""Whether a rehearsed fault ended in its safe state in time, from the torques that were seen."""

from __future__ import annotations

import math

import numpy as np

from fjr_kit.check import Check
from fjr_sim_node.drive.faults import CONTINUES, NODE, SAFE_STATES, FaultPlan

from .limits import limit_check


def onset_ns(plan: FaultPlan, position: np.ndarray, killed_ns: int | None) -> int | None:
    """Return when a fault began by the machine's clock, None if the run did not get so far.

    Args:
        plan: the fault.
        position: all messages of y, of dtype RECORD.
        killed_ns: when a node was killed.
    """
    if plan.fault.acts_on == NODE:
        return killed_ns
    if not position.size:
        return None
    began = int(position["sent"][0]) + plan.after_ns
    return began if began < position["sent"][-1] else None


def safe_state(
    plan: FaultPlan,
    began_ns: int | None,
    position: np.ndarray,
    torque: np.ndarray,
    ended_ns: int,
    torque_limit_nm: float,
    ahead_s: float,
) -> Check:
    """Return the check of the safe state.

    Its value is the time from the onset to the last torque that is not zero, or for a fault with
    which the loop goes on the longest time without a torque; both in s.

    Args:
        plan: the fault.
        began_ns: from `onset_ns`.
        position: all messages of y, of dtype RECORD.
        torque: all messages of u, of dtype RECORD.
        ended_ns: when the run ended, by the machine's clock.
        torque_limit_nm: what no torque may exceed.
        ahead_s: how far references are streamed ahead; so much later a dead excitation is missed.
    """
    fault = plan.fault
    limit_s = fault.within_s + ahead_s * (plan.values.get("node") == "excitation")
    what = f"after {fault.identifier}"
    if began_ns is None or ended_ns < began_ns + limit_s * 1e9:
        return limit_check(
            "safe_state", math.inf, limit_s, f"{what}: the run ended before the safe state was due"
        )
    after = torque[torque["received"] >= began_ns]
    if fault.safe_state == CONTINUES:
        bad = int((~(np.abs(after["value"]) <= torque_limit_nm)).sum())
        if bad:
            words = f"{what} {bad} torques were not finite or beyond {torque_limit_nm:g} N m"
            return limit_check("safe_state", math.inf, limit_s, words)
        asked = min(ended_ns, int(position["sent"][-1]))
        # Behind the last position nobody asks any more: if that one was lost, the watchdog's
        # torques come then, and end no pause.
        answers = after["received"][after["received"] <= asked]
        times = np.concatenate([[began_ns], answers, [max(asked, began_ns)]])
        pause_s = float(np.diff(times).max()) * 1e-9
        words = f"{what} no torque came for {pause_s:.3f} s at most ({SAFE_STATES[CONTINUES]})"
        return limit_check("safe_state", pause_s, limit_s, words)
    moving = after["received"][after["value"] != 0.0]
    last_s = float(moving[-1] - began_ns) * 1e-9 if moving.size else 0.0
    words = f"{what} the last torque that was not zero came after {last_s:.3f} s"
    return limit_check("safe_state", last_s, limit_s, words)
