"""The case-making process: `python -m fjr_validation.blind.maker`, apart from every diagnosis.

It reads its order as JSON from stdin (`folder`, `cases`, `seed`, `key`), so that neither seed nor
key is among its arguments or in its environment, makes the cases that are missing on all cores, and
prints the name of each when it is there. Only bags and sealed answers are written.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from fjr_kit.atomic import new_folder, write_whole
from fjr_kit.tasks import Task, computed

from .cases import CaseMaker, Plan, plans
from .files import case_folder, case_name, sealed_file
from .seal import encrypt, salted


def make_case(folder: Path, seed: int, index: int, plan: Plan, key: bytes) -> str:
    """Make one case: bags in a hidden folder, sealed answer, then the folder in its place."""
    sealed = sealed_file(folder, index)
    sealed.parent.mkdir(exist_ok=True)
    with new_folder(case_folder(folder, index)) as hidden:
        answer = CaseMaker(seed, index, plan).make(hidden)
        write_whole(sealed, encrypt(salted(answer.to_json()), key))
    return case_name(index)


def make_missing(folder: Path, count: int, seed: int, key: bytes) -> None:
    """Make the cases that a folder lacks; print the name of each."""
    order = {"folder": folder, "seed": seed, "key": key}
    missing = [
        Task(case_name(index), make_case, {**order, "index": index, "plan": plan})
        for index, plan in enumerate(plans(count, seed))
        if not case_folder(folder, index).exists()
    ]
    for _, name in computed(missing):
        print(name, flush=True)


def main() -> None:
    """Read the order and make the cases; Ctrl-C ends with what is finished."""
    order = json.load(sys.stdin)
    try:
        make_missing(
            Path(order["folder"]), order["cases"], order["seed"], bytes.fromhex(order["key"])
        )
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
