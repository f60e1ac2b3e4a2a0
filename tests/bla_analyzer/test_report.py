from __future__ import annotations

import re

import numpy as np
import pytest
from html_page import EVIL, Page
from plotly.offline import get_plotlyjs
from synthetic_result import make_result

from bla_analyzer.report.report_page import render_report
from bla_analyzer.results.result import Result
from fjr_kit.check import Check


@pytest.fixture(scope="module")
def result() -> Result:
    return make_result()


@pytest.fixture(scope="module")
def html(result) -> str:
    return render_report(result, {"command": "fjr analyze x", "date": "2026-01-02"})


def test_the_report_is_well_formed_and_deterministic(result, html):
    page = Page(html)
    names = [tag for tag, _ in page.tags]
    assert names.count("html") == names.count("body") == names.count("h1") == 1
    assert html == render_report(result, {"command": "fjr analyze x", "date": "2026-01-02"})


def test_the_report_asks_nothing_of_any_network(html):
    own = html.replace(get_plotlyjs(), "")
    assert len(own) < len(html)
    assert not re.search(r"https?:|//[\w.]+\.\w+/|@import|url\(", own)
    for tag, attrs in Page(html).tags:
        assert tag not in ("link", "iframe", "object", "embed", "base", "img")
        assert not {"src", "href", "srcset", "action", "data", "background"} & set(attrs), tag
    [policy] = [
        attrs["content"]
        for _, attrs in Page(html).tags
        if attrs.get("http-equiv") == "Content-Security-Policy"
    ]
    assert policy.startswith("default-src 'none'") and "http" not in policy


def hostile() -> Result:
    made = make_result((7e-3, 3e-2))
    named = {"name": EVIL, "description": EVIL}
    comparison = made.levels[0].comparisons[0].model_copy(update=named)
    level = made.levels[0].model_copy(update={"comparisons": (comparison,)})
    check = Check(name=EVIL, level=0, passed=False, value=np.inf, limit=np.nan, sentence=EVIL)
    changes = {
        "source": EVIL,
        "bags": (EVIL,),
        "notes": (EVIL,),
        "levels": (level, made.levels[1]),
        "checks": (check,),
        "controller": {EVIL: EVIL},
    }
    return made.model_copy(update=changes)


def test_texts_from_bags_cannot_become_code():
    html = render_report(hostile(), {"command": EVIL})
    page = Page(html)
    assert len(page.scripts) == 3 and not any(tag == "img" for tag, _ in page.tags)
    assert not any(name.startswith("on") for _, attrs in page.tags for name in attrs)
    assert EVIL in page.texts
    names = [trace["name"] for trace in page.data()["levels"][0]["bla"]["data"]]
    assert any("&lt;/script&gt;" in name for name in names)
    assert not any("<" in name for name in names)


def test_the_plots_hold_the_numbers(result, html):
    plots = Page(html).data()
    assert len(plots["levels"]) == 3 and set(plots["overview"]) == {"all-bla", "all-v", "all-power"}
    bla = result.levels[1].bla
    traces = [t for t in plots["levels"][1]["bla"]["data"] if t["name"].startswith("BLA")]
    points = sorted(
        (x, y) for t in traces if "yaxis" not in t for x, y in zip(t["x"], t["y"], strict=True)
    )
    expected = 20 * np.log10(abs(bla.g))
    assert np.allclose([y for _, y in points], expected, rtol=1e-5)
    assert np.allclose([x for x, _ in points], bla.frequency_hz)
    [even] = [
        t
        for t in plots["levels"][1]["distortion"]["data"]
        if t["name"] == "even distortion" and t["mode"] == "lines"
    ]
    assert np.allclose(even["y"], 20 * np.log10(result.levels[1].even.smoothed), rtol=1e-5)


def test_only_significant_nonlinear_variance_is_drawn(result, html):
    bla = result.levels[0].bla
    drawn = [
        t
        for t in Page(html).data()["levels"][0]["bla"]["data"]
        if t["name"].startswith("\N{GREEK SMALL LETTER SIGMA} nonlinear")
    ]
    keep = (bla.nonlinear_p_value < 0.05) & (bla.var_nonlinear > 0)
    assert 0 < keep.sum() < keep.size
    assert np.allclose(drawn[0]["x"], bla.frequency_hz[keep])
    assert np.allclose(drawn[0]["y"], 10 * np.log10(bla.var_nonlinear[keep]), rtol=1e-5)


def test_long_signals_keep_their_extremes(result, html):
    traces = Page(html).data()["levels"][2]["time"]["data"]
    signals = result.levels[2].signals
    for trace, values in zip(
        traces, (signals.reference_rad, signals.torque_nm, signals.position_rad), strict=True
    ):
        assert len(trace["x"]) <= 2000 and trace["x"] == sorted(trace["x"])
        assert max(trace["y"]) == pytest.approx(values.max(), rel=1e-5)
        assert min(trace["y"]) == pytest.approx(values.min(), rel=1e-5)


def test_every_plot_has_its_place_and_every_place_a_plot(html):
    page = Page(html)
    places = {attrs["id"] for _, attrs in page.tags if attrs.get("class") == "plot"}
    plots = page.data()
    assert places == set(plots["overview"]) | set(plots["levels"][0])


def test_every_colour_is_in_the_style_sheet_light_and_dark(html):
    [style] = re.findall(r"<style>(.*?)</style>", html, re.DOTALL)
    light, dark = re.findall(
        r"\{\s*color-scheme.*?\}|:root:not\(\.light\) \{.*?\}", style, re.DOTALL
    )[:2]
    used = set(re.findall(r'"color":"(--[\w-]+)"', html)) | set(
        re.findall(r'olor: "(--\w+)"', html)
    )
    assert {"--excited", "--odd", "--even", "--noise"} <= used
    for name in used:
        assert f"{name}:" in light and f"{name}:" in dark, name


def test_the_top_says_what_failed(html):
    text = " ".join(Page(html).texts)
    assert "1 of 22 checks failed" in text and "Var(U)/|U|^2 reaches 0.04" in text
    assert "Nearest model: G0_viscous" in text
    assert "fjr analyze x" in text and "2026-01-02" in text


def test_a_result_without_bla_noise_or_checks_still_reports():
    made = make_result((7e-3,), periods=1, checks=())
    level = made.levels[0].model_copy(update={"bla": None, "comparisons": ()})
    for one in (made, made.model_copy(update={"levels": (level,), "controller": None})):
        page = Page(render_report(one, {}))
        text = " ".join(page.texts)
        assert "No checks" in text and page.data()["overview"] == {}
    assert "No BLA" in text and "bla" not in page.data()["levels"][0]
