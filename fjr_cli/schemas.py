"""JSON Schemas of every JSON file of the product: `python -m fjr_cli.schemas docs/schemas`."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

from pydantic import BaseModel

from bla_analyzer.fit.fit_types import Fit
from bla_analyzer.results.result import Result
from fjr_bringup.rehearsal.result import Rehearsal
from fjr_bringup.replay.comparison import ReplayResult
from fjr_compare.result import Comparison
from fjr_export.result import Export
from fjr_interface.experiment import Experiment
from fjr_validation.blind.check_documents import Manifest, Unsealed
from fjr_validation.blind.score import Scores
from fjr_validation.paper.reproduction import PaperResults
from gap_diagnosis.foresight.foreseen import Foresight
from gap_diagnosis.outcome.diagnosis import Diagnosis

DIALECT = "https://json-schema.org/draft/2020-12/schema"
DOCUMENTS: dict[str, type[BaseModel]] = {
    "blind": Manifest,
    "compare": Comparison,
    "diagnosis": Diagnosis,
    "experiment": Experiment,
    "fit": Fit,
    "export": Export,
    "paper_results": PaperResults,
    "rehearsal": Rehearsal,
    "plan": Foresight,
    "replay": ReplayResult,
    "result": Result,
    "scores": Scores,
    "unsealed": Unsealed,
}
"""What is written as JSON, by the name of its schema."""


def schemas() -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each schema file."""
    for name, model in DOCUMENTS.items():
        schema = model.model_json_schema(mode="serialization")
        text = json.dumps({"$schema": DIALECT, **schema}, indent=1, ensure_ascii=False)
        yield f"{name}.schema.json", text + "\n"


def write_schemas(folder: Path) -> None:
    """Write all schemas into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in schemas():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_schemas(Path(sys.argv[1]))
