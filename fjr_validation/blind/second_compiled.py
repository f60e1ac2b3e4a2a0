"""Compilation of the second plant: apart from the simulated rig, with a cache of its own."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

_CONFIG: Any = numba.config


def _cache_folder() -> str:
    """Return a folder named by a digest of all sources of the second plant: never stale."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.glob("second_*.py")):
        digest.update(source.read_bytes())
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return str(base / "fjr_rig" / f"second_{digest.hexdigest()[:16]}")


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile an entry point, cached."""
    before = _CONFIG.CACHE_DIR
    _CONFIG.CACHE_DIR = _cache_folder()
    try:
        return numba.njit(nogil=True, cache=True)(function)
    finally:
        _CONFIG.CACHE_DIR = before


part = numba.njit(nogil=True, forceinline=True)
"""Decorates what is compiled into an entry point."""
