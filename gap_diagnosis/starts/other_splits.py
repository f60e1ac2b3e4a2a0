"""A transmission that yields, with another part of the inertia behind it.

Below its resonance such an axis shows by the product of compliance and the square of the share of
the inertia behind it alone: with no link it is a rigid axis, and (1 - share) of all inertia is the
motor's. Fits that begin there slide along that product, and seldom get from one share to another
which the resonance itself tells apart.
"""

from __future__ import annotations

from collections.abc import Mapping

YIELDS = "transmission_stiffness"
_COMPLIANCE, _SHARE = f"{YIELDS}.compliance_rad_nm", f"{YIELDS}.link_inertia_share"
_SHARES = (0.1, 0.3, 0.6, 0.85)
_SAME = 1.4  # ratio of shares, up to which a fit finds the way


def other_splits(effects: Mapping[str, float]) -> list[dict[str, float]]:
    """Return the parameters of effects with other splits of the inertia, alike below resonance.

    Args:
        effects: parameters of effects by full name.
    """
    if not effects.get(_COMPLIANCE):
        return []
    compliance, share = effects[_COMPLIANCE], effects[_SHARE]
    return [
        {**effects, _COMPLIANCE: compliance * (share / other) ** 2, _SHARE: other}
        for other in _SHARES
        if max(share / other, other / share) > _SAME
    ]
