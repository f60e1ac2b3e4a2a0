"""The outcome of an export: `export.json`, schema fjr_rig/export/1."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fjr_kit.result_types import Document, Number, OptionalNumber, ResultModel, Unit

from .treatments import Kind, Target


class EffectExport(ResultModel):
    """What became of one effect that is on, or of a part of the bare joint.

    Attributes:
        effect: its identifier; for the bare joint the names of its parameters.
        kind: native, equivalent, or left_out.
        how: by what, or why not.
    """

    effect: str
    kind: Kind | Literal["left_out"]
    how: str


class RecordReplay(ResultModel):
    """One recorded run, played by the export and by this product's simulation in the same loop.

    Attributes:
        record: name of the bag.
        held_out: whether it is one that the fit of a diagnosis does not see.
        loop: closed: the recorded reference and controller; observed: the recorded torque, and an
            observer that holds the motion to the recorded position.
        nrms_record: rms of exported minus recorded motor position, over the rms of the recorded
            one about its mean; None where the motion diverges.
        nrms_simulation: rms of exported minus simulated position over that of the simulated one.
        simulation_nrms_record: as nrms_record, of this product's simulation.
        seconds: length of the run.
    """

    record: str
    held_out: bool
    loop: Literal["closed", "observed"]
    nrms_record: OptionalNumber
    nrms_simulation: OptionalNumber
    simulation_nrms_record: OptionalNumber
    seconds: Annotated[Number, Unit("s")]


class Export(Document):
    """What was exported, how, and how far it is from the record and from our simulation.

    Attributes:
        target: mjcf, urdf, control or simscape-m.
        source: the parameter file.
        file: name of the exported file.
        version: the target's version that played the records; None where it was not run.
        sample_rate_hz: rate at which the export is to be commanded.
        time_step_s: time step that it asks for; None where the target has none.
        effects: what became of each effect that is on, bare joint first.
        replays: the recorded runs that were played.
        notes: sentences that a reader must see.
    """

    schema_name: Literal["fjr_rig/export/1"] = Field("fjr_rig/export/1", alias="schema")
    target: Target
    source: str
    file: str
    version: str | None
    sample_rate_hz: Annotated[float, Unit("Hz")]
    time_step_s: Annotated[float | None, Unit("s")]
    effects: list[EffectExport] = Field(default_factory=list)
    replays: list[RecordReplay] = Field(default_factory=list)
    notes: list[str] = Field(default_factory=list)
