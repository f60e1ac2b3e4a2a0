"""The pages as they are read: colours in the dark, the paper's page, tools beside a colour bar."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
import pytest
from html_page import EVIL, Page

from fjr_kit.page import asset
from fjr_kit.plots import BARRED
from fjr_validation.paper import drawing, fig7_to_9_drawing
from fjr_validation.paper.page import render, verdict
from fjr_validation.paper.part import Part, PlotPlace, Statement, Table
from fjr_validation.paper.settings import QUICK
from fjr_validation.paper.shift_map import _heat
from gap_diagnosis.report.gap_plots import SCALE


def luminance(color: str) -> float:
    """Relative luminance of #rrggbb (WCAG 2)."""
    values = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(one: str, other: str) -> float:
    """Contrast ratio of two colours (WCAG 2)."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.fixture(params=["light", "dark"])
def colours(request) -> dict[str, str]:
    light, dark = asset("report.css").split("@media (prefers-color-scheme: dark)")
    text = light if request.param == "light" else dark.partition("}")[0]
    return dict(re.findall(r"(--[\w-]+): (#[0-9a-f]{6});", text))


def test_the_maps_noise_is_nearest_to_the_page_and_the_strongest_farthest(colours):
    against = [contrast(colours[name], colours["--paper"]) for _, name in SCALE]
    assert against[0] == min(against) < 2.0
    assert against[-1] == max(against)
    assert all(later > earlier for earlier, later in pairwise(against[:3]))


def test_printed_colours_can_be_read_on_the_page(colours):
    for printed, name in drawing.THEMED.items():
        assert contrast(colours[name], colours["--paper"]) >= 3.0, (printed, name)


def statement(words: str) -> Statement:
    return Statement("Fig. 1", "what the paper says", "what was measured", words, "fjr paper")


def test_every_statement_of_the_paper_is_counted_once():
    words = ["repeats"] * 13 + ["differs"] + ["cannot be right"] * 4
    words += ["finding", "target met", "target met", "target missed"]
    assert verdict([statement(word) for word in words]) == (
        "Of 18 statements of the paper 13 repeat, 1 differs, 4 cannot be right; 2 of 3 targets are "
        "met."
    )
    assert verdict([statement("differs")] * 2) == (
        "Of 2 statements of the paper 2 differ, 0 repeat; 0 of 0 targets are met."
    )


def paper_page(text: str) -> Page:
    """Return the paper's page with a text in every field."""
    table = Table(text, (text, "b"), ((text, "x"),))
    place = PlotPlace("one", text, text, {"data": [], "layout": {}})
    said = Statement(subject=text, paper=text, measured=text, verdict=text, repeat=text)
    part = Part(text, (text,), (said,), (place,), (table,), terms={text: text})
    return Page(render(text, text, [part], {text: text}))


def test_the_papers_page_escapes_every_text():
    page, plain = paper_page(EVIL), paper_page("plain")
    assert [tag for tag, _ in page.tags] == [tag for tag, _ in plain.tags]
    assert page.texts.count(EVIL) == plain.texts.count("plain") >= 12


def level() -> dict:
    f = np.linspace(0.1, 50.0, 30)
    g = np.full(f.shape, 0.01 + 0j)
    part = {"frequency_hz": f, "g": g, "g_viscous": g, "predicted": g, "radius": 0.1 * abs(g)}
    return part | {"var_nonlinear": abs(g) ** 2, "var_noise": abs(g) ** 2 / 10.0}


def test_decibels_of_the_papers_figures_have_their_reference():
    results = {"fig9_both": level()}
    results |= {f"fig9_{name}_noise": level() for name, _ in fig7_to_9_drawing.FIG9}
    for plot in (fig7_to_9_drawing.fast_plot(level()), fig7_to_9_drawing.fig9_plot(results)):
        assert "(dB re 1 rad/(N m))" in plot["layout"]["yaxis"]["title"]["text"]
    for figure in (
        fig7_to_9_drawing.fast_figure(level(), (-250.0, 0.0)),
        fig7_to_9_drawing.fig9_figure(results),
    ):
        assert "(dB re 1 rad/(N m))" in figure.axes[0].get_ylabel()


def test_a_colour_bar_has_the_tools_above_it():
    names = [f"sweep_both_{i:02d}" for i in range(QUICK.sweep_amplitudes)]
    extra = {"v": np.ones(8), "v_resampled": np.ones((200, 8)), "periodic": 1.0}
    place: PlotPlace = _heat({name: level() | extra for name in names}, QUICK, "both")
    assert place.plot["data"][0]["colorbar"]["title"]["text"].startswith("dB re 1")
    assert place.plot["layout"].items() >= BARRED.items()
    assert BARRED["modebar"]["orientation"] == "h" and BARRED["margin"]["t"] >= 30
