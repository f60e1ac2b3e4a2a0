"""Seals answers: encrypted under a key kept elsewhere, committed to by their digest.

What is sealed cannot be read without the key, and cannot be changed without being found out: the
SHA-256 of each answer, made unguessable by a random salt inside it, is published before any
diagnosis runs. The cipher is a keyed SHAKE-256 stream with an HMAC over nonce and text.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import os
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fjr_kit.errors import InputError

_NONCE, _TAG = 16, 32


def digest(data: bytes) -> str:
    """Return the SHA-256 of bytes, in hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()


def salted(answer: dict[str, Any]) -> bytes:
    """Return an answer as JSON bytes with a random salt."""
    return json.dumps({"salt": secrets.token_hex(16), **answer}, sort_keys=True).encode()


def sealed_line(case: str, answer: dict[str, Any], key: bytes) -> dict[str, str]:
    """Return what is written down of an answer before any method sees the case."""
    text = salted(answer)
    sealed = base64.b64encode(encrypt(text, key)).decode()
    return {"case": case, "sha256": digest(text), "sealed": sealed}


def opened_line(line: Mapping[str, str], key: bytes) -> dict[str, Any]:
    """Return the answer of a sealed line; raise InputError if it is not what was sealed."""
    text = decrypt(base64.b64decode(line["sealed"]), key, f"The answer of {line['case']}")
    if digest(text) != line["sha256"]:
        raise InputError(
            f"The answer of {line['case']} is not what was committed to; begin a new check."
        )
    answer = json.loads(text)
    answer.pop("salt")
    return {"case": line["case"], **answer}


def encrypt(data: bytes, key: bytes) -> bytes:
    """Return nonce, tag and encrypted data."""
    nonce = secrets.token_bytes(_NONCE)
    text = _mixed(data, key, nonce)
    return nonce + _tag(nonce + text, key) + text


def decrypt(sealed: bytes, key: bytes, source: str) -> bytes:
    """Return what was encrypted; raise InputError naming `source` if it was changed."""
    nonce, tag, text = sealed[:_NONCE], sealed[_NONCE : _NONCE + _TAG], sealed[_NONCE + _TAG :]
    if not hmac.compare_digest(tag, _tag(nonce + text, key)):
        raise InputError(
            f"{source} does not open with the key of this blind check; it was changed."
        )
    return _mixed(text, key, nonce)


def _mixed(data: bytes, key: bytes, nonce: bytes) -> bytes:
    stream = hashlib.shake_256(b"stream" + key + nonce).digest(len(data))
    return bytes(a ^ b for a, b in zip(data, stream, strict=True))


def _tag(data: bytes, key: bytes) -> bytes:
    return hmac.new(key, b"tag" + data, hashlib.sha256).digest()


@dataclass(frozen=True)
class Secret:
    """What the check keeps from the diagnosis: the key of the seals and the seed of the cases."""

    key: bytes
    seed: int

    @classmethod
    def draw(cls, seed: int | None) -> Secret:
        """Return a new secret; without a seed nobody knows it until the answers are unsealed."""
        return cls(secrets.token_bytes(32), secrets.randbits(62) if seed is None else seed)

    @classmethod
    def load(cls, check: str) -> Secret:
        """Return the secret of a check; raise InputError if this machine does not hold it."""
        path = _secret_file(check)
        try:
            values = json.loads(path.read_text())
        except (OSError, ValueError):
            raise InputError(
                f"{path}, the key of this blind check, cannot be read; go on where it was begun."
            ) from None
        return cls(bytes.fromhex(values["key"]), values["seed"])

    def save(self, check: str) -> None:
        """Keep the secret, readable by its owner only, outside the folder of the check."""
        path = _secret_file(check)
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(descriptor, "w") as file:
            json.dump({"key": self.key.hex(), "seed": self.seed}, file)


def _secret_file(check: str) -> Path:
    base = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state")
    return base / "fjr_rig" / "blind" / f"{check}.json"
