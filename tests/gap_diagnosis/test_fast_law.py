"""Logs of targets and angles, sampled more slowly than the law ran that made the torque."""

from pathlib import Path

import numpy as np
import pytest

from controller_node.law import law_of
from fjr_cli.import_summary import _law
from fjr_kit.errors import InputError
from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files, read_files
from fjr_records.importers.record_file import ImportOptions
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis import diagnose
from gap_diagnosis.model.rig_model import Model

FAST, STEPS = 1000.0, 10
INERTIA, COULOMB, VISCOUS = 0.02, 0.3, 0.1
GAINS = {"kind": "pd", "p": 8.0, "d": 0.4, "derivative_on": "measurement"}


def logs(folder: Path) -> list[Path]:
    """Write two runs of a joint under a law of 1 kHz, of which each tenth sample is logged."""
    model = Model({"jm": INERTIA, "fsm": COULOMB, "fvm": VISCOUS}, {})
    law = law_of(GAINS, FAST)
    files = []
    rng = np.random.default_rng(5)
    for run in range(2):
        targets = np.cumsum(rng.normal(0.0, 0.25, 2000 // STEPS))
        targets = np.repeat(targets - np.linspace(0.0, targets[-1], targets.size), STEPS)
        targets[:20] = 0.0  # new targets at 10 Hz
        played = simulate(
            np.repeat(targets, STEPS), FAST, model.plant_coefficients, law, None,
            model.effect_coefficients,
        )  # fmt: skip
        logged = played.position[::STEPS] + 1e-5 * rng.normal(size=targets.size)
        table = np.column_stack([np.arange(targets.size) * STEPS / FAST, targets, logged])
        files.append(folder / f"run_{run}.csv")
        np.savetxt(files[-1], table, delimiter=",", header="t,target,q", comments="")
    return files


def options(folder: Path, rate: str) -> ImportOptions:
    controller = folder / "pd.yaml"
    controller.write_text(f"{{kind: pd, p: 8.0, d: 0.4, derivative_on: measurement{rate}}}")
    columns = parse_map(["time=t", "reference=target", "position=q"], described=True)
    return ImportOptions(columns, controllers=(controller,))


def test_the_joint_is_found_under_a_law_that_ran_faster_than_its_log(tmp_path):
    import_files(logs(tmp_path), tmp_path / "bags", options(tmp_path, ", rate_hz: 1000"))
    found = diagnose(tmp_path / "bags", {"jm": 1.1 * INERTIA, "k0": np.inf})
    assert {"coulomb_friction", "viscous_friction"} == set(found.effects)
    assert found.parameters["jm"].value == pytest.approx(INERTIA, rel=0.03)
    sizes = {"coulomb_friction.motor_nm": COULOMB, "viscous_friction.motor_nm_s_rad": VISCOUS}
    for name, truth in sizes.items():
        size = found.parameters[name]
        assert size.value == pytest.approx(truth, rel=0.05)
        assert size.low < truth < size.high


def test_such_a_log_is_a_record_and_its_law_no_slower_than_it(tmp_path):
    files = logs(tmp_path)
    understood = read_files(files, options(tmp_path, ", rate_hz: 1000"))
    assert "runs faster than it is sampled" in str(understood.records[0].repetition)
    assert _law(dict(understood.descriptions[0].controller)).endswith("known, run at 1000 Hz")
    with pytest.raises(InputError, match=r"pd\.yaml: controller\.rate_hz is 50 Hz, but the sample"):
        read_files(files, options(tmp_path, ", rate_hz: 50"))
    with pytest.raises(InputError, match=r"controller\.between_samples: "):
        read_files(files, options(tmp_path, ", between_samples: splines"))
