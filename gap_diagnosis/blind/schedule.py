"""Puts methods to cases on Dask: on all cores of this machine, or on a cluster."""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from fjr_interface.errors import InputError

from .methods import verdict

_CONNECT_S = "20s"


def verdicts(
    jobs: Sequence[tuple[str, Path]], scheduler: str | None = None, workers: int | None = None
) -> Iterator[dict[str, Any]]:
    """Yield the verdict of each job as it is done.

    Args:
        jobs: (method, folder of a case).
        scheduler: address of a Dask scheduler whose workers see the same folder and have this
            package installed; None for a cluster of processes on this machine.
        workers: processes on this machine; None for one on each core.

    Raises:
        InputError: no scheduler answers.
    """
    if not jobs:
        return
    with _client(scheduler, workers or min(len(os.sched_getaffinity(0)), len(jobs))) as client:
        from distributed import as_completed

        futures = [
            client.submit(verdict, method, folder, key=f"{method}-{folder.name}", pure=False)
            for method, folder in jobs
        ]
        try:
            for future in as_completed(futures):
                yield future.result()
                future.release()
        except BaseException:
            with contextlib.suppress(Exception):
                client.cancel(futures)
            raise


@contextlib.contextmanager
def _client(scheduler: str | None, workers: int) -> Iterator[Any]:
    from distributed import Client, LocalCluster

    if scheduler is None:
        options = {"dashboard_address": None, "memory_limit": None, "silence_logs": "CRITICAL"}
        with (
            LocalCluster(n_workers=workers, threads_per_worker=1, **options) as cluster,
            Client(cluster) as client,
        ):
            client.run(_leave_interrupts)
            yield client
        return
    try:
        client = Client(scheduler, timeout=_CONNECT_S)
    except (OSError, ValueError) as error:
        raise InputError(
            f"No Dask scheduler answers at {scheduler} ({error}); start one with `dask scheduler`, "
            "or leave --dask out."
        ) from None
    with client:
        yield client


def _leave_interrupts() -> None:
    """Leave Ctrl-C to the process that schedules."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
