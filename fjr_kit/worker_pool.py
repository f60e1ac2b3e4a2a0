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
def worker_pool(count: int, *, finish: bool = True) -> Iterator[ProcessPoolExecutor]:
    """Lend a pool of so many processes.

    If the body raises, the calls that have not begun are cancelled. Those that have are finished,
    as calls that keep their own results need; if not `finish`, their processes are killed.
    """
    context = multiprocessing.get_context("spawn")
    others = set(multiprocessing.active_children())
    with ProcessPoolExecutor(count, context, _begin_worker, (os.getpid(),)) as pool:
        try:
            yield pool
        except BaseException:
            if not finish:
                for worker in set(multiprocessing.active_children()) - others:
                    worker.kill()
            pool.shutdown(cancel_futures=True)
            raise


def _begin_worker(parent: int) -> None:
    """Leave Ctrl-C to the parent, which lets the work under way be finished; end with it."""
    die_with(parent)
    for number in (signal.SIGINT, signal.SIGHUP):  # which a terminal sends to all processes in it
        signal.signal(number, signal.SIG_IGN)
