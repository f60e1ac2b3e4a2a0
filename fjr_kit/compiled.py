"""How the numerical kernels are compiled: one cache for each state of their sources.

numba invalidates a cached function when its own file changes, not when a function that it calls
or an option of the compiler does; a cache folder named by a digest of all kernel sources and of
this file can never be stale. What several processes need at once one of them compiles, while the
others wait and read it from there.
"""

from __future__ import annotations

import fcntl
import functools
import hashlib
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numba
from numba.core.compiler_lock import global_compiler_lock

from .installed import sources

_KERNEL_PACKAGES = ("controller_node", "fjr_sim_node")


def _cache_folder() -> Path:
    digest = hashlib.sha256(numba.__version__.encode())
    for source in (Path(__file__), *sources(_KERNEL_PACKAGES)):
        digest.update(source.read_bytes())
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "fjr_rig" / digest.hexdigest()[:16]


if "NUMBA_CACHE_DIR" not in os.environ:
    numba.config.CACHE_DIR = str(_cache_folder())  # type: ignore[attr-defined]

# The kernels allocate nothing. Without Numba's runtime no call counts references to its arrays,
# which took more than half of the time of a rig with effects; a kernel that allocates is refused.
_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "_nrt": False}

_held: set[str] = set()
"""Kernels that this process compiles, each for the one that called it."""


def _kernel(**options: Any) -> Callable[[Callable], Any]:
    """Return the decorator of kernels with more options of the compiler."""
    compiled = numba.njit(**_OPTIONS, **options)

    def decorated(function: Callable) -> Any:
        kernel = compiled(function)
        name = hashlib.sha256(f"{function.__module__}.{function.__qualname__}".encode())
        kernel.compile = _alone(kernel.compile, name.hexdigest()[:16])
        return kernel

    return decorated


def _alone(compile_: Callable, name: str) -> Callable:
    """Let one process at a time read a kernel from the cache, or compile it and write it there."""

    @functools.wraps(compile_)
    def waiting(signature: Any) -> Any:
        with global_compiler_lock, _lock(name):  # in this order, for other threads of the process
            return compile_(signature)

    return waiting


@contextmanager
def _lock(name: str) -> Iterator[None]:
    """Hold a lock between processes; none where the cache cannot be written.

    No kernel calls itself, so that no two processes wait for each other.
    """
    folder = Path(str(numba.config.CACHE_DIR)) / "locks"  # type: ignore[attr-defined]
    if name in _held:
        yield
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / name).open("w")
    except OSError:
        yield
        return
    with file:
        with suppress(OSError):  # a file system without locks
            fcntl.flock(file, fcntl.LOCK_EX)
        _held.add(name)
        try:
            yield
        finally:
            _held.discard(name)


jit = _kernel()
inlined = _kernel(forceinline=True)
