"""Independent computations on all cores or on a Dask cluster, kept on disk where that is asked.

`computed` yields the results of tasks as they are done. `run_tasks` also keeps them: the result of
such a task is a dict of arrays, and the file that keeps it is named by a digest of the function,
its parameters and the sources of the product that the function's module imports, transitively. So a
run that was interrupted goes on, and what an older version computed is computed again.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .atomic import whole_file
from .errors import InputError, needing
from .imports import digest_of
from .worker_pool import worker_count, worker_pool

Arrays = dict[str, np.ndarray]
Report = Callable[[int, int, str], None]
"""Called after each task with (done, all, name of the task)."""

_CONNECT_S = "20s"


@dataclass(frozen=True)
class Task:
    """One computation.

    Attributes:
        name: unique name, also of its file.
        function: importable function; for `run_tasks` it returns arrays by name.
        parameters: its keyword arguments; for `run_tasks` plain numbers, texts, lists and dicts.
    """

    name: str
    function: Callable[..., Any]
    parameters: Mapping[str, Any]

    def file(self, folder: Path) -> Path:
        """Return where the result is kept."""
        module = self.function.__module__
        what = [module, self.function.__qualname__, self.parameters, digest_of(module)]
        digest = hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()[:16]
        return folder / f"{self.name}-{digest}.npz"


def run_tasks(
    tasks: Sequence[Task],
    folder: Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    report: Report | None = None,
) -> dict[str, Arrays]:
    """Run what the folder lacks of the tasks; return all results by name.

    Args:
        tasks: with different names.
        folder: where results are kept; made if it is absent.
        workers: processes; None for one on each core.
        scheduler: address of a Dask scheduler, such as tcp://host:8786, whose workers have this
            package installed; None for this machine.
        report: called after each task.

    Raises:
        InputError: the folder cannot be made, no scheduler answers, or a task refuses its input.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder} cannot be made: {error.strerror}.") from None
    results = {task.name: _load(task.file(folder)) for task in tasks}
    pending = [task for task in tasks if results[task.name] is None]
    done = len(tasks) - len(pending)
    if report and done:
        report(done, len(tasks), "taken up from before")
    for task, result in computed(pending, workers=workers, scheduler=scheduler):
        _save(task.file(folder), result)
        results[task.name] = _load(task.file(folder))
        done += 1
        if report:
            report(done, len(tasks), task.name)
    return {name: result for name, result in results.items() if result is not None}


def computed(
    tasks: Sequence[Task],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
) -> Iterator[tuple[Task, Any]]:
    """Yield each task with its result as it is done; if the caller gives up, the rest is dropped.

    Args:
        tasks: with different names; nothing is kept on disk.
        workers: processes on this machine; None for one on each core.
        scheduler: address of a Dask scheduler; None for this machine.

    Raises:
        InputError: no scheduler answers, Dask is not installed, or a task refuses its input.
    """
    if not tasks:
        return
    if scheduler:
        yield from _on_cluster(tasks, scheduler)
        return
    count = worker_count(workers, len(tasks))
    if count == 1:
        yield from ((task, task.function(**task.parameters)) for task in tasks)
        return
    with worker_pool(count, finish=False) as pool:
        futures = {pool.submit(task.function, **task.parameters): task for task in tasks}
        for future in as_completed(futures):
            yield futures[future], future.result()


@contextmanager
def dask_client(scheduler: str) -> Iterator[Any]:
    """Lend a `distributed.Client` of a scheduler's address.

    Raises:
        InputError: Dask is not installed, or no scheduler answers.
    """
    with needing("Dask", "install fjr-rig[dask], or leave --dask out"):
        from distributed import Client
    try:
        client = Client(scheduler, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"No Dask scheduler answers at {scheduler} ({error}); start one with `dask scheduler`, "
            "or leave --dask out."
        ) from None
    with client:
        yield client


def _on_cluster(tasks: Sequence[Task], scheduler: str) -> Iterator[tuple[Task, Any]]:
    with dask_client(scheduler) as client:
        from distributed import as_completed as completed

        futures = {
            client.submit(task.function, **task.parameters, key=task.name, pure=False): task
            for task in tasks
        }
        try:
            for future in completed(list(futures), loop=client.loop):
                yield futures.pop(future), future.result()
        except BaseException:
            with contextlib.suppress(Exception):
                client.cancel(list(futures))
            raise


def _load(file: Path) -> Arrays | None:
    if not file.exists():
        return None
    try:
        with np.load(file, allow_pickle=False) as arrays:
            return dict(arrays)
    except (OSError, ValueError, EOFError):
        return None  # damaged: compute it again


def _save(file: Path, result: Mapping[str, Any]) -> None:
    arrays: dict[str, Any] = {name: np.asarray(value) for name, value in result.items()}
    with whole_file(file) as path:
        np.savez(path, **arrays)
