"""What `fjr check` and `fjr record` print of a bag: one table, and a sentence for each fault."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from fjr_interface.bags.files import bag_files
from fjr_interface.bags.reader import audit
from fjr_interface.bags.signals import DEFAULT, SignalMap
from fjr_interface.bags.topic_survey import BagSurvey, TopicSurvey, survey_bag
from fjr_kit.errors import InputError
from fjr_kit.terminal import print_table

HEADS = (
    ("topic", ""),
    ("messages", ""),
    ("rate", "Hz"),
    ("jitter\nrms", "ms"),
    ("jitter\nworst", "ms"),
    ("lost", ""),
    ("stamps\ntwice", ""),
    ("stamps\nback", ""),
    ("defined", ""),
    ("QoS", ""),
)
_WORDS = ("defined", "QoS")
_APART = [name for name, _ in HEADS].index("stamps\ntwice")
"""On a narrow terminal a table for the times of messages, and one for the rest."""
_RECORDED = "*"
_LEGEND = f"{_RECORDED} by the times of recording: the messages begin with no stamp"


def audited(bag: Path, wanted: Sequence[str], sources: SignalMap | None, console: Console) -> bool:
    """Audit a bag, print what was found; return whether all is well.

    Args:
        bag: folder or storage file.
        wanted: topics by name or last words, of which each must have messages; empty for all.
        sources: where the signals are whose samples are checked; None for the rig's own topics,
            if the bag has them.
        console: where to print.

    Raises:
        InputError: the bag has no such topic.
    """
    try:
        survey = survey_bag(bag)
    except InputError as error:
        console.print(f"{bag}", highlight=False, markup=False, soft_wrap=True)
        _say(console, [str(error)])
        return False
    topics = _chosen(bag, survey, wanted)
    console.print(
        f"{bag}: {sum(each.messages for each in topics)} messages, {survey.duration_s:.3f} s",
        highlight=False,
        markup=False,
        soft_wrap=True,
    )
    print_table(console, HEADS, [_row(topic) for topic in topics], left=_WORDS, apart=_APART)
    if any(each.messages > 1 and not each.stamped for each in topics):
        console.print(_LEGEND, highlight=False, markup=False)
    for note in survey.notes:
        console.print(f"Note: {note}", highlight=False, markup=False, soft_wrap=True)
    faults = [f"{topic.name}: {what}." for topic in topics for what in topic.problems]
    faults += [f"{topic.name}: no message." for topic in topics if wanted and not topic.messages]
    if sources is not None or _is_of_the_rig(bag):
        try:
            audit(bag, sources or DEFAULT)
            console.print("Signals: every sample is there once, at its time.", highlight=False)
        except InputError as error:
            faults.append(f"Signals: {error}")
    _say(console, faults)
    return not faults


def _say(console: Console, faults: Sequence[str]) -> None:
    for fault in faults or ("Nothing is wrong.",):
        console.print(fault, highlight=False, markup=False, soft_wrap=True)
    console.print()


def _chosen(bag: Path, survey: BagSurvey, wanted: Sequence[str]) -> list[TopicSurvey]:
    for name in wanted:
        if not any(_means(name, topic.name) for topic in survey.topics):
            there = ", ".join(topic.name for topic in survey.topics)
            raise InputError(f"{bag}: holds no topic {name}; there are: {there}.")
    return [
        topic
        for topic in survey.topics
        if not wanted or any(_means(name, topic.name) for name in wanted)
    ]


def _means(wanted: str, topic: str) -> bool:
    return topic == wanted or (not wanted.startswith("/") and topic.endswith(f"/{wanted}"))


def _is_of_the_rig(bag: Path) -> bool:
    there = bag_files(bag).topics
    try:
        return bool(DEFAULT.position.find(there, str(bag)))
    except InputError:
        return False


def _row(topic: TopicSurvey) -> tuple[str, ...]:
    rate = "-"
    if topic.rate_hz is not None:
        rate = f"{topic.rate_hz:.6g}" if topic.regular else "uneven"
    mark = _RECORDED if topic.messages > 1 and not topic.stamped else ""
    return (
        topic.name + mark,
        str(topic.messages),
        rate,
        _ms(topic.jitter_s),
        _ms(topic.worst_jitter_s),
        "-" if topic.lost is None else str(topic.lost),
        str(topic.duplicates),
        str(topic.backward),
        topic.definition,
        topic.qos or "-",
    )


def _ms(seconds: float | None) -> str:
    return "-" if seconds is None else f"{seconds * 1e3:.3g}"
