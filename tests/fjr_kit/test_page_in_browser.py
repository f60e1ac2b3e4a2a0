"""The switches of the frequency axis on a page of levels, in a browser. Needs chromium."""

from __future__ import annotations

import numpy as np
import pytest
from browser import found_in, needs_chromium
from test_page import shown  # noqa: F401

from fjr_kit.plots import linked, trace

pytestmark = needs_chromium

SCRIPT = """
  const marked = () => [...document.querySelectorAll(".switches [aria-pressed=true]")];
  const state = () => ({
    pressed: marked().map((button) => button.textContent),
    type: plots[0].layout.xaxis.type ?? "linear", title: plots[0].layout.xaxis.title.text,
    ticks: [...plots[0].querySelectorAll(".xtick text")].map((t) => Number(t.textContent)),
    x: plots[0].data[0].x, hover: plots[0].data[0].hovertemplate,
  });
  found.narrow = state();
  find("button[data-level='2']").click();
  await rest();
  found.mixed = state();
  find("button[data-level='1']").click();
  await rest();
  found.wide = state();
  find("button[data-level='3']").click();
  await rest();
  found.bench = state();
  find("button[data-level='0']").click();
  find("[data-scale=log]").click();
  find("[data-unit='rad/s']").click();
  await rest();
  found.chosen = state();
  const size = () => {
    const {width, height} = plots[0].querySelector("svg").getBoundingClientRect();
    return {width, height, place: plots[0].clientHeight};
  };
  const resized = async (width) => {
    document.body.style.maxWidth = `${width}px`;
    dispatchEvent(new Event("resize"));
    for (let i = 0; i < 5; i++) await rest();
    return size();
  };
  found.sizes = [size(), await resized(700), await resized(400), await resized(700)];
  dispatchEvent(new Event("beforeprint"));
  await rest();
  dispatchEvent(new Event("afterprint"));
  for (let i = 0; i < 5; i++) await rest();
  found.sizes.push(size());
"""


def over(frequency_hz: np.ndarray):
    return {
        "one": linked([trace(frequency_hz, frequency_hz, "a", "--ink")], ["y"], [1], frequency_hz)
    }


@pytest.fixture
def found(shown, tmp_path):  # noqa: F811
    narrow, wide = np.linspace(8.0, 40.0, 9), np.geomspace(1.0, 100.0, 9)
    mixed = over(narrow) | {"two": over(wide)["one"]}
    levels = [over(narrow), over(wide), mixed, over(np.geomspace(13.0, 249.0, 9))]
    page = shown([], items=["narrow", "wide", "mixed", "bench"], levels=levels)
    file = tmp_path / "page.html"
    file.write_text(page, encoding="utf-8")
    return found_in(file, SCRIPT)


def test_the_switches_mark_the_axis_of_the_level_that_is_shown(found):
    assert found["narrow"]["pressed"] == ["Hz", "linear"] and found["narrow"]["type"] == "linear"
    assert found["wide"]["pressed"] == ["Hz", "logarithmic"] and found["wide"]["type"] == "log"


def test_a_plot_of_less_than_a_decade_has_ticks_on_a_logarithmic_axis(found):
    chosen = found["chosen"]
    assert chosen["pressed"] == ["rad/s", "logarithmic"] and chosen["type"] == "log"
    assert chosen["title"] == "angular frequency (rad/s)" and "rad/s" in chosen["hover"]
    np.testing.assert_allclose(chosen["x"], 2.0 * np.pi * np.linspace(8.0, 40.0, 9), rtol=1e-5)
    assert chosen["ticks"] == [50.0, 100.0, 200.0]


def test_a_plot_of_less_than_two_decades_has_ticks_between_the_powers_of_ten(found):
    assert found["bench"]["type"] == "log"
    assert found["bench"]["ticks"] == [20.0, 50.0, 100.0, 200.0]


def test_a_plot_keeps_its_height_when_the_window_or_the_medium_changes(found):
    first, narrower, card, back, after_print = found["sizes"]
    assert first["width"] > narrower["width"] == back["width"] > card["width"] > 0
    assert back["width"] == after_print["width"]
    heights = [first["height"], narrower["height"], back["height"], after_print["height"]]
    assert heights == [300] * 4 and card["height"] == 360
    assert all(size["place"] == size["height"] for size in found["sizes"])


def test_no_scale_is_marked_where_plots_differ(found):
    assert found["mixed"]["pressed"] == ["Hz"]
