"""Linear laws in a narrow band: one that leaves more than noise may stand for another one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_evidence import NOMINAL, RATE, records

from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.verdict.tested_causes import causes_with_tests, octaves_left
from gap_diagnosis.which.narrow_band import doubt_of_band, narrow, octaves_moved


def moved(*motions: np.ndarray) -> RecordSet:
    made = []
    for run, motion in enumerate(motions):
        described = RecordDescription.of(
            "test", sample_rate_hz=RATE, level=0, levels=1, realization=run,
            realizations=len(motions), controller=None,
        )  # fmt: skip
        made.append(Record(f"run_{run}", described, None, 0.0 * motion, motion, None))
    return RecordSet("test", RATE, tuple(made))


def test_the_band_of_a_motion_is_where_its_power_is():
    t = np.arange(int(20.0 * RATE)) / RATE
    sine = 3.0 + np.sin(2.0 * np.pi * t)
    assert octaves_moved(moved(sine)) < 0.3
    assert octaves_moved(moved(sine, sine[: t.size // 2])) < 0.5
    other = np.sin(2.0 * np.pi * 4.0 * t)
    assert octaves_moved(moved(sine + other)) == pytest.approx(2.0, abs=0.2)
    assert octaves_moved(moved(sine, other)) == pytest.approx(2.0, abs=0.2)
    assert octaves_moved(records(seconds=16.0)) > 3.0


def test_a_narrow_band_leaves_half_and_is_told():
    assert [doubt_of_band(octaves) for octaves in (0.1, 1.0, 1.5, 2.0, np.inf)] == [
        0.5, 0.5, 0.75, 1.0, 1.0,
    ]  # fmt: skip
    (said,) = narrow(["cable", "coulomb_friction"], 1.2)
    assert "1.2 octaves" in said and "cable" in said and "coulomb" not in said
    assert narrow(["coulomb_friction", "cogging"], 0.3) == narrow(["cable"], np.inf) == []


@pytest.mark.parametrize(
    ("band_hz", "least", "most"), [((0.9, 1.3), 0.0, 0.6), ((0.5, 8.0), 0.6, 1.0)]
)
def test_an_agent_at_the_pace_of_the_motion_is_no_sure_spring(band_hz, least, most):
    """What holds the joint is a spring, and a torque beside it that follows the motion late."""
    spring = {"external_spring.stiffness_nm_rad": 150.0}
    runs = records(spring, runs=3, seconds=16.0, band_hz=band_hz)
    late = int(0.1 * RATE)
    pushed = tuple(
        replace(r, torque=r.torque + 40.0 * np.roll(r.position, late)) for r in runs.records
    )
    runs = replace(runs, records=tuple(replace(r, reference=None) for r in pushed))
    fitter = CellFitter(Evidence(runs, NOMINAL), NOMINAL, 0.1)
    refit = fitter.refit()
    proposals = fitter.screening(refit, "external_spring").proposals()
    fit = fitter.add(refit, "external_spring", proposals)
    (tested,) = causes_with_tests(fitter, fit, refit, {})
    assert np.isfinite(octaves_left(fitter, fit))
    assert least <= tested.present <= most
