from __future__ import annotations

import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import simulated_loop as loop
from bag_tools import foreign_bag, stream

from bla_analyzer.analysis import analyze
from bla_analyzer.bla.fast import fast_bla
from bla_analyzer.bla.robust import robust_bla
from bla_analyzer.compare.metrics import ReferenceModel
from fjr_interface.bags.signals import SignalMap
from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import Experiment
from fjr_interface.topics import SIGNALS
from fjr_kit.errors import InputError
from fjr_records.any_folder import NOT_PERIODIC
from fjr_records.discover import discover
from fjr_records.experiment_bag import Override
from fjr_records.lines import Grid
from fjr_records.realization import read_realization

N = 128
LINES = loop.lines(N)
Arrays = tuple[np.ndarray, np.ndarray, np.ndarray]


def describe(level: int = 0, realization: int = 0, **changes) -> Experiment:
    values = {
        "sample_rate_hz": loop.RATE_HZ,
        "samples_per_period": N,
        "periods": 3,
        "transient_periods": 2,
        "level": level,
        "levels": 1,
        "realization": realization,
        "realizations": 3,
        "amplitude_rad": 0.2 * (level + 1),
        "excited_harmonics": LINES.excited.tolist(),
        "detection_harmonics": LINES.odd.tolist(),
        "controller": {"kind": "gain", "p": loop.GAIN},
    }
    return Experiment(**values | changes)


def simulate(level=0, realization=0, periods=5, samples=N, noise_std=0.01, seed=None) -> Arrays:
    """Return r, u, y from rest."""
    rng = np.random.default_rng([level, realization] if seed is None else seed)
    period = (level + 1) * loop.multisines(LINES.excited, 1, samples, rng)
    r = np.tile(period, periods)
    u, y = loop.run(r, 2e-8, noise_std * rng.standard_normal(r.shape))
    return r[0], u[0], y[0]


def write(folder: Path, experiment: Experiment, data: Arrays) -> Path:
    r, u, y = data
    with BagWriter(folder, experiment) as bag:
        bag.write_arrays(r=r, u=u, y=y)
    return folder


def write_foreign(folder: Path, data: Arrays) -> Path:
    """Write a bag without description, at 100 Hz."""
    stamps = 10_000_000 * np.arange(1, data[0].size + 1)
    named = dict(zip("ruy", data, strict=True))
    return foreign_bag(
        folder,
        {signal.absolute_topic: stream(signal, stamps, named[signal.symbol]) for signal in SIGNALS},
    )


def campaign(folder: Path, levels: int = 1, realizations: int = 3, **changes) -> Path:
    for level in range(levels):
        for m in range(realizations):
            described = describe(level, m, levels=levels, realizations=realizations, **changes)
            data = simulate(level, m, described.periods + described.transient_periods)
            write(folder / f"bag_{9 - m}_{level}", described, data)
    return folder


def restless(data: Arrays) -> Arrays:
    """Add a motion that falls off with frequency as masses do and does not repeat."""
    r, u, y = data
    slow = np.cumsum(np.cumsum(np.random.default_rng(1).standard_normal(y.size)))
    time = np.arange(y.size)
    slow -= np.polynomial.Polynomial.fit(time, slow, 9)(time)
    return r, u, y + slow / slow.std() * y.std()


def refusal(folder: Path, **options) -> str:
    with pytest.raises(InputError) as caught:
        analyze(folder, **options)
    sentence = str(caught.value)
    assert "\n" not in sentence
    assert sentence.endswith(".")
    return sentence


def test_robust_analysis_of_two_levels(tmp_path):
    campaign(tmp_path, levels=2)
    done = []
    model = ReferenceModel("half", "half the gain", lambda f, rate: np.full(f.size, 0.5 + 0j))
    result = analyze(tmp_path, models=[model], progress=lambda *args: done.append(args))

    assert result.bags == tuple(f"bag_{9 - m}_{level}" for level in range(2) for m in range(3))
    assert [args[:2] for args in done] == [(i + 1, 6) for i in range(6)]
    assert {args[2] for args in done} == set(result.bags)
    assert (result.sample_rate_hz, result.samples_per_period) == (100.0, N)
    assert (result.periods, result.transient_periods, result.described) == (3, 2, True)
    assert result.controller == {"kind": "gain", "p": loop.GAIN}
    assert result.notes == ()
    assert len(result.checks) == 2 * (3 * 4 + 2)
    assert all(check.passed for check in result.checks)
    for index, level in enumerate(result.levels):
        data = np.array([simulate(index, m) for m in range(3)]).reshape(3, 3, 5, N)[:, :, 2:]
        expected = robust_bla(loop.spectra(loop.Signals(*data.swapaxes(0, 1)), 60), LINES.excited)
        assert level.level == index
        np.testing.assert_array_equal(level.amplitude_rad, 0.2 * (index + 1))
        for name in ("g", "var_total", "var_noise", "radius_95", "nonlinear_p_value"):
            np.testing.assert_array_equal(getattr(level.bla, name), getattr(expected, name))
        rms = np.sqrt((data**2).mean(axis=(0, 2, 3)))
        assert level.reference_rms_rad == pytest.approx(rms[0])
        assert level.torque_rms_nm == pytest.approx(rms[1])
        assert level.position_rms_rad == pytest.approx(rms[2])
        assert level.torque_peak_nm == np.abs(data[:, 1]).max()
        assert level.position_peak_rad == np.abs(data[:, 2]).max()
        np.testing.assert_array_equal(level.signals.torque_nm, data[0, 1, -1])
        (comparison,) = level.comparisons
        error = (20 * np.log10(0.5 / abs(expected.g))) ** 2
        assert (comparison.name, comparison.v_mean) == ("half", pytest.approx(error.mean()))
        np.testing.assert_allclose(level.odd.frequency_hz, LINES.odd * 100 / N)
        np.testing.assert_allclose(level.even.frequency_hz, LINES.even * 100 / N)
        assert (level.odd.corrected > 0).all()


def test_fast_analysis_uses_the_first_realization_and_says_so(tmp_path):
    result = analyze(campaign(tmp_path), method="fast")
    data = np.array(simulate(0, 0)).reshape(3, 1, 5, N)[:, :, 2:]
    expected = fast_bla(loop.spectra(loop.Signals(*data), LINES.last)[0], LINES)
    np.testing.assert_array_equal(result.levels[0].bla.g, expected.g)
    np.testing.assert_array_equal(result.levels[0].bla.var_total, expected.var_total)
    assert any("fast method uses the first of 3 realizations" in note for note in result.notes)


def test_order_of_harmonics_in_the_description_does_not_matter(tmp_path):
    shuffled = LINES.excited[::-1].tolist()
    amplitudes = np.linspace(2.0, 1.0, len(shuffled)).tolist()
    campaign(tmp_path, excited_harmonics=shuffled, amplitude_rad=amplitudes)
    level = analyze(tmp_path).levels[0]
    np.testing.assert_allclose(level.bla.frequency_hz, LINES.excited * 100 / N)
    np.testing.assert_array_equal(level.amplitude_rad, amplitudes[::-1])


def test_one_bag_is_a_folder_too(tmp_path):
    bag = write(tmp_path / "bag", describe(realizations=1), simulate())
    assert analyze(bag, method="fast").bags == ("bag",)


def test_missing_realizations_and_levels_are_noted(tmp_path):
    for level in (0, 2):
        for m in (0, 2):
            write(tmp_path / f"{level}_{m}", describe(level, m, levels=3), simulate(level, m))
    notes = analyze(tmp_path).notes
    assert "level 0 has 2 of 3 planned realizations." in notes
    assert "level 1 is missing: there is no bag of it." in notes
    assert "level 2 has 2 of 3 planned realizations." in notes


def test_one_period_leaves_the_noise_unknown_and_says_so(tmp_path):
    campaign(tmp_path, periods=1)
    result = analyze(tmp_path)
    assert np.isnan(result.levels[0].bla.var_noise).all()
    assert any("with one period the noise is unknown" in note for note in result.notes)
    assert "record more periods, or use the robust method" in refusal(tmp_path, method="fast")


def test_override_takes_other_periods(tmp_path):
    campaign(tmp_path)
    result = analyze(tmp_path, override=Override(transient_periods=3))
    assert (result.transient_periods, result.periods) == (3, 2)
    result = analyze(tmp_path, override=Override(periods=2))
    assert (result.transient_periods, result.periods) == (2, 2)
    data = np.array([simulate(0, m) for m in range(3)]).reshape(3, 3, 5, N)[:, :, 2:4]
    expected = robust_bla(loop.spectra(loop.Signals(*data.swapaxes(0, 1)), 60), LINES.excited)
    np.testing.assert_array_equal(result.levels[0].bla.g, expected.g)


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        (Override(periods=0), "periods must be 1 or more, not 0."),
        (Override(transient_periods=-1), "transient_periods must be 0 or more, not -1."),
        (Override(samples_per_period=1), "samples_per_period must be 2 or more, not 1."),
        (Override(transient_periods=5), "hold 5 periods, too few for 5 transient periods"),
        (Override(periods=4), "hold 5 periods, too few for 2 transient periods and 4 to keep"),
        (Override(samples_per_period=64), "samples_per_period 64 contradicts the description"),
    ],
)
def test_impossible_override_is_refused(tmp_path, override, sentence):
    assert sentence in refusal(campaign(tmp_path), override=override)


# Bags without description


def test_foreign_bags_give_the_same_result_as_described_ones(tmp_path):
    for m in range(3):
        write(tmp_path / "described" / f"bag_{m}", describe(0, m), simulate(0, m))
        for level in range(2):
            write_foreign(tmp_path / "foreign" / f"bag_{level}_{m}", simulate(level, m))
    described, foreign = analyze(tmp_path / "described"), analyze(tmp_path / "foreign")
    assert not foreign.described
    assert foreign.bags == tuple(f"bag_{level}_{m}" for level in range(2) for m in range(3))
    assert foreign.samples_per_period == N
    assert foreign.transient_periods + foreign.periods == 5
    assert 1 <= foreign.transient_periods <= 2
    assert "found in the reference: a period of 128 samples, 17 excited lines" in foreign.notes[0]
    again = analyze(tmp_path / "foreign", override=Override(transient_periods=2, periods=3))
    np.testing.assert_allclose(again.levels[0].bla.g, described.levels[0].bla.g, rtol=1e-12)
    np.testing.assert_allclose(again.levels[0].amplitude_rad, np.sqrt(2 / 17), rtol=1e-9)


def test_torque_stands_for_a_reference_that_is_not_read(tmp_path):
    for m in range(3):
        r, _, y = simulate(0, m)
        write_foreign(tmp_path / f"bag_{m}", (np.zeros_like(r), r, y))
    result = analyze(tmp_path, signal_map=SignalMap.parse(["reference=none"]))
    assert any("the torque stands for it" in note for note in result.notes)
    expected = simulate(0, 0)
    level = result.levels[0]
    assert level.torque_rms_nm == pytest.approx(level.reference_rms_rad)
    assert level.torque_rms_nm == pytest.approx(np.std(expected[0]))
    assert "the reference is constant" in refusal(tmp_path, method="robust")


def test_soft_start_noise_and_a_rest_do_not_mislead_the_search():
    r, _, y = simulate(periods=6)
    ramp = np.minimum(np.arange(r.size) / N, 1.0)
    noisy = (r * ramp + 0.01 * np.random.default_rng(0).standard_normal(r.size))[: 5 * N + 50]
    found = discover("bag", noisy, (y * ramp)[: 5 * N + 50])
    assert found.samples_per_period == N
    np.testing.assert_array_equal(found.excited, LINES.excited)
    assert found.transient_periods >= 1
    assert found.transient_periods + found.periods == 5


def test_many_short_periods_are_found():
    r, _, y = simulate(periods=300)
    found = discover("bag", r, y)
    assert found.samples_per_period == N
    assert found.periods > 290


def test_given_period_is_used():
    r, _, y = simulate(periods=6)
    assert discover("bag", r, y, 2 * N).samples_per_period == 2 * N
    np.testing.assert_array_equal(discover("bag", r, y, 2 * N).excited, 2 * LINES.excited)


def fractional(period: float, samples: int) -> np.ndarray:
    rng = np.random.default_rng(2)
    phase = 2 * np.pi * np.outer(np.arange(samples) / period, [1, 3, 7, 9, 15, 19])
    return np.cos(phase + rng.uniform(0, 2 * np.pi, 6)).sum(axis=1)


@pytest.mark.parametrize("period", [100.5, 100.25, 100.37, 99.95])
def test_period_that_is_not_a_whole_number_of_samples_is_refused(tmp_path, period):
    r = fractional(period, 900)
    write_foreign(tmp_path / "bag", (r, r, r))
    sentence = refusal(tmp_path, method="fast")
    said = re.search(r"bag: the period of the reference is about ([\d.]+) samples, ", sentence)
    assert said, sentence
    assert float(said[1]) == pytest.approx(period, abs=0.02)
    assert "not a whole number" in sentence


def test_reference_that_never_repeats_or_has_no_lines_is_refused():
    noise = np.random.default_rng(0).standard_normal(1000)
    with pytest.raises(InputError, match="bag: the reference does not repeat within 1000 samples"):
        discover("bag", noise, noise)
    repeated = np.tile(noise[:200], 4)
    with pytest.raises(InputError, match="bag: no excited lines stand out"):
        discover("bag", repeated, repeated)
    with pytest.raises(InputError, match="bag: holds fewer than one period of 2000 samples"):
        discover("bag", noise, noise, 2000)


def test_why_foreign_bags_with_other_lines_are_no_experiment_is_said(tmp_path):
    write_foreign(tmp_path / "one", simulate())
    write_foreign(tmp_path / "two", simulate(samples=2 * N, seed=1))
    why = "(one and two differ in sample rate, period or excited lines; put them into separate"
    assert why in refusal(tmp_path)
    assert f"leave the method out. {NOT_PERIODIC} {why}" in refusal(tmp_path, method="robust")


# What does not belong together or cannot be used


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("sample_rate_hz", 200.0),
        ("samples_per_period", 160),
        ("periods", 2),
        ("transient_periods", 1),
        ("excited_harmonics", LINES.excited[:-1].tolist()),
        ("detection_harmonics", LINES.odd[:-1].tolist()),
        ("controller", {"kind": "gain", "p": 1.0}),
    ],
)
def test_differing_bags_are_refused_by_name(tmp_path, field, value):
    write(tmp_path / "one", describe(), simulate())
    other = describe(0, 1, **{field: value})
    data = tuple(np.resize(x, other.samples) for x in simulate(0, 1))
    write(tmp_path / "two", other, data)
    assert f"one and two differ in {field}; put them" in refusal(tmp_path)


def test_other_mismatches_between_bags_are_refused_by_name(tmp_path):
    write(tmp_path / "a" / "one", describe(), simulate())
    write(tmp_path / "a" / "two", describe(), simulate())
    assert "one and two are both level 0, realization 0" in refusal(tmp_path / "a")
    write(tmp_path / "b" / "one", describe(), simulate())
    write(tmp_path / "b" / "two", describe(0, 1, amplitude_rad=0.3), simulate(0, 1))
    assert "one and two are of one level but differ in amplitude_rad" in refusal(tmp_path / "b")
    write(tmp_path / "c" / "one", describe(), simulate())
    write_foreign(tmp_path / "c" / "two", simulate(0, 1))
    assert "two has no experiment description but one has one" in refusal(tmp_path / "c")


def test_realizations_of_one_reference_are_pooled_as_periods_of_one(tmp_path):
    """Described as repeats or not, they count once, and their periods together."""
    for m in range(3):
        write(tmp_path / f"bag_{m}", describe(0, m), simulate(seed=5 if m else 4))
    result = analyze(tmp_path, method="robust")
    assert result.levels[0].bla.realizations == 2
    assert result.levels[0].bla.periods == describe().periods
    assert "3 realizations play 2 different references" in " ".join(result.notes)


def test_repeats_of_one_reference_alone_are_no_realizations(tmp_path):
    for m in range(2):
        repeat = {"repeat_of": 0} if m else {}
        write(tmp_path / f"bag_{m}", describe(0, m, **repeat), simulate(seed=4))
    assert "with different references and has one" in refusal(tmp_path, method="robust")
    bla = analyze(tmp_path).levels[0].bla
    assert (bla.method, bla.periods) == ("fast", 2 * describe().periods)


def test_no_bag_and_no_folder_are_refused(tmp_path):
    assert str(tmp_path) in refusal(tmp_path)
    assert "nowhere" in refusal(tmp_path / "nowhere")
    with pytest.raises(InputError, match="method must be robust, fast or local, not 'slow'"):
        analyze(tmp_path, method="slow")


def test_one_realization_is_refused_by_the_robust_method_with_the_way_out(tmp_path):
    campaign(tmp_path, realizations=1)
    assert "leave the method out" in refusal(tmp_path, method="robust")
    assert analyze(tmp_path).levels[0].bla.method == "fast"


def test_a_level_with_one_realization_does_not_stop_the_others(tmp_path):
    campaign(tmp_path)
    write(tmp_path / "second", describe(1, 0), simulate(1, 0))
    result = analyze(tmp_path, method="robust")
    assert [level.bla is None for level in result.levels] == [False, True]
    assert any(note.startswith("level 1: the robust method needs two") for note in result.notes)


def test_response_that_is_not_periodic_at_any_level_is_refused(tmp_path):
    for m in range(3):
        write(tmp_path / f"bag_{m}", describe(0, m), restless(simulate(0, m)))
    assert "level 0: the response is not periodic in 3 of 3 realizations" in refusal(tmp_path)
    assert "not periodic" in refusal(tmp_path, method="fast")


def test_level_that_is_not_periodic_has_no_bla_and_the_others_have(tmp_path):
    campaign(tmp_path)
    model = ReferenceModel("one", "", lambda f, rate: np.ones(f.size, complex))
    for m in range(3):
        data = simulate(1, m)
        write(tmp_path / f"restless_{m}", describe(1, m), restless(data) if m == 1 else data)
    result = analyze(tmp_path, models=[model])
    first, second = result.levels
    assert first.bla is not None
    assert second.bla is None
    assert second.comparisons == ()
    assert np.isnan(second.odd.corrected).all()
    assert (second.odd.position > 0).all()
    failed = [check for check in result.checks if not check.passed]
    assert ("periodicity", 1, 1) in [(c.name, c.level, c.realization) for c in failed]
    assert any("level 1: the response is not periodic in 1 of 3" in n for n in result.notes)


def test_fast_method_asks_only_its_own_realization_to_be_periodic(tmp_path):
    for m in range(2):
        data = simulate(0, m)
        write(tmp_path / f"bag_{m}", describe(0, m), restless(data) if m else data)
    result = analyze(tmp_path, method="fast")
    assert result.levels[0].bla is not None
    assert [c.passed for c in result.checks if c.name == "periodicity"] == [True, False]
    assert "not periodic in 1 of 2" in refusal(tmp_path)


def test_transient_and_noisy_torque_are_noted(tmp_path):
    rng = np.random.default_rng(0)
    for m in range(3):
        r, u, y = simulate(0, m)
        u = u + 10 * u.std() * rng.standard_normal(u.size)
        y = y + y.std() * np.exp(-np.arange(y.size) / 100)
        write(tmp_path / f"bag_{m}", describe(0, m), (r, u, y))
    notes = " ".join(analyze(tmp_path).notes)
    assert "level 0: the transient has not decayed in 3 of 3 realizations" in notes
    assert "level 0: the noise on the torque exceeds 0.02 of its power" in notes
    assert "Var(U)/|U|^2 exceeds 0.02 at" in notes


def test_reference_that_is_zero_on_an_excited_line_is_refused(tmp_path):
    campaign(tmp_path, realizations=2)
    silent = int(LINES.even[3])
    excited = sorted([*LINES.excited.tolist(), silent])
    for m in range(2):
        write(
            tmp_path / "more" / f"bag_{m}",
            describe(0, m, excited_harmonics=excited),
            simulate(0, m),
        )
    sentence = refusal(tmp_path / "more")
    assert f"the reference is zero on excited harmonic {silent} " in sentence
    assert "bag_" in sentence


def test_damaged_bag_is_refused(tmp_path):
    campaign(tmp_path)
    file = next((tmp_path / "bag_8_0").glob("*.mcap"))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    assert "bag_8_0" in refusal(tmp_path)


def test_memory_does_not_grow_with_the_number_of_periods():
    size = 20_000
    grid = loop.lines(512)
    period = loop.multisines(grid.excited, 3, size, np.random.default_rng(0))

    def peak(periods: int) -> int:
        blocks = (tuple(period + 1e-9 * index) for index in range(periods + 1))
        tracemalloc.start()
        read_realization("bag", 0, 0, blocks, Grid(100.0, size, 1, periods, grid))
        top = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return top

    assert peak(100) < 1.1 * peak(10)
