"""Parts that all pages share: what is escaped, tables on a phone, numbers, traces."""

from __future__ import annotations

import numpy as np
import pytest
from html_page import EVIL, Page

from fjr_kit.page import Column, Mark, Row, narrow_form, number, render_page
from fjr_kit.plots import linked, trace

COLUMNS = [Column("name"), Column("value", "dB", ".4g"), Column("")]
TEMPLATE = """{% extends "page.html" %}
{% import "parts.html" as parts %}
{% block top %}{{ parts.bullets(items) }}{% endblock %}
{% block sections %}{{ parts.table(columns, rows, caption, levels) }}
{% call parts.figure("one", 300) %}{{ caption }}{% endcall %}
{% call parts.figure("two", 200) %}{{ caption }}{% endcall %}
{{ parts.level_choice(items) }}{{ parts.bags(items) }}
{{ parts.verdict(caption) }}{% endblock %}
"""


@pytest.fixture
def shown(tmp_path, monkeypatch):
    """Return what renders a page of a package that has nothing but a template of all parts."""
    folder = tmp_path / "pages_of_a_test"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "one.html").write_text(TEMPLATE)
    monkeypatch.syspath_prepend(tmp_path)

    def render(
        rows: list[Row], columns=COLUMNS, text: str = "text", items=None, levels=({},)
    ) -> str:
        overview = {} if "one" in levels[0] else {"one": {"data": [], "layout": {"title": text}}}
        return render_page(
            "pages_of_a_test",
            "one.html",
            title=text,
            plots={"overview": overview, "levels": list(levels)},
            provenance={text: text},
            items=items or [text],
            columns=columns,
            rows=rows,
            caption=text,
            levels=range(len(rows)),
        )

    return render


def test_no_part_of_a_page_lets_a_text_become_code(shown):
    rows = [(EVIL, Mark(EVIL, EVIL), [EVIL, EVIL])]
    page = Page(shown(rows, [Column(EVIL, EVIL)] * 3, EVIL))
    plain = Page(shown([("a", Mark("a", "pass"), ["a", "a"])]))
    assert [tag for tag, _ in page.tags] == [tag for tag, _ in plain.tags]
    assert page.data()["overview"]["one"]["layout"]["title"] == EVIL
    assert page.texts.count(EVIL) == plain.texts.count("text") + 4 + 6


def test_a_page_has_the_switches_of_the_frequency_axis_where_a_plot_is_over_frequency(shown):
    f = np.array([1.0, 2.0])
    over = {"one": linked([trace(f, f, "a", "--ink")], ["y"], [1.0], f)}
    nowhere = {"one": {"data": [], "layout": {}}}
    assert 'class="switches"' not in shown([]) and 'class="switches"' not in shown(
        [], levels=[nowhere]
    )
    switches = [a for tag, a in Page(shown([], levels=[nowhere, over])).tags if tag == "button"]
    assert [a.get("data-unit") or a.get("data-scale") for a in switches[:5]] == [
        *("Hz", "rad/s", "log", "linear", None)
    ]


def test_each_cell_of_a_card_is_named(shown):
    page = Page(shown([("one", 1.0, Mark.of(True)), ("two", 2.0, "")]))
    assert ("table", {"class": "cards"}) in page.tags
    cells = [attrs for tag, attrs in page.tags if tag == "td"]
    assert [cell.get("data-head") for cell in cells] == ["value, dB", None] * 2
    assert [cell.get("class") for cell in cells] == ["number", None] * 2


def test_an_empty_cell_is_empty_so_that_a_card_hides_it(shown):
    assert "<td></td>" in shown([("one", 1.0, "")])


def test_a_long_table_of_numbers_stays_a_table_and_one_of_sentences_does_not():
    numbers: list[Row] = [("x", float(i), "yes") for i in range(50)]
    assert narrow_form(numbers) == "wide" and narrow_form(numbers[:20]) == "cards"
    sentence = "a sentence that no column of a phone can hold beside others"
    for long in (sentence, sentence.split(), Mark(sentence, "fail")):
        assert narrow_form([("x", 0.0, long), *numbers]) == "cards"


def test_numbers_have_a_minus_sign_and_a_dash_where_there_is_none():
    assert number(-1.5e-7, ".2g") == "\N{MINUS SIGN}1.5e\N{MINUS SIGN}07"
    assert number(-0.001, "+.1f") == number(0.001, "+.1f") == "0.0"
    assert number(float("nan"), ".2g") == number(float("inf"), "d") == "\N{EN DASH}"


def test_a_trace_has_a_line_markers_and_bars_as_asked():
    made = trace([1.0, 2.0], [3.0, np.nan], "<b>", "--ink", dash="dot", symbol="circle", row=2,
                 unit="dB", band=([2.0, 2.0], [5.0, 5.0]), showlegend=False)  # fmt: skip
    assert made["mode"] == "lines+markers" and made["name"] == "&lt;b&gt;"
    assert made["y"] == [3.0, None] and made["yaxis"] == "y2" and made["showlegend"] is False
    assert made["error_y"]["array"] == [2.0, None] and made["error_y"]["arrayminus"] == [1.0, None]
    assert made["hovertemplate"].startswith("%{x:.4g} Hz<br>%{y:.4g} dB")
    assert trace([1.0], [1.0], "a", "--ink", symbol="square")["mode"] == "markers"
