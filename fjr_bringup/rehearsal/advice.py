"""Advice after a NO-GO: a sentence for each kind of limit that is not kept."""

from __future__ import annotations

from collections.abc import Iterable

from fjr_kit.check import Check, failed

from .machine import Machine

BUSY = 0.5
"""Above this share of used processor time the machine is called busy."""

_LATE = {
    "answered", "rate_error", "jitter", "latency", "latency_worst", "late", "unanswered",
    "late_references",
}  # fmt: skip
_ADVICE: tuple[tuple[set[str], str], ...] = (
    ({"course"}, "Read the logs of the nodes in the folder log/: the run did not run its course."),
    (
        {"clocks", "clock_jumps"},
        "Synchronise the clocks of the machines (PTP), and let nothing set a clock during a run.",
    ),
    (
        {"not_finite"},
        "Mend the source of the values that are not finite: an encoder, a driver or a reference.",
    ),
    (
        {"lost", "repeated", "unordered"},
        "Look for the messages that were lost, repeated or out of order between the drive and its "
        "topics: the sender's publisher, its QoS (reliable), a second publisher, the network.",
    ),
    (
        {"trip"},
        "Mend what made the controller trip, as its reason says; raise the limit or the time-out "
        "in question only if the joint bears it.",
    ),
    (
        {"delay_margin"},
        "Shorten the delay, or lower the controller's gains (d first) until the loop bears it.",
    ),
    (
        {"bias_db", "bias_deg"},
        "Shorten the delay, or lower excitation.f_max_hz: the bias of a constant delay can be "
        "corrected after the experiment, that of jitter cannot.",
    ),
    (
        {"response"},
        "Where the loop was late or tripped, mend that first. Otherwise compare the drive with the "
        "parameters of its rig file: a torque limit, a trip, another plant.",
    ),
    (
        {"torque", "position"},
        "Lower excitation.amplitudes_rad, or raise the limit if the joint bears it.",
    ),
    (
        {"safe_state"},
        "Move no hardware: after this fault the loop did not come to its safe state in time. Look "
        "at the time-outs of controller and drive.",
    ),
)


def advice(checks: Iterable[Check], machine: Machine | None) -> list[str]:
    """Return what to do, what comes first first; nothing if every check passed.

    Args:
        checks: of the rehearsal.
        machine: what it did; None if it was not watched.
    """
    names = {check.name for check in failed(checks)}
    sentences = [_in_time(machine)] if names & _LATE else []
    return sentences + [sentence for about, sentence in _ADVICE if names & about]


def _in_time(machine: Machine | None) -> str:
    """Return how the loop comes to keep its time."""
    steps = []
    if machine is None or machine.busy > BUSY:
        steps.append("end what else runs on this machine")
    if machine is None or not all(each.real_time for each in machine.nodes.values()):
        steps.append("give the nodes a real-time priority (chrt --fifo 50 fjr rehearse ...)")
    if machine is None or not machine.real_time_kernel:
        steps.append("use a real-time kernel")
    steps.append("rehearse and record at a lower rate (--rate)")
    return f"For a loop that keeps its time, {'; '.join(steps)}."
