"""A campaign, recorded as a rig under ros2_control would be: `--resample` finds the same BLA."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from bag_tools import foreign_bag, serialize
from typer.testing import CliRunner

from bla_analyzer.analysis import analyze
from bla_analyzer.results.result import LevelResult, Result
from fjr_cli.app import app
from fjr_interface.bags.files import find_bags
from fjr_interface.bags.reader import BagReader, read_record
from fjr_interface.bags.signals import SignalMap
from fjr_interface.experiment import Experiment
from fjr_interface.resampling.accuracy import Resampling
from fjr_kit.errors import InputError
from fjr_records.experiment_bag import Override
from fjr_records.periodic import read_experiment

MAP = [
    "position=/joint_states:position[elbow]",
    "torque=/command:effort[elbow]",
    "reference=/setpoint:position",
]
START_NS = 1_700_000_000_000_000_000
LOSS = 1e-3


def run(*arguments: object) -> str:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture(scope="module")
def original(tmp_path_factory) -> Path:
    """Simulate a short campaign with encoder noise."""
    folder = tmp_path_factory.mktemp("rig") / "original"
    settings = ["excitation.base_frequency_hz=0.5", "excitation.f_min_hz=0.5"]
    settings += ["excitation.f_max_hz=60.0", "simulator.noise_std_rad=1e-5"]
    options = [part for setting in settings for part in ("--set", setting)]
    options += ["--workers", "1"]
    run("simulate", "--out", folder, "--realizations", 3, "--periods", 2, *options)
    return folder


def between(samples: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return values between even samples by a long windowed sinc, independent of the product."""
    near = np.floor(time).astype(int)[:, None] + np.arange(-150, 151)
    lag = time[:, None] - near
    weights = np.sinc(lag) * np.cos(np.pi * lag / 302.0) ** 2
    return np.sum(samples[np.clip(near, 0, len(samples) - 1)] * weights, axis=1)


def record_otherwise(bag: Path, folder: Path, seed: int, described: bool) -> None:
    """Record a bag anew: positions measured between the samples, all stamps jittered, some lost."""
    rng = np.random.default_rng(seed)
    record, experiment = read_record(bag), BagReader(bag).experiment
    assert experiment is not None
    count = np.arange(len(record.stamps_ns))

    def jittered(jitter: float, offset: float = 0.0) -> np.ndarray:
        return count + offset + jitter * rng.uniform(-1.0, 1.0, len(count))

    def stream(time: np.ndarray, values: np.ndarray, names: list[str], field: str, pad: list):
        kept = rng.random(len(time)) >= LOSS
        stamps = START_NS + np.rint(time * 1e9 / experiment.sample_rate_hz).astype(np.int64)
        return [
            (stamp, serialize(stamp, "base", names, **{field: [*pad, value]}))
            for stamp, value in zip(stamps[kept].tolist(), values[kept].tolist(), strict=True)
        ]

    measured = jittered(0.2, offset=0.31)
    position = between(record.position, measured)
    both = ["shoulder", "elbow"]
    streams = {
        "/joint_states": stream(measured, position, both, "position", [0.0]),
        "/command": stream(jittered(0.01), record.torque, both, "effort", [np.nan]),
        "/setpoint": stream(jittered(0.02), record.reference, ["elbow"], "position", []),
    }
    foreign_bag(folder, streams, description=experiment if described else None)


@pytest.fixture(scope="module", params=[True, False], ids=["described", "undescribed"])
def recorded(request, original, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("recorded")
    for seed, bag in enumerate(find_bags(original)):
        record_otherwise(bag, folder / bag.name, seed, request.param)
    return folder


@pytest.fixture(scope="module")
def analyzed(recorded, tmp_path_factory) -> tuple[Path, str]:
    """Analyze what was recorded by the command; return its folder and what it said."""
    out = tmp_path_factory.mktemp("analysis")
    maps = [part for one in MAP for part in ("--map", one)]
    return out, run("analyze", recorded, "--resample", "auto", *maps, "--out", out)


def only_level(folder: Path, **options) -> LevelResult:
    (level,) = analyze(folder, **options).levels
    assert level.bla is not None
    return level


def stated_errors(result: Result) -> dict[str, float]:
    """Return the stated rms error of each signal, from the notes."""
    pattern = r"(\w+) was resampled from .* at most (\S+) (?:rad|N m) rms"
    found = [match for note in result.notes if (match := re.match(pattern, note))]
    return {match[1]: float(match[2]) for match in found}


def test_the_bla_agrees_within_the_stated_error(original, analyzed):
    result = Result.read(analyzed[0] / "result.json")
    stated = stated_errors(result)
    assert stated.keys() == {"reference", "torque", "position"}
    same = Override(transient_periods=result.transient_periods, periods=result.periods)
    (found,), true = result.levels, only_level(original, override=same)
    assert found.bla is not None and true.bla is not None
    np.testing.assert_array_equal(found.bla.frequency_hz, true.bla.frequency_hz)
    # Errors spread over all frequencies: this is the amplitude at one line of the mean period.
    samples = result.samples_per_period * result.periods * found.bla.realizations
    at_a_line = {name: error * 2.0 / np.sqrt(samples) for name, error in stated.items()}
    expected = np.hypot(
        at_a_line["torque"] / true.excited.torque, at_a_line["position"] / true.excited.position
    )
    difference = np.abs(found.bla.g / true.bla.g - 1.0) / expected
    assert np.sqrt(np.mean(difference**2)) < 1.0 and difference.max() < 3.0
    assert stated["torque"] < 0.01 * found.torque_rms_nm
    assert stated["position"] < 0.01 * found.position_rms_rad


def test_without_resampling_the_bags_are_refused(recorded):
    with pytest.raises(InputError, match="--resample auto"):
        analyze(recorded, signal_map=SignalMap.parse(MAP))


def test_the_command_says_what_it_did(analyzed):
    out, said = analyzed
    assert "Note: position was resampled from /joint_states (1000" in said.replace("\n", " ")
    page = (out / "report.html").read_text()
    assert "was resampled from /command" in page


def test_the_diagnosis_reads_the_same_periods(original, recorded):
    whole = read_experiment(original)
    found = read_experiment(recorded, SignalMap.parse(MAP), resampling=Resampling())
    assert sum("was resampled" in note for note in found.notes) == 3
    assert len(found.realizations) == len(whole.realizations)
    assert found.experiment.samples_per_period == whole.experiment.samples_per_period
    for one, other in zip(found.realizations, whole.realizations, strict=True):
        mine, theirs = one.spectrum(one.position, 60)[-1], other.spectrum(other.position, 60)[-1]
        # The grid may begin at another sample: amplitudes agree, phases turn.
        np.testing.assert_allclose(np.abs(mine[1::2]), np.abs(theirs[1::2]), rtol=0.02, atol=1e-5)


def test_lines_beyond_the_band_are_refused(original, recorded):
    if BagReader(find_bags(recorded)[0], SignalMap.parse(MAP)).experiment is not None:
        pytest.skip("the description fixes the rate")
    with pytest.raises(InputError, match="is faithful up to 48 Hz only"):
        analyze(recorded, signal_map=SignalMap.parse(MAP), resampling=Resampling(120.0))


def test_a_described_rate_is_not_changed(original):
    assert isinstance(BagReader(find_bags(original)[0]).experiment, Experiment)
    with pytest.raises(InputError, match="says 1000 samples/s, not 500"):
        analyze(original, resampling=Resampling(500.0))
