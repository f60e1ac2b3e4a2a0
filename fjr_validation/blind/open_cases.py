"""Cases with their answers beside the bags, for development.

`python -m fjr_validation.blind.open_cases --world open --seed 201 --numbers 0-4 --out FOLDER`
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from .answers import WORLDS
from .worlds import make_case


def _numbers(text: str) -> Iterator[int]:
    first, _, last = text.partition("-")
    yield from range(int(first), int(last or first) + 1)


def main() -> None:
    """Make cases with open answers."""
    parser = argparse.ArgumentParser(description="Make cases of a world with open answers.")
    parser.add_argument("--world", choices=WORLDS, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--numbers", default="0-4", help="such as 3 or 0-9")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    for number in _numbers(given.numbers):
        folder = given.out / f"{given.world}_{given.seed}_{number:04d}"
        answer = make_case(given.seed, number, given.world, folder)
        names = " + ".join(cause.name for cause in answer.causes) or "no cause"
        print(f"{folder}: {answer.kind}, {answer.excitation}: {names}", flush=True)


if __name__ == "__main__":
    main()
