"""Records of four real machines, each imported by one command as its owner would write it."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from fjr_interface.bags.files import find_bags
from fjr_interface.bags.reader import BagReader, audit, read_record
from fjr_interface.experiment import Experiment, RecordDescription

SHARED = Path(os.environ.get("FJR_SHARED", Path(__file__).parents[3] / "shared")) / "data"

MACHINES = {
    "fditools_motorbench/MultisineTypeA.mat": (
        "reference=iq_refx:1,torque=iq_adx:1,position=theta_mx,link=-theta_my,time=time:us",
        1,
    ),
    "bam_xl330/*.json.gz": (
        "reference=entries.goal_position,torque=entries.load:8.06e-4,position=entries.position,"
        "time=entries.timestamp",
        16,
    ),
    "kuka_kr300/FF_?_data.mat": (
        "reference=rec.ref_pos_deg[0]:deg,torque=rec.act_torque_abs_nm[0]:256.857,"
        "position=rec.act_pos_mot_deg[0]:deg,link=rec.act_pos_se_deg[0]:deg,time=rec.time_cont",
        3,
    ),
    "laas_cogging/stopped_data.txt.gz": ("torque=Iq:1,position=Position,time=Time", 1),
    "laas_cogging/acc_current.txt.gz": ("torque=Iq:1,position=Position,time=Time", 1),
    "laas_cogging/speed_test.txt.gz": ("torque=Iq:1,position=Position,time=Time", 1),
}


@pytest.mark.parametrize("pattern", MACHINES)
def test_one_command_imports_it(tmp_path, run, pattern):
    files = sorted(SHARED.glob(pattern))
    if not files:
        pytest.skip(f"the records {pattern} are not there")
    spec, count = MACHINES[pattern]
    out = tmp_path / "out"
    done = run("import", *files, "--out", out, "--map", spec)
    assert (done.exit_code, done.stderr) == (0, "")
    bags = find_bags(out)
    assert len(bags) == count
    for bag in bags:
        audit(bag)
        description = BagReader(bag).experiment
        kind = Experiment if "motorbench" in pattern else RecordDescription
        assert isinstance(description, kind) and description.repeat_of is None
        back = read_record(bag)
        assert np.ptp(back.position) > 0 and (back.reference is None) == ("laas" in pattern)
        assert (back.link is not None) == ("link=" in spec)


def test_the_torque_of_the_servo_has_its_sign(tmp_path, run):
    files = sorted(SHARED.glob("bam_xl330/*10h28m10.json.gz"))
    if not files:
        pytest.skip("the records of the servo are not there")
    spec = MACHINES["bam_xl330/*.json.gz"][0]
    run("import", *files, "--out", tmp_path / "out", "--map", spec)
    (bag,) = find_bags(tmp_path / "out")
    back = read_record(bag)
    # Its firmware is a proportional controller, so torque goes with the control error.
    assert np.corrcoef(back.torque, back.reference - back.position)[0, 1] > 0.999
