"""Independent computations on all cores or on a Dask cluster, each kept on disk when it is done.

A task is a function of this package with plain parameters; its result is a dict of arrays. The file
that keeps it is named by a digest of function, parameters and the sources of the product, so that
a run that was interrupted goes on, and nothing stale is ever taken up.
"""

from __future__ import annotations

import contextlib
import hashlib
import inspect
import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fjr_interface.errors import InputError
from fjr_interface.installed import sources

from .cores import worker_count, worker_pool

Arrays = dict[str, np.ndarray]
Report = Callable[[int, int, str], None]
"""Called after each task with (done, all, name of the task)."""

_PACKAGES = ("excitation_node", "controller_node", "fjr_sim_node", "bla_analyzer")
"""What every computation rests on, beside the module of its own function."""
_CONNECT_S = "20s"


@dataclass(frozen=True)
class Task:
    """One computation.

    Attributes:
        name: unique name, also of its file.
        function: importable function; it returns arrays by name.
        parameters: keyword arguments of plain numbers, texts, lists and dicts.
    """

    name: str
    function: Callable[..., Mapping[str, Any]]
    parameters: Mapping[str, Any]

    def file(self, folder: Path) -> Path:
        """Return where the result is kept."""
        module = self.function.__module__
        code = [_physics(), inspect.getsource(sys.modules[module])]
        what = [module, self.function.__qualname__, self.parameters, code]
        digest = hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()[:16]
        return folder / f"{self.name}-{digest}.npz"


@cache
def _physics() -> str:
    digest = hashlib.sha256()
    for source in sources(_PACKAGES):
        digest.update(source.read_bytes())
    return digest.hexdigest()


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
    for task, result in _computed(pending, workers, scheduler):
        _save(task.file(folder), result)
        results[task.name] = _load(task.file(folder))
        done += 1
        if report:
            report(done, len(tasks), task.name)
    return {name: result for name, result in results.items() if result is not None}


def _computed(
    pending: Sequence[Task], workers: int | None, scheduler: str | None
) -> Iterator[tuple[Task, Mapping[str, Any]]]:
    if scheduler and pending:
        return _on_cluster(pending, scheduler)
    count = worker_count(workers, len(pending))
    if count > 1:
        return _on_cores(pending, count)
    return ((task, task.function(**task.parameters)) for task in pending)


def _on_cores(pending: Sequence[Task], count: int) -> Iterator[tuple[Task, Mapping[str, Any]]]:
    with worker_pool(count) as pool:
        futures = {pool.submit(task.function, **task.parameters): task for task in pending}
        for future in as_completed(futures):
            yield futures[future], future.result()


def _on_cluster(
    pending: Sequence[Task], scheduler: str
) -> Iterator[tuple[Task, Mapping[str, Any]]]:
    from distributed import Client
    from distributed import as_completed as completed

    try:
        client = Client(scheduler, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"No Dask scheduler answers at {scheduler} ({error}); start one with dask "
            f"scheduler, or "
            "leave --dask out."
        ) from None
    with client:
        futures = {
            client.submit(task.function, **task.parameters, key=task.name, pure=False): task
            for task in pending
        }
        try:
            for future in completed(list(futures), loop=client.loop):
                yield futures[future], future.result()
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
    temporary = file.with_suffix(f".{os.getpid()}.tmp")
    with temporary.open("wb") as out:
        arrays: dict[str, Any] = {name: np.asarray(value) for name, value in result.items()}
        np.savez(out, **arrays)
    temporary.replace(file)
