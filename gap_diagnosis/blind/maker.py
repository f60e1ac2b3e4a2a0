"""The case-making process: `python -m gap_diagnosis.blind.maker`, apart from every diagnosis.

It reads its order as JSON from stdin (`folder`, `cases`, `seed`, `key`), so that neither seed nor
key is among its arguments or in its environment, makes the cases that are missing on all cores, and
prints the name of each when it is there. Only bags and sealed answers are written.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import shutil
import signal
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from .cases import CaseMaker, Plan, plans
from .files import case_folder, case_name, sealed_file, write_bytes
from .seal import encrypt, salted


def make_case(folder: Path, seed: int, index: int, plan: Plan, key: bytes) -> str:
    """Make one case: bags in a hidden folder, sealed answer, then the folder in its place."""
    place = case_folder(folder, index)
    hidden = place.with_name(f".{place.name}.partial")
    shutil.rmtree(hidden, ignore_errors=True)
    hidden.mkdir(parents=True)
    answer = CaseMaker(seed, index, plan).make(hidden)
    write_bytes(sealed_file(folder, index), encrypt(salted(answer.to_json()), key))
    hidden.rename(place)
    return case_name(index)


def make_missing(folder: Path, count: int, seed: int, key: bytes) -> None:
    """Make the cases that a folder lacks; print the name of each."""
    missing = [
        (index, plan)
        for index, plan in enumerate(plans(count, seed))
        if not case_folder(folder, index).exists()
    ]
    workers = min(len(os.sched_getaffinity(0)), len(missing))
    if not workers:
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, _end_at_once) as pool:
        futures = [
            pool.submit(make_case, folder, seed, index, plan, key) for index, plan in missing
        ]
        try:
            for future in as_completed(futures):
                print(future.result(), flush=True)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _end_at_once() -> None:
    """Let Ctrl-C end a worker without a word: what it leaves is hidden and made again."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


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
