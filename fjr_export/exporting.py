"""From a parameter file to a file of a target, `export.json` beside it, and its replays."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from fjr_interface.bags.reader import LINEAR_AXIS
from fjr_interface.bags.signals import DEFAULT, SignalMap
from fjr_kit.atomic import result_folder
from fjr_kit.telling import Progress

from .joint import Joint, read_joint
from .linear import control_script, linear_joint
from .mjcf import mujoco_model
from .replay import Run, Stepped, compared, motions, read_runs, runs_of
from .result import EffectExport, Export
from .simscape import COMPONENT, component, matlab_script
from .targets import ControlJoint, MuJoCoJoint
from .treatments import TITLES, Target, refuse_inexpressible, treated
from .urdf import urdf

RESULT_FILE = "export.json"
OWN_FILES = (RESULT_FILE, "joint.xml", "joint.urdf", "joint.py", "joint.m", f"{COMPONENT}.ssc")
"""What an earlier export may have left in a folder."""


@dataclass(frozen=True)
class _Made:
    """Files by name, the main one first, and what plays them."""

    files: dict[str, str]
    target: Callable[[], Stepped] | None
    time_step_s: float | None = None
    notes: tuple[str, ...] = ()


def export(
    source: Path | str,
    target: Target,
    out: Path | str,
    *,
    without: Collection[str] = (),
    linear: bool = False,
    replay: Path | None = None,
    signal_map: SignalMap = DEFAULT,
    progress: Progress = lambda _: None,
) -> Export:
    """Write the joint of a parameter file for another tool, and play recorded runs in it.

    Args:
        source: ROS parameter file with values below /rig/simulator, such as `updated.yaml`.
        target: the tool.
        out: folder of the file and of `export.json`; files of an earlier export are replaced.
        without: effects to leave out.
        linear: whether the joint slides; of replayed bags that say so it does in any case.
        replay: bags, or the diagnosis beside them, whose held-out runs are played; None for none.
        signal_map: which topics and fields of the bags are the signals.
        progress: told what is done.

    Raises:
        InputError: a bad file, an effect that the target cannot express, a target that must play
            and is not installed, bad bags, or `out` cannot be written.
    """
    joint = read_joint(source, without, linear=linear)
    refuse_inexpressible(joint, target)
    runs: list[Run] = []
    if replay is not None:
        progress("reading bags")
        records = read_runs(replay, signal_map)
        joint = replace(
            joint, sample_rate_hz=records.sample_rate_hz, linear=linear or records.linear
        )
        runs = runs_of(joint, records)
    made = _MAKERS[target](joint, runs)
    player = made.target() if runs and made.target else None
    result = Export(
        target=target,
        source=str(source),
        file=next(iter(made.files)),
        version=getattr(player, "version", None),
        sample_rate_hz=joint.sample_rate_hz,
        time_step_s=made.time_step_s,
        effects=list(_told(joint, target)),
        replays=list(compared(joint, runs, player, progress)) if player else [],
        notes=[*made.notes, *_notes(joint, target, runs, player)],
    )
    with result_folder(Path(out), OWN_FILES) as folder:
        for name, text in made.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        (folder / RESULT_FILE).write_text(result.to_json(), encoding="utf-8")
    return result


def _mjcf(joint: Joint, runs: Collection[Run]) -> _Made:
    model = mujoco_model(joint)
    return _Made(
        {"joint.xml": model.xml},
        lambda: MuJoCoJoint.of_mjcf(model),
        model.time_step_s,
        model.notes,
    )


def _urdf(joint: Joint, runs: Collection[Run]) -> _Made:
    text = urdf(joint)
    return _Made({"joint.urdf": text}, lambda: MuJoCoJoint.of_urdf(text, joint))


def _control(joint: Joint, runs: Collection[Run]) -> _Made:
    linear = linear_joint(joint, motions(runs))
    script = control_script(joint, linear)
    gains = "; ".join(f"{name} = {value:.4g}" for name, value in linear.equivalents.items())
    notes = (f"Gains that fit best over the replayed motion: {gains}.",) if gains else ()
    return _Made({"joint.py": script}, lambda: ControlJoint(script), notes=notes)


def _simscape(joint: Joint, runs: Collection[Run]) -> _Made:
    files = {"joint.m": matlab_script(joint), f"{COMPONENT}.ssc": component(joint)}
    return _Made(files, None)


_MAKERS: dict[Target, Callable[[Joint, Collection[Run]], _Made]] = {
    "mjcf": _mjcf,
    "urdf": _urdf,
    "control": _control,
    "simscape-m": _simscape,
}

_RIGID = ("equivalent", "none: motor and link are one body, as below the resonance")
_BARE: dict[Target, dict[str, tuple[str, str]]] = {
    "mjcf": {
        "fs, fsm": ("native", "frictionloss; it yields by less than a time step"),
        "k0": ("native", "stiffness of the tendon"),
        "k1": ("native", "third coefficient of that stiffness"),
    },
    "urdf": {
        "fs, fsm": ("equivalent", "friction, of motor and link together"),
        "k0": _RIGID,
        "k1": _RIGID,
    },
    "control": {
        "fs, fsm": ("equivalent", "viscous friction: the gain that fits best over the motion"),
        "k0": ("native", "stiffness"),
        "k1": ("equivalent", "stiffness: the gain that fits best over the motion"),
    },
    "simscape-m": {
        "fs, fsm": ("equivalent", "level that is smooth about zero velocity"),
        "k0": ("native", "its equation"),
        "k1": ("native", "its equation"),
    },
}
"""What becomes of the parts of the bare joint, by parameters; inertias and viscous friction are
native everywhere."""


def _told(joint: Joint, target: Target) -> Iterator[EffectExport]:
    kind = "equivalent" if target == "urdf" and not joint.one_body else "native"
    yield EffectExport(effect="jm, j", kind=kind, how="inertia")  # type: ignore[arg-type]
    yield EffectExport(effect="fv, fvm", kind=kind, how="viscous friction")  # type: ignore[arg-type]
    for names, (how_well, how) in _BARE[target].items():
        spring = names.startswith("k")
        if any(joint.body[name] for name in names.split(", ")) and not (spring and joint.one_body):
            yield EffectExport(effect=names, kind=how_well, how=how)  # type: ignore[arg-type]
    for identifier, treatment in treated(joint, target):
        yield EffectExport(effect=identifier, kind=treatment.kind, how=treatment.how)
    for identifier in sorted(joint.without):
        yield EffectExport(effect=identifier, kind="left_out", how="as asked")


def _notes(
    joint: Joint, target: Target, runs: Collection[Run], player: Stepped | None
) -> Iterator[str]:
    if joint.linear and target in ("control", "simscape-m"):
        yield LINEAR_AXIS
    if joint.has_encoder_noise:
        yield "The encoder noise of the parameter file is not exported."
    if target == "simscape-m":
        yield "MATLAB was not run: neither component nor script has been read by it."
        if runs:
            yield "No run was played, since Simscape does not run here."
    elif player is None:
        yield f"No run was played, so the error of {TITLES[target]} is not known; give --replay."
    if runs and not all(run.held_out for run in runs):
        yield "Each level has one run here, so none is held out from a diagnosis of these bags."
