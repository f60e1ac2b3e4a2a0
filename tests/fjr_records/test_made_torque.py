"""Logs of reference and position alone: the described controller makes the torque."""

from pathlib import Path

import numpy as np
import pytest

from controller_node import pd_filtered
from fjr_interface.experiment import RecordDescription
from fjr_kit.errors import InputError
from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import Understood, read_files
from fjr_records.importers.made_torque import MADE, ONCE
from fjr_records.importers.record_file import ImportOptions
from fjr_sim_node import plant
from fjr_sim_node.plant import PLANT
from fjr_sim_node.simulation import closed_loop

RATE = 500.0
GAINS = {"p": 1500.0, "d": 20.0, "n": 100.0}
KNOWN = "{{kind: pd_filtered, p: {p}, d: {d}, n: {n}, torque_limit_nm: {limit}}}"


def log(folder: Path, begins: float = 0.0) -> tuple[Path, np.ndarray]:
    """Write a log of the emulated rig that lacks its torque; return it with this torque."""
    t = np.arange(3000) / RATE
    r = 0.2 * np.sin(2 * np.pi * 0.5 * t**2) * np.minimum(1.0, t)
    values = {"sample_rate_hz": RATE, **GAINS, "torque_limit_nm": 60.0}
    law = pd_filtered.coefficients(pd_filtered.CONTROLLER.check(values))
    run = closed_loop.simulate(r, RATE, plant.coefficients(PLANT.defaults()), law)
    file = folder / "run.csv"
    table = np.column_stack([t, r + begins, run.position + begins])
    np.savetxt(file, table, fmt="%.12g", delimiter=",", header="t,r,y", comments="")
    return file, run.torque


def understood(file: Path, controller: str | None) -> Understood:
    paths: tuple[Path, ...] = ()
    if controller is not None:
        paths = (file.with_name("controller.yaml"),)
        paths[0].write_text(controller)
    maps = ["time=t", "reference=r", "position=y"]
    return read_files(
        [file], ImportOptions(parse_map(maps, described=bool(paths)), controllers=paths)
    )


@pytest.mark.parametrize("begins", [0.0, 0.7])
def test_the_torque_is_that_of_the_rig(tmp_path, begins):
    file, torque = log(tmp_path, begins)
    found = understood(file, KNOWN.format(**GAINS, limit=60.0))
    (record,) = found.records
    assert np.abs(torque).max() == 60.0  # so that the limit counts
    assert record.signals["u"] == pytest.approx(torque, abs=1e-6)
    assert MADE + ONCE in record.notes
    assert isinstance(found.descriptions[0], RecordDescription)


def test_an_integral_begins_at_zero(tmp_path):
    file, _ = log(tmp_path)
    (record,) = understood(file, "{kind: pid, p: 100.0, i: 50.0}").records
    error = record.signals["r"] - record.signals["y"]
    integral = np.cumsum(error) / RATE
    made = record.signals["u"] - 100.0 * error
    assert made == pytest.approx(50.0 * integral, abs=50.0 * np.abs(error).max() / RATE)


@pytest.mark.parametrize(
    ("controller", "says"),
    [
        (None, "the map lacks torque; add torque=column, or, where reference and position were"),
        ("{kind: pd, p: unknown, d: 1.0}", "no torque is mapped, and only a reference and a contr"),
    ],
)
def test_what_cannot_be_made_is_refused(tmp_path, controller, says):
    file, _ = log(tmp_path)
    with pytest.raises(InputError, match=says):
        understood(file, controller)


def test_position_and_torque_are_needed_without_a_reference():
    with pytest.raises(InputError, match="lacks torque"):
        parse_map(["position=y"], described=True)
    with pytest.raises(InputError, match=r"lacks torque and position; add torque=column\."):
        parse_map(["reference=r"], described=True)


def test_where_no_torque_acts_none_is_mapped(tmp_path):
    stamps = np.arange(400) / 100.0
    file = tmp_path / "let_go.csv"
    angle = np.exp(-0.2 * stamps) * np.cos(5.0 * stamps)
    np.savetxt(file, np.column_stack([stamps, angle]), delimiter=",", header="t,y", comments="")
    columns = parse_map(["time=t", "position=y"], swings_free=True)
    (record,) = read_files([file], ImportOptions(columns, swings_free=True)).records
    assert not record.signals["u"].any() and record.signals["u"].size == 400
    assert any("swings free" in note for note in record.notes)
    assert not any("torque" in doubt for doubt in record.doubts)
    with pytest.raises(InputError, match="say --swings-free"):
        parse_map(["time=t", "position=y"])
    with pytest.raises(InputError, match="no controller makes a torque where none acts"):
        read_files([file], ImportOptions(columns, swings_free=True, controllers=(file,)))
    with pytest.raises(InputError, match="no torque is said to act"):
        parse_map(["torque=u", "position=y"], swings_free=True)
