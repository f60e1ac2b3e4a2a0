"""Steady periods with more than one explanation covers: causes beside a remainder are named."""

from __future__ import annotations

import numpy as np
import pytest
from gap_cases import SHORT, simulate_case

from fjr_sim_node.plant import PLANT
from gap_diagnosis.any_record import investigate
from gap_diagnosis.report.gap_output import write_diagnosis

LAG_S = 6e-4
KNOWN = ("actuator_lag", "torque_bias", "encoder_eccentricity")
"""What is looked for: the cause, and nothing like the rest of the gap."""


@pytest.fixture(scope="module")
def found():
    rig = {
        "actuator_lag.time_constant_s": LAG_S,
        "hysteresis.torque_nm": 1.5,
        "hysteresis.displacement_rad": 5e-4,
    }
    case = simulate_case(rig, seed=4, realizations=3, **SHORT)
    return investigate(case.recorded, PLANT.defaults(), effects=KNOWN)


def test_a_cause_is_named_beside_what_the_catalogue_does_not_hold(found):
    assert found.steady is not None
    diagnosis = found.diagnosis
    assert diagnosis.verdict == "partly_explained" and diagnosis.effects == ["actuator_lag"]
    size = diagnosis.causes[0].parameters["actuator_lag.time_constant_s"]
    assert size.value == pytest.approx(LAG_S, rel=0.1)
    assert diagnosis.remainder.share > 0.0


def test_each_rival_is_kept_once(found):
    """Further looks at a step that add no fit once kept those of the first look again."""
    assert found.fitted is not None
    rivals = found.fitted.found.rivals
    assert rivals
    for fits in rivals.values():
        assert len({id(fit) for fit in fits}) == len(fits) > 0


def test_it_keeps_what_only_periods_tell(found):
    notes = found.diagnosis.notes
    assert len(notes) == len(set(notes))
    assert found.diagnosis.bags.trends.keys() == {"friction", "stiffness"}
    assert found.diagnosis.evidence.noise == "repeats"
    assert found.diagnosis.evidence.excitation == "periodic"
    assert found.diagnosis.gap_figures.bla_sigma.refit.value > 0.0


def test_its_files_are_written(found, tmp_path):
    write_diagnosis(found, tmp_path)
    assert {p.name for p in tmp_path.iterdir()} >= {
        "report.html", "diagnosis.json", "updated.yaml", "randomisation.yaml", "figures",
    }  # fmt: skip
    assert np.isfinite(found.diagnosis.remainder.nrmse_position)
