"""Cases done side by side: each is made by one process, then looked at by another."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fjr_kit.errors import InputError
from fjr_kit.tasks import dask_client
from fjr_kit.worker_pool import worker_count, worker_pool

Call = tuple[Callable[..., Any], Mapping[str, Any]]
"""An importable function with its keyword arguments."""


@dataclass(frozen=True)
class Job:
    """One case to be done.

    Attributes:
        name: its name.
        folder: of its bags, which must lie where all workers see it.
        make: makes the bags and returns the sealed answer.
        look: returns verdicts.
    """

    name: str
    folder: Path
    make: Call
    look: Call


def finished_jobs(
    jobs: Iterator[Job],
    made: Callable[[Any], None],
    scheduler: str | None = None,
    workers: int | None = None,
) -> Iterator[tuple[Job, Any]]:
    """Yield each job with what was seen, as it is done; if the caller gives up, the rest is left.

    Args:
        jobs: taken one by one, so that no more are under way than there are workers.
        made: called with what making returned, before anybody looks at the case.
        scheduler: address of a Dask scheduler whose workers share this folder; None for processes
            on this machine.
        workers: how many cases at a time; None for one on each core.

    Raises:
        InputError: no scheduler answers, Dask is not installed, or a process died.
    """
    with _executors(scheduler, workers) as (maker, looker, count):
        making: dict[Future[Any], Job] = {}
        looking: dict[Future[Any], Job] = {}

        def begin() -> None:
            job = next(jobs, None)
            if job is not None:
                making[_submitted(maker, job.make)] = job

        for _ in range(count):
            begin()
        while making or looking:
            done, _ = wait([*making, *looking], return_when=FIRST_COMPLETED)
            for future in done:
                try:
                    result = future.result()
                except BrokenProcessPool:
                    raise InputError(
                        "A process of the check was killed, perhaps for want of memory; run the "
                        "same command again, with fewer --workers."
                    ) from None
                if future in making:
                    job = making.pop(future)
                    made(result)
                    looking[_submitted(looker, job.look)] = job
                else:
                    yield looking.pop(future), result
                    begin()


def _submitted(executor: Executor, call: Call) -> Future[Any]:
    function, arguments = call
    return executor.submit(function, **arguments)


@contextmanager
def _executors(
    scheduler: str | None, workers: int | None
) -> Iterator[tuple[Executor, Executor, int]]:
    """Lend who makes, who looks, and how many cases they do at a time."""
    if scheduler is None:
        count = worker_count(workers, 10**6)
        with ExitStack() as stack:
            maker = stack.enter_context(worker_pool(count, finish=False))
            looker = stack.enter_context(worker_pool(count, finish=False))
            yield maker, looker, count
        return
    with dask_client(scheduler) as client:
        executor = client.get_executor(pure=False)
        count = workers or max(1, sum(client.nthreads().values()))
        yield executor, executor, count
