from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from html_page import EVIL, Page
from plotly.offline import get_plotlyjs
from synthetic_result import make_result

from bla_analyzer.report.report_page import render_report
from bla_analyzer.results.result import LinkBla, Result
from bla_analyzer.results.terms import TERMS
from bla_analyzer.results.terms import glossary as terms_of_glossary
from fjr_kit.check import Check
from fjr_kit.document_tables import in_step


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
    assert len(plots["levels"]) == 3
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


def test_the_page_holds_every_view(html):
    plots = Page(html).data()
    over = {"all-bla", "all-coherence", "all-sensitivity", "all-v", "all-power"}
    own = {"bla", "coherence", "nyquist", "loop", "sensitivity", "spectra", "distortion", "time"}
    assert set(plots["overview"]) == over
    assert [set(level) for level in plots["levels"]] == [own] * 3
    over_frequency = {"all-bla", "all-coherence", "all-sensitivity", "bla", "coherence"}
    over_frequency |= {"sensitivity", "spectra", "distortion"}
    every = plots["overview"] | plots["levels"][0]
    assert {name for name, plot in every.items() if plot.get("linked")} == over_frequency
    assert {name for name, plot in every.items() if plot.get("plane")} == {"nyquist", "loop"}
    switches = [a for tag, a in Page(html).tags if tag == "button" and "data-level" not in a]
    assert [a.get("data-unit") or a.get("data-scale") for a in switches] == [
        *("Hz", "rad/s", "log", "linear", None)
    ]


def test_the_band_and_the_discs_are_those_of_the_result(result, html):
    level, plots = result.levels[1], Page(html).data()["levels"][1]
    [band] = [t for t in plots["bla"]["data"] if t["name"] == "95 % band" and "yaxis" not in t]
    size, count = abs(level.bla.g), level.bla.g.size
    low, high = band["y"][:count], band["y"][count : 2 * count][::-1]
    assert np.allclose(high, 20 * np.log10(size + level.bla.radius_95), rtol=1e-5)
    bottom = np.maximum(size - level.bla.radius_95, 0.1 * size)
    assert np.allclose(low, 20 * np.log10(bottom), rtol=1e-5)
    [disc] = [t for t in plots["loop"]["data"] if t["name"] == "95 % discs"]
    edge = np.array([complex(x, y) for x, y in zip(disc["x"][:24], disc["y"][:24], strict=True)])
    found = level.bla.sensitivity
    away = abs(1.0 / (edge + 1.0) - found.s[0])
    assert np.allclose(away, found.s_radius_95[0], rtol=1e-2)
    [top] = [t for t in plots["sensitivity"]["data"] if t["name"].startswith("Ms")]
    peak = np.nanmax(np.where(level.bla.reliable, abs(found.s), np.nan))
    assert 10 ** (top["y"][0] / 20) == pytest.approx(peak, rel=1e-4)


def test_what_is_seen_of_the_nyquist_plot_holds_the_reliable_lines_alone(result):
    level = result.levels[1]
    doubtful = np.arange(level.bla.g.size) < 3
    radius = np.where(doubtful, 1e3, level.bla.radius_95)
    bla = level.bla.model_copy(update={"reliable": ~doubtful, "radius_95": radius})
    weak = result.model_copy(update={"levels": [level.model_copy(update={"bla": bla})]})
    nyquist = Page(render_report(weak, {})).data()["levels"][0]["nyquist"]
    [discs] = [t for t in nyquist["data"] if t["name"].startswith("95 % discs")]
    assert max(abs(x) for x in discs["x"] if x is not None) < 1.0
    layout = nyquist["layout"]
    for axis, values in (("xaxis", bla.g.real), ("yaxis", bla.g.imag)):
        low, high = layout[axis]["range"]
        g, reach = values[~doubtful], radius[~doubtful]
        assert low < (g - reach).min() and (g + reach).max() < high
        assert high - low < 1.0


def told(made: Result) -> str:
    return " ".join(" ".join(Page(render_report(made, {})).texts).split())


def test_a_view_that_cannot_be_had_is_told_in_words(result):
    assert "No sensitivity" not in told(result)
    level = result.levels[0]

    def with_bla(**changes) -> Result:
        bla = level.bla.model_copy(update=changes)
        return result.model_copy(update={"levels": (level.model_copy(update={"bla": bla}),)})

    silent = with_bla(sensitivity=None)
    assert "no reference was recorded that moves apart from the torque" in told(silent)
    law = {"kind": "pd", "p": 9.0, "d": 1.0, "derivative_on": "measurement"}
    other = silent.model_copy(update={"controller": law})
    assert "the controller does not act on the error alone" in told(other)
    unknown = np.full(level.bla.g.shape, np.nan)
    bare = with_bla(coherence=unknown, radius_95=unknown)
    assert "No coherence" in told(bare) and "No 95 % band" in told(bare)
    none = level.model_copy(update={"bla": None, "comparisons": ()})
    without = result.model_copy(update={"levels": (none,)})
    assert "There is no BLA at this level, so neither" in told(without)


def test_the_page_and_the_glossary_say_the_same(html):
    glossary = Path(__file__).parents[2] / "docs" / "glossary.md"
    document = glossary.read_text("utf-8")
    made = in_step(document, {"terms of an analysis": terms_of_glossary()})
    assert made == document, "renew: python -m bla_analyzer.results.terms docs/glossary.md"
    page = Page(html)
    assert {"V", "M", "P"} < set(TERMS) and set(TERMS.values()) <= set(page.texts)
    tips = {attrs["title"] for tag, attrs in page.tags if tag == "abbr"}
    assert {TERMS[word] for word in ("V", "M", "P", "S", "Ms")} <= tips <= set(TERMS.values())


def test_the_link_position_is_in_every_view_of_g(result):
    bla = result.levels[0].bla
    half = {"g": 0.5 * bla.g, "radius_95": 0.5 * bla.radius_95, "var_total": 0.25 * bla.var_total}
    link = LinkBla.of(bla.model_copy(update=half), 0.5 * bla.var_total + 0j, 0j * bla.var_total)
    level = result.levels[0].model_copy(update={"bla": bla.model_copy(update={"link": link})})
    made = result.model_copy(update={"levels": (level,)})
    [plots] = Page(render_report(made, {})).data()["levels"]
    for view, count in (("bla", 5), ("coherence", 1), ("nyquist", 2)):
        names = [t["name"] for t in plots[view]["data"] if "link position" in t["name"]]
        assert len(names) == count, view
    text = told(made)
    assert "Lines of Level 0, 1 mrad, link position" in text and text.count("correlation") == 1


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
