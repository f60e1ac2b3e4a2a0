"""What the report shows of any diagnosis, of steady periods or of records."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from ..model.rig_model import Model
from ..outcome.cause import LEAST_PRESENT
from ..outcome.cause_words import (
    choice_sentences,
    evidence_sentences,
    remainder_sentences,
    share_sentences,
    summaries,
)
from ..outcome.diagnosis import Diagnosis
from ..outcome.verdict_words import HELD_OUT, action, closed, doubt, headline, meaning
from .gap_tables import causes, contenders
from .waterfall import height, waterfall_plot


def outcome_values(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the values of `gap_page.html`, but for lead and plots."""
    return {
        "diagnosis": diagnosis,
        "good": diagnosis.verdict in ("no_gap", "parameters_only", "effect"),
        "headline": headline(diagnosis),
        "meaning": meaning(diagnosis),
        "closed": closed(diagnosis),
        "action": action(diagnosis),
        "doubt": doubt(diagnosis),
        "summaries": summaries(diagnosis),
        "data": HELD_OUT[diagnosis.reported_on],
        "waterfall_px": height(diagnosis) if waterfall_plot(diagnosis) else 0,
        "causes": causes(diagnosis),
        "contenders": contenders(diagnosis),
        "choice": choice_sentences(diagnosis),
        "shares": share_sentences(diagnosis),
        "causes_caption": caption(diagnosis),
        "remainder": remainder_sentences(diagnosis),
        "evidence": evidence_sentences(diagnosis.evidence) if diagnosis.evidence else [],
    }


def caption(diagnosis: Diagnosis) -> str:
    """Return what stands over the table of causes."""
    if not any(cause.where for cause in diagnosis.causes):
        return "Named causes."
    if all(cause.present >= LEAST_PRESENT for cause in diagnosis.causes):
        return "Causes that passed every test, greatest share first."
    return (
        f"Causes, greatest share first. What is present at less than {LEAST_PRESENT:.0%} did not "
        "pass every test; it stays since others fail without it, or since every joint has it."
    )


def outcome_plots(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the plots of `gap_page.html` by their places."""
    plot = waterfall_plot(diagnosis)
    return {} if plot is None else {"waterfall": plot}


def origin(
    source: str, controller: dict | None, nominal: Model, provenance: Mapping[str, str]
) -> dict[str, str]:
    """Return where the numbers come from, by name: folder, versions, nominal, controller."""
    values = ", ".join(f"{k} {v:.6g}" for k, v in nominal.plant.items())
    described = json.dumps(controller, default=str)
    return {"folder": source, **provenance, "nominal": values, "controller": described}
