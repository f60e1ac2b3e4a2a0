"""The two real records of a motor bench that FdiTools brings, imported as bags."""

from __future__ import annotations

from pathlib import Path

import pytest
from paths import SHARED

from fjr_interface.bags.reader import audit
from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions

RECORDS = SHARED / "data" / "fditools_motorbench"
COLUMNS = parse_map(
    [
        "reference=iq_refx:1",
        "torque=iq_adx:1",
        "position=theta_mx",
        "link=-theta_my",
        "time=time:us",
    ]
)
NEEDS_RECORDS = pytest.mark.skipif(
    not RECORDS.is_dir(), reason="the motor bench records of FdiTools are not there"
)


def imported(folder: Path, record: str) -> Path:
    file = RECORDS / f"MultisineType{record}.mat"
    ((_, bag),) = import_files([file], folder / record, ImportOptions(columns=COLUMNS))
    audit(bag)
    return bag
