"""The report in a browser without a screen: switches, linked zoom, print. Needs chromium."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from browser import chromium, found_in, needs_chromium
from synthetic_result import make_result

from bla_analyzer.report.report_page import render_report

pytestmark = needs_chromium

SCRIPT = """
  const axes = () => Object.fromEntries(plots.filter((p) => p.layout).map((p) => [p.id,
    {type: p.layout.xaxis.type ?? "linear", range: p._fullLayout.xaxis.range.slice(),
     title: p.layout.xaxis.title.text, points: p.data.at(-1).x.length}]));
  found.drawn = plots.filter((p) => p.querySelector("svg.main-svg")).map((p) => p.id);
  found.first = axes();
  await Plotly.relayout("bla", {"xaxis.range": [0, 1]});
  await rest();
  found.zoomed = axes();
  find("[data-unit='rad/s']").click();
  await rest();
  found.radians = axes();
  found.hover = document.getElementById("bla").data.at(-1).hovertemplate;
  find("[data-scale=linear]").click();
  await rest();
  found.linear = axes();
  find("[data-whole]").click();
  await rest();
  found.whole = axes();
  dispatchEvent(new Event("beforeprint"));
  await rest();
  found.widths = plots.filter((p) => p._fullLayout).map((p) => p._fullLayout.width);
  found.light = document.documentElement.classList.contains("light");
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("page") / "report.html"
    file.write_text(render_report(make_result(), {"command": "fjr analyze x"}), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def found(page) -> dict:
    return found_in(page, SCRIPT)


LINKED = ("all-bla", "all-coherence", "all-sensitivity", "bla", "coherence", "sensitivity")
LINKED += ("spectra", "distortion")


def test_every_plot_is_drawn(found):
    own = {*LINKED, "all-v", "all-power", "nyquist", "loop", "time"}
    assert set(found["drawn"]) == own


def test_all_frequency_axes_follow_a_zoom(found):
    for name in LINKED:
        assert found["first"][name]["type"] == "log"
        np.testing.assert_allclose(found["zoomed"][name]["range"], [0.0, 1.0], err_msg=name)
    lines = make_result().levels[0].bla.frequency_hz
    shown = np.sum((lines >= 1.0) & (lines <= 10.0))
    assert found["zoomed"]["nyquist"]["points"] == shown < found["first"]["nyquist"]["points"]
    assert found["zoomed"]["time"] == found["first"]["time"]


def test_the_switches_change_all_frequency_axes_and_keep_the_band(found):
    for name in LINKED:
        radians, linear = found["radians"][name], found["linear"][name]
        assert radians["title"] == "angular frequency (rad/s)"
        np.testing.assert_allclose(radians["range"], np.log10([2 * np.pi, 20 * np.pi]))
        assert linear["type"] == "linear" and found["whole"][name]["type"] == "linear"
        np.testing.assert_allclose(linear["range"], [2 * np.pi, 20 * np.pi])
        assert found["whole"][name]["range"][1] > 2 * np.pi * 49.0
    assert "rad/s" in found["hover"] and " Hz" not in found["hover"]
    assert found["whole"]["nyquist"]["points"] == found["first"]["nyquist"]["points"]


def test_print_is_light_and_no_plot_is_wider_than_the_paper(found):
    assert found["light"] and set(found["widths"]) == {640}


def test_it_prints_to_pdf(page):
    pdf = page.with_suffix(".pdf")
    chromium("--no-pdf-header-footer", f"--print-to-pdf={pdf}", page.as_uri())
    assert pdf.read_bytes().startswith(b"%PDF") and pdf.read_bytes().count(b"/Type /Page\n") > 5
