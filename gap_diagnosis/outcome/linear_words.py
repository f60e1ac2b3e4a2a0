"""The outcome on a linear axis, in its units."""

from __future__ import annotations

from textwrap import wrap

from fjr_interface.bags.reader import LINEAR_AXIS
from fjr_interface.linear_axis import NAMES, as_linear

from .cause_words import pitches
from .diagnosis import Diagnosis

_WIDTH = 98


def in_linear_units(diagnosis: Diagnosis) -> Diagnosis:
    """Return a diagnosis of a linear axis whose sentences say m, N and kg; another as it is."""
    if not diagnosis.linear:
        return diagnosis
    proposed = diagnosis.next_experiment
    if proposed is not None:
        said = as_linear(proposed.description)
        proposed = proposed.model_copy(update={"description": said})
    notes = [NAMES if note == LINEAR_AXIS else as_linear(note) for note in diagnosis.notes]
    return diagnosis.model_copy(update={"notes": notes, "next_experiment": proposed})


def linear_head(diagnosis: Diagnosis) -> list[str]:
    """Return the lines above the parameters of a linear axis: what names mean, and pitches."""
    told = [f"{effect}: {said}" for effect, said in pitches(diagnosis).items()]
    return [*wrap(NAMES, _WIDTH), *told, "fjr export takes this file with --linear."]
