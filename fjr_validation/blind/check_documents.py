"""The documents of a blind check: what it is, and what was unsealed."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from fjr_kit.result_types import Document


class Manifest(Document):
    """What `blind.json` holds: what a check is; see `BlindCheck`."""

    schema_name: Literal["fjr_rig/blind/2"] = Field("fjr_rig/blind/2", alias="schema")
    check: str
    cases: dict[str, int]
    methods: tuple[str, ...]
    frozen: str
    version: str


class Unsealed(Document):
    """What `unsealed.json` holds."""

    schema_name: Literal["fjr_rig/unsealed/1"] = Field("fjr_rig/unsealed/1", alias="schema")
    seed: int
    key: str
    verdicts_sha256: str
    finished: bool
