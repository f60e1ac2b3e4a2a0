"""How the bags of an experiment folder are called."""

from __future__ import annotations

from pathlib import Path


def bag_folder(folder: Path, level: int, realization: int) -> Path:
    """Return the bag of one realization in an experiment folder; levels, realizations from 0."""
    return folder / f"level_{level}_realization_{realization:03d}"
