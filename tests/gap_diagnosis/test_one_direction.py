"""Drives that turn one way only, where a constant torque and Coulomb friction are the same.

A spindle that is run up and coasts down, logged as torque and speed, and one that coasts down with
nothing logged but its speed. Both are integrated here.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions
from gap_diagnosis.any_record import diagnose, read_any
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.fits.reweighted import _instead
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.nominal import datasheet
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.starts.search_space import space_for
from gap_diagnosis.which.presence import cell_estimates

RATE, SUBSTEPS, RPM = 100, 10, 30.0 / np.pi
INERTIA, COASTING = 0.012, 0.012
SIZES = (
    "coulomb_friction.motor_nm",
    "viscous_friction.motor_nm_s_rad",
    "quadratic_friction.motor_nm_s2_rad2",
    "torque_bias.torque_nm",
)
FRICTIONS = (0.2, 4e-4, 2.2e-6)


def spindle(
    rng: np.random.Generator,
    wanted: float,
    friction: Sequence[float],
    seconds: float,
    driven: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return speed (rad/s) and mean torque (N m) of one run.

    A speed loop jumps to the wanted speed, (rad/s), after 1 s and is switched off at its end; what
    is driven for no time turns with that speed at first. Its frictions, Coulomb, viscous and
    quadratic, scatter by 3 %.
    """
    samples, h = int(seconds * RATE), 1.0 / (RATE * SUBSTEPS)
    coulomb, viscous, quadratic = np.array(friction) * (1.0 + 0.03 * rng.standard_normal(3))
    w, integral = 0.0 if driven else wanted, 0.0
    speed, torque = np.zeros((2, samples))
    for k in range(samples):
        speed[k] = w
        for _ in range(SUBSTEPS):
            u = 0.0
            if k < driven * RATE:
                error = wanted * (k > RATE) - w
                integral += 2.0 * error * h
                u = min(max(0.2 * error + integral, 0.0), 20.0)
            drive = u - viscous * w - quadratic * w * w
            if w > 0.0 or drive > coulomb:
                w = max(w + h * (drive - coulomb) / INERTIA, 0.0)
            torque[k] += u / SUBSTEPS
    return speed, torque


def imported(folder: Path, runs: list[dict[str, np.ndarray]], maps: list[str], free: bool) -> Path:
    """Import runs and return the folder of their bags."""
    files = [folder / f"run{k}.csv" for k in range(len(runs))]
    for file, run in zip(files, runs, strict=True):
        table = np.column_stack([np.arange(run["rpm"].size) / RATE, *run.values()])
        np.savetxt(
            file, table, fmt="%.9g", delimiter=",", header=",".join(("t", *run)), comments=""
        )
    columns = parse_map(["time=t", "position=rpm:rpm", *maps], swings_free=free)
    import_files(files, folder / "bags", ImportOptions(columns, swings_free=free))
    return folder / "bags"


SPLIT = 1.0  # N m: of which only the difference from the constant torque shows


@pytest.fixture(scope="module")
def spindles(tmp_path_factory):
    """Return a fitter of three run-ups, and an explanation in which friction is split."""
    rng, runs = np.random.default_rng(0), []
    for wanted in np.array([3000.0, 6000.0, 9000.0]) / RPM:
        speed, torque = spindle(rng, wanted, FRICTIONS, 70.0, 20.0)
        noise = 0.005 * rng.standard_normal(speed.size)
        runs.append({"rpm": np.round(speed * RPM), "u": torque + noise})
    bags = imported(tmp_path_factory.mktemp("spindle"), runs, ["torque=u"], free=False)
    sheet = datasheet({"jm": INERTIA}, "spindle")
    nominal = Model.nominal(sheet).plant
    fitter = CellFitter(Evidence(read_any(bags), sheet), nominal, 0.1)
    sizes = dict(zip(SIZES, (*FRICTIONS, SPLIT), strict=True))
    sizes[SIZES[0]] += SPLIT
    space = space_for(nominal, sizes, fitter.scales)
    start = space.point(Model(nominal, sizes))
    effects = tuple(name.split(".")[0] for name in SIZES)
    return fitter, fitter.reweighted(effects, space, start, fitter.refit().variance, (8, 5))


def test_a_constant_torque_leaves_its_work_to_the_friction_that_is_the_same(spindles):
    """It is left out and all else fitted anew, from where all else does what it did."""
    fitter, split = spindles
    assert split.model.effects[SIZES[-1]] > 0.5 * SPLIT
    own = len(split.space.nominal)
    begun = _instead(split, "torque_bias")[own] * split.space.units[0]
    assert begun == pytest.approx(FRICTIONS[0], rel=0.1)
    fewer = fitter.without(split, "torque_bias")
    assert fitter.without(split, "torque_bias") is fewer  # made once
    assert fitter.misfit(fewer) < 1.05 * fitter.misfit(split)
    for name, size in zip(SIZES[:-1], FRICTIONS, strict=True):
        assert fewer.model.effects[name] == pytest.approx(size, rel=0.1), name


def test_of_what_looks_alike_neither_size_is_known(spindles):
    fitter, split = spindles
    found = cell_estimates(split, fitter, {}, {})
    assert found[SIZES[-1]].low <= 0.0 < SPLIT <= found[SIZES[-1]].high
    assert found[SIZES[0]].low <= FRICTIONS[0] <= found[SIZES[0]].high


def test_a_drive_that_coasts_down_by_coulomb_friction_alone_is_diagnosed(tmp_path):
    """Its log holds neither a torque nor a load, so that friction is all that can be solved for."""
    rng, runs = np.random.default_rng(2), []
    for wanted in (60.0, 100.0, 150.0):
        speed, _ = spindle(rng, wanted, (COASTING, 0.0, 0.0), 40.0, 0.0)
        runs.append({"rpm": speed * RPM + 0.5 * rng.standard_normal(speed.size)})
    found = diagnose(imported(tmp_path, runs, [], free=True), {"jm": INERTIA})
    assert "coulomb_friction" in found.effects
    assert found.parameters["coulomb_friction.motor_nm"].value == pytest.approx(COASTING, rel=0.05)


def test_a_short_coast_has_the_friction_of_its_bearings_and_no_loss_under_a_load(tmp_path):
    """Nothing loads its gear: a loss there would only damp what holds the model to the record."""
    rng, runs = np.random.default_rng(2), []
    for wanted in (20.0, 30.0, 40.0):
        speed, _ = spindle(rng, wanted, (0.02, 4e-4, 0.0), 30.0, 0.0)
        runs.append({"rpm": speed * RPM + 0.1 * rng.standard_normal(speed.size)})
    found = diagnose(imported(tmp_path, runs, [], free=True), {"jm": INERTIA})
    named = {e for cause in found.causes for e in (cause.effect, *cause.others)}
    assert "coulomb_friction" in named
    assert not named & {"load_friction", "directional_loss"}
    assert found.parameters["coulomb_friction.motor_nm"].value == pytest.approx(0.02, rel=0.15)
