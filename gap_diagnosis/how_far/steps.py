"""Causes and steps of a diagnosis by steady periods, from its verdict and held-out gap."""

from __future__ import annotations

from collections.abc import Mapping

from fjr_records.periodic import RecordedExperiment

from ..outcome.diagnosis import Cause, Diagnosis, EvidenceKind, Gap, Gaps, Stage, Step


def evidence_kind(
    recorded: RecordedExperiment, *, known_noise: bool, held_out: bool
) -> EvidenceKind:
    """Return what a diagnosis by steady periods rests on."""
    return EvidenceKind(
        noise="repeats" if known_noise else "none",
        reported_on="records" if held_out else "none",
        controller="known" if recorded.repeatable else "unknown",
        excitation="periodic",
    )


def steps(gaps: Gaps, named: list[str]) -> list[Step]:
    """Return the gap from step to step; all named effects are one step, fitted together."""
    found = [_step(gaps.nominal, "nominal"), _step(gaps.refit, "refit")]
    if named:
        found.append(_step(gaps.explained, "cause", " + ".join(named)))
    return found


def _step(gap: Gap | None, stage: Stage, added: str | None = None) -> Step:
    return Step(
        added=added,
        stage=stage,
        nrmse_position=None if gap is None else gap.nrmse_position,
        nrmse_torque=None if gap is None else gap.nrmse_torque,
        chi2_per_dof=None if gap is None else gap.chi2_per_dof,
    )


def causes(diagnosis: Diagnosis, present: Mapping[str, float]) -> list[Cause]:
    """Return the named effects as causes; the share of one alone is that of the gap it closes.

    Args:
        diagnosis: without causes.
        present: how surely each named effect is there.
    """
    figures = diagnosis.gap_figures
    alone = len(diagnosis.effects) == 1 and figures is not None
    return [
        Cause(
            effect=effect,
            others=members[1:],
            present=present[effect],
            share=figures.position.closed if alone and figures is not None else None,
            parameters={
                name: estimate
                for name, estimate in diagnosis.parameters.items()
                if name.startswith(f"{effect}.")
            },
        )
        for effect, members in zip(diagnosis.effects, diagnosis.equivalent, strict=True)
    ]
