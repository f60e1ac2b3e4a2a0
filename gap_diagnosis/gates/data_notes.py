"""What the data of an experiment cannot say, and what to record for a stronger statement."""

from __future__ import annotations

from fjr_records.noise import ONE_PERIOD, NoiseLevels
from fjr_records.periodic import RecordedExperiment

from ..model.prediction import loses


def data_notes(recorded: RecordedExperiment, noise: NoiseLevels | None) -> list[str]:
    """Return a sentence for each thing that cannot be said with these data."""
    notes = []
    counts = [sum(r.level == level for r in recorded.realizations) for level in recorded.levels]
    if noise is None:
        notes.append(ONE_PERIOD)
    elif not noise.measurable.all():
        which = [str(v) for v, seen in zip(noise.levels, noise.measurable, strict=True) if not seen]
        shown = ", ".join(which)
        silent = f"Level {shown} shows" if len(which) == 1 else f"Levels {shown} show"
        notes.append(
            f"{silent} no noise, so significance is stated against the numerical floor of the "
            "simulation and cannot be trusted as such."
        )
    if min(counts) < 2:
        notes.append(
            "A level has one realization only: no whole run of it can be held out, so blocks of "
            "the run are, and drift between bags cannot be seen there; record two or more with "
            "other phases."
        )
    if len(counts) < 2:
        notes.append(
            "There is one level only: effects that differ by how they grow with amplitude cannot "
            "be told apart, and no amplitude can be held out; record three levels."
        )
    kinds = recorded.kinds()
    if "even" not in kinds or "odd" not in kinds:
        notes.append(
            "The grid has no free odd or even lines: distortion cannot be told from the linear "
            "response; excite an odd random grid."
        )
    if not recorded.repeatable:
        notes.append(loses(recorded))
    if recorded.experiment.transient_periods == 0:
        notes.append("No transient period was discarded; the first period may hold a transient.")
    return notes
