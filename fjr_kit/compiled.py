"""How the numerical kernels are compiled: one cache for each state of their sources.

numba invalidates a cached function when its own file changes, not when a function that it calls
or an option of the compiler does; a cache folder named by a digest of all kernel sources and of
this file can never be stale.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Any

import numba

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

jit = numba.njit(**_OPTIONS)
inlined = numba.njit(**_OPTIONS, forceinline=True)
