"""Files of a blind check and their places.

OUT/blind.json             what the check is: identity, number of cases, methods, version
OUT/cases/case_000/        bags of a case
OUT/sealed/case_000.bin    its sealed answer
OUT/commitments.json       SHA-256 of each answer, before any diagnosis
OUT/verdicts/METHOD/case_000.json
OUT/verdicts.json          SHA-256 of each verdict, before any answer is unsealed
OUT/answers.json           the answers, unsealed
OUT/report/                scores, figures, report
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from fjr_kit.atomic import write_whole
from fjr_kit.errors import InputError


def case_name(index: int) -> str:
    """Return the name of a case."""
    return f"case_{index:03d}"


def case_folder(out: Path, index: int) -> Path:
    """Return the folder of a case's bags."""
    return out / "cases" / case_name(index)


def sealed_file(out: Path, index: int) -> Path:
    """Return the file of a case's sealed answer."""
    return out / "sealed" / f"{case_name(index)}.bin"


def verdict_file(out: Path, method: str, index: int) -> Path:
    """Return the file of a method's verdict on a case."""
    return out / "verdicts" / method / f"{case_name(index)}.json"


def write_json(path: Path, values: Any) -> None:
    """Write JSON as a whole or not at all, in a folder that is made if it is absent."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, json.dumps(values, indent=2) + "\n")


def read_json(path: Path) -> Any:
    """Read JSON; raise InputError if that can't be done."""
    try:
        return json.loads(path.read_text())
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}.") from None
    except ValueError:
        raise InputError(f"{path} is no JSON; remove it and run the blind check again.") from None
