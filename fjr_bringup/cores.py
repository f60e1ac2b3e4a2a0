"""Processes that work on all cores for a command, and go when it goes."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager

from .processes import die_with


def worker_count(wanted: int | None, jobs: int) -> int:
    """Return how many processes work on so many jobs; None wants one on each core."""
    return min(wanted or len(os.sched_getaffinity(0)), jobs)


@contextmanager
def worker_pool(count: int) -> Iterator[ProcessPoolExecutor]:
    """Lend a pool; if the body raises, what has begun is finished and the rest is cancelled."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(count, context, _begin_worker, (os.getpid(),)) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _begin_worker(parent: int) -> None:
    """Leave Ctrl-C to the parent, which lets the work under way be finished; end with it."""
    die_with(parent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
