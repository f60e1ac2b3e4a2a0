"""The spring of a transmission as springs with dead bands, one for each slope of its curve."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .joint import Joint

_FAR = 1e3  # rad: beyond any deflection


@dataclass(frozen=True)
class SpringPart:
    """A spring that rests within a dead band of the deflection.

    Attributes:
        stiffness_nm_rad: beyond the band.
        cubic_nm_rad3: of the way beyond the band.
        low_rad, high_rad: the band.
    """

    stiffness_nm_rad: float
    cubic_nm_rad3: float
    low_rad: float
    high_rad: float


def spring_parts(joint: Joint) -> list[SpringPart]:
    """Return the springs whose sum is the transmission's, k1 on the way beyond gap and soft zone.

    That of k1 is exact without a soft zone, or where its soft_ratio is zero.
    """
    k0, k1 = joint.bare["k0"], joint.bare["k1"]
    gap = joint.of("backlash")["half_gap_rad"]
    soft = joint.of("piecewise_stiffness")
    sides = joint.of("asymmetric_stiffness")["relative"]
    zone, ratio = (soft["zone_rad"], soft["soft_ratio"]) if soft["zone_rad"] else (0.0, 0.0)
    bands = [(gap + zone, 1.0 - ratio, k1)]
    if ratio:
        bands.insert(0, (gap, ratio, 0.0))
    parts = []
    for band, share, cubic in bands:
        if not sides:
            parts.append(SpringPart(share * k0, cubic, -band, band))
            continue
        parts.append(SpringPart(share * k0 * (1.0 + sides), cubic, -_FAR, band))
        parts.append(SpringPart(share * k0 * (1.0 - sides), cubic, -band, _FAR))
    return parts


def spring_expression(joint: Joint, name: str) -> str:
    """Return the torque of the spring as an expression in MATLAB of a deflection of this name."""
    gap = joint.of("backlash")["half_gap_rad"]
    soft, sides = joint.of("piecewise_stiffness"), joint.of("asymmetric_stiffness")["relative"]
    zone, ratio = soft["zone_rad"], soft["soft_ratio"]
    size = f"max(abs({name}) - {gap!r}, 0)" if gap else f"abs({name})"
    reduced = size
    if zone:
        reduced = f"({size} - {1.0 - ratio!r}*min({size}, {zone!r}))"
    k0, k1 = joint.bare["k0"], joint.bare["k1"]
    slope = f"{k0!r}*(1 + {sides!r}*sign({name}))" if sides else f"{k0!r}"
    cubic = f" + {k1!r}*{reduced}^3" if k1 else ""
    if math.isclose(gap, 0.0) and not zone and not sides:
        return f"{k0!r}*{name}" + (f" + {k1!r}*{name}^3" if k1 else "")
    return f"sign({name})*({slope}*{reduced}{cubic})"
