"""Making a case in a process of its own, which no method shares."""

from __future__ import annotations

from pathlib import Path

from .answers import World
from .seal import sealed_line
from .worlds import make_case


def make_sealed(
    case: str, folder: Path, world: World, number: int, seed: int, key: bytes
) -> dict[str, str]:
    """Write bags and datasheet of a case into a folder; return its sealed answer."""
    answer = make_case(seed, number, world, folder, open_answer=False)
    return sealed_line(case, answer.to_json(), key)
