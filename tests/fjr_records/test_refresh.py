"""Positions that are refreshed more slowly than they are logged: found, told and mended."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import Understood, read_files
from fjr_records.importers.record_file import ImportOptions
from fjr_records.importers.refresh import refreshed_every

RATE, K = 1000.0, 10


def motion(samples: int = 6000) -> np.ndarray:
    time = np.arange(samples) / RATE
    moves = 0.4 * np.sin(2 * np.pi * 0.7 * time) + 0.1 * np.sin(2 * np.pi * 2.3 * time**1.1)
    return moves * np.minimum(1.0, np.maximum(time - 0.5, 0.0))  # at rest in the first half second


def held(signal: np.ndarray, k: int = K, first: int = 3) -> np.ndarray:
    return signal[np.maximum((np.arange(signal.size) - first) // k * k + first, 0)]


def imported(folder: Path, *runs: dict[str, np.ndarray], timed: bool = False, **changes):
    files = []
    for index, values in enumerate(runs):
        files.append(folder / f"{index}.npz")
        np.savez(files[-1], **values)
    specs = ["torque=u", "position=y", *(["time=t"] if timed else [])]
    rate = {} if timed else {"sample_rate_hz": RATE}
    return read_files(files, ImportOptions(parse_map(specs), **rate, **changes))


def run(seed: int = 0) -> dict[str, np.ndarray]:
    y = motion()
    torque = 0.1 * np.gradient(np.gradient(y)) * RATE**2 + 0.5 * np.gradient(y) * RATE
    return {"u": torque + 0.01 * np.random.default_rng(seed).standard_normal(y.size), "y": y}


def said(understood: Understood) -> str:
    return " ".join(part for r in understood.records for part in (*r.notes, *r.doubts))


@pytest.mark.parametrize(("k", "first"), [(2, 1), (5, 0), (10, 3), (40, 7)])
@pytest.mark.parametrize("step", [0.0, 1e-4])
def test_a_held_position_is_found(k, first, step):
    y = held(motion(), k, first)
    assert refreshed_every(np.rint(y / step) * step if step else y) == (k, first % k)


@pytest.mark.parametrize("step", [1e-4, 1e-3, 1e-2, 0.05])
@pytest.mark.parametrize("samples_per_s", [0.03, 0.3, 1.0])
def test_a_coarse_encoder_repeats_its_values_otherwise(step, samples_per_s):
    slow = np.interp(samples_per_s * np.arange(6000), np.arange(6000), motion())
    assert refreshed_every(np.rint(slow / step) * step)[0] == 1


def test_a_coarse_encoder_at_one_speed_goes_by_single_steps():
    assert refreshed_every(np.arange(5000) // 10 * 1e-3)[0] == 1


def test_smooth_and_standing_positions_are_not_held():
    assert refreshed_every(motion())[0] == 1
    assert refreshed_every(np.zeros(500))[0] == 1
    assert refreshed_every(np.zeros(1))[0] == 1


@pytest.mark.parametrize("timed", [False, True])
def test_a_held_position_is_brought_to_its_own_rate(tmp_path, timed):
    values = run()
    time = {"t": np.arange(values["y"].size) / RATE} if timed else {}
    understood = imported(tmp_path, {**values, "y": held(values["y"]), **time}, timed=timed)
    (record,) = understood.records
    assert record.sample_rate_hz == pytest.approx(RATE / K)
    assert record.signals["y"] == pytest.approx(values["y"][3::K][: record.samples])
    assert record.signals["u"][50] == pytest.approx(values["u"][503:513].mean())
    assert "changes only at every 10th sample" in said(understood)
    assert "refreshed at 100 Hz" in said(understood)


def test_a_jittered_log_keeps_the_stamps_of_new_positions(tmp_path):
    values = run()
    jitter = 2e-4 * np.random.default_rng(1).uniform(-1.0, 1.0, values["y"].size)
    time = np.arange(values["y"].size) / RATE + jitter
    y = held(motion(), K, 3)
    (record,) = imported(tmp_path, {**values, "y": y, "t": time}, timed=True).records
    assert record.sample_rate_hz == pytest.approx(100.0, rel=0.01)
    assert record.timing.stamps_s["position"].size == (y.size - 3) // K


def test_files_come_to_one_rate_though_one_moves_too_little_to_tell(tmp_path):
    values = run()
    still = np.where(np.arange(6000) < 3000, 0.0, 0.1)
    runs = {**values, "y": held(values["y"])}, {**values, "y": still}
    first, second = imported(tmp_path, *runs).records
    assert first.sample_rate_hz == second.sample_rate_hz == RATE / K


def test_where_periods_are_given_in_samples_it_is_only_told(tmp_path):
    tile = np.sin(2 * np.pi * np.outer(np.arange(1000) / 1000, [1, 3, 7])).sum(axis=1)
    y = np.tile(held(tile, K, 0), 4)
    values = {"u": np.tile(tile, 4), "y": y, "r": np.tile(tile, 4)}
    np.savez(tmp_path / "a.npz", **values)
    options = ImportOptions(
        parse_map(["torque=u", "position=y", "reference=r"]), RATE, samples_per_period=1000
    )
    understood = read_files([tmp_path / "a.npz"], options)
    assert understood.records[0].sample_rate_hz == RATE
    assert any("every 10th sample" in doubt for doubt in understood.records[0].doubts)


def test_a_held_torque_is_only_told(tmp_path):
    values = run()
    understood = imported(tmp_path, {**values, "u": held(values["u"], 4, 0)})
    assert understood.records[0].sample_rate_hz == RATE
    assert "the torque changes only at every 4th sample, as of a controller of 250 Hz" in said(
        understood
    )


def test_a_plain_log_stays_as_it_is(tmp_path):
    understood = imported(tmp_path, run())
    assert understood.records[0].samples == 6000 and "sample" not in said(understood)
