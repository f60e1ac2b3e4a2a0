"""The BLA while a campaign is recorded: its deviation, and where it is good enough."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from graph_runs import campaign, in_batch

from bla_analyzer.analysis import analyze
from fjr_bringup.campaign.chart import chart
from fjr_bringup.campaign.live import FEWEST, LiveBla
from fjr_bringup.campaign.plan import Campaign
from fjr_bringup.design.measured import simulate_level
from fjr_interface.bags.files import find_bags
from fjr_interface.bags.folder_names import bag_folder

RIG = {"excitation": {"amplitudes_rad": [0.007, 0.02], "periods": 2}}


def planned(m: int) -> Campaign:
    return campaign(m=m, **{node: dict(values) for node, values in RIG.items()})


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return in_batch(planned(6), tmp_path_factory.mktemp("live") / "rig")


def test_the_deviation_is_that_of_the_analysis(recorded: Path):
    said: list[str] = []
    live = LiveBla(planned(6), said.append)
    for realization in range(6):
        live.take(1, realization, bag_folder(recorded, 1, realization))
    bla = analyze(recorded, method="robust").levels[1].bla
    expected = 20.0 / np.log(10.0) * np.sqrt(bla.var_total / 2.0) / np.abs(bla.g)
    np.testing.assert_allclose(live.deviations_db(1), expected)
    assert live.deviations_db(0) is None
    assert len(said) == 5 and said[0].startswith("level 1: 2 realizations, standard deviation of")


def test_the_deviation_of_one_campaign_is_the_scatter_of_twenty_within_30_percent():
    whole = campaign(m=120, excitation={"amplitudes_rad": [0.02], "periods": 2})
    magnitudes, deviations = [], []
    for part in range(20):
        live = LiveBla(whole, lambda _: None)
        for spectra in simulate_level(whole, 0, range(6 * part, 6 * part + 6)).spectra:
            live.add(0, spectra)
        deviations.append(live.deviations_db(0))
        magnitudes.append(20.0 * np.log10(np.abs(live.estimate(0).g)))
    scatter = np.std(magnitudes, axis=0, ddof=1)
    stated = np.sqrt(np.mean(np.square(deviations), axis=0))
    reliable = stated < 2.0
    assert reliable.sum() >= 8
    assert 0.7 < np.median(scatter[reliable] / stated[reliable]) < 1.3


def test_a_level_ends_when_it_is_good_enough_and_not_before(recorded: Path):
    said: list[str] = []
    live = LiveBla(planned(6), said.append, until_db=1e3)
    for realization in range(FEWEST):
        assert not live.enough(0)
        live.take(0, realization, bag_folder(recorded, 0, realization))
    assert live.enough(0) and live.enough(0) and not live.enough(1)
    told = [each for each in said if "good enough" in each]
    assert len(told) == 1 and "good enough after 4 of 6 realizations" in told[0]
    strict = LiveBla(planned(6), said.append, until_db=1e-3)
    strict.take_up(recorded, [(1, 5)])
    assert not strict.enough(0) and strict.estimate(1).realizations == 5


def test_the_graph_records_no_more_than_is_needed(run, domain: int, tmp_path: Path):
    options = [f"--set=excitation.{each}" for each in ("base_frequency_hz=2", "f_min_hz=2")]
    done = run(
        *("run", "--composed", "--out", tmp_path / "rig", "--level", 0.02, "--realizations", 9),
        *("--periods", 1, *options, "--until-db", 500, "--live"),
    )
    assert done.exit_code == 0, done.output
    assert "good enough after 4 of 9 realizations" in done.stderr
    assert "o: magnitude of the BLA" in done.stderr
    assert len(find_bags(tmp_path / "rig")) == FEWEST


def test_a_chart_shows_where_the_curves_are():
    f = np.geomspace(1.0, 100.0, 40)
    lines = chart(f, {"o": 1.0 / f, ".": np.full(40, 1e-2)}).splitlines()
    assert len(lines) == 15 and lines[0].startswith("    0.0 |o")
    assert lines[13].startswith("  -40.0 |.") and lines[13].endswith("o")
    assert lines[14].split() == ["1", "100"]
    assert chart(f, {"o": np.zeros(40)}) == "(nothing to show)"
