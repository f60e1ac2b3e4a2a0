"""QoS of a topic as a bag states it."""

from __future__ import annotations

from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

_FOREVER = QosTime(9223372036, 854775807)


def stated_qos(
    history: QosHistory, depth: int, reliability: QosReliability, durability: QosDurability
) -> Qos:
    """Return a QoS without deadline, lifespan or lease."""
    return Qos(
        history,
        depth,
        reliability,
        durability,
        _FOREVER,
        _FOREVER,
        QosLiveliness.AUTOMATIC,
        _FOREVER,
        False,
    )
