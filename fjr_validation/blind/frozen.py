"""What is frozen before a check that counts: how cases are made, and how verdicts are scored."""

from __future__ import annotations

import hashlib
from pathlib import Path

from fjr_kit import showing

FROZEN: tuple[str, ...] = (
    "answers", "causes", "claims", "draw", "excitations", "outcome", "remainders", "rigs", "score",
    "second_compiled", "second_laws", "second_plant", "second_simulation", "stage", "visibility",
    "worlds",
)  # fmt: skip
"""Modules of this package that decide what a case is and what a verdict on it is worth; what
`visibility` takes from the kit, `showing`, counts as well."""


def frozen_digest() -> str:
    """Return the SHA-256 of the sources of FROZEN, in hexadecimal digits."""
    found = hashlib.sha256()
    sources = {name: Path(__file__).with_name(f"{name}.py") for name in FROZEN}
    for name, file in {**sources, "showing": Path(showing.__file__)}.items():
        source = file.read_bytes()
        found.update(f"{name} {len(source)}\n".encode() + source)
    return found.hexdigest()
